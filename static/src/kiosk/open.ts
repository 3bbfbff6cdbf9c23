/** Opens the tour as a kiosk. */

import type { Addresses } from "../address.ts";
import type { Files } from "../files.ts";
import type { Room, Tour } from "../tour.ts";
import { Visit } from "../visit.ts";
import { Kiosk } from "./kiosk.ts";
import type { KioskSettings } from "./settings.ts";

export function openKiosk(
  host: HTMLElement,
  files: Files,
  addresses: Addresses,
  tour: Tour,
  room: Room,
  settings: KioskSettings,
): void {
  const visit: Visit = new Visit(host, files, addresses, tour, room, {
    kiosk: true,
    opened: (of) => kiosk.opened(of),
    home: () => kiosk.home(),
  });
  const kiosk = new Kiosk(host, files, tour, settings, visit);
  visit.start(false);
  kiosk.run();
}
