/** The entry of a published page: what it shows lies beside it, on its server. */

import { PathAddresses } from "./address.ts";
import { SiteFiles } from "./files.ts";
import { hostIn, open } from "./open.ts";

const host = hostIn(document);
const site = new URL(host.dataset["site"] || "./", location.href);
await open(host, new SiteFiles(site), new PathAddresses(site));
