/** The entry of a single file: the page carries what it shows, and lies anywhere. */

import { FragmentAddresses } from "./address.ts";
import { CarriedFiles } from "./files.ts";
import { hostIn, open } from "./open.ts";

const files = new CarriedFiles(document);
await open(hostIn(document), files, new FragmentAddresses(), () => files.show(document));
