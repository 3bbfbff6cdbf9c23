/** Opens the tour as a kiosk. */

import type { Room, Tour } from "../tour.ts";
import { Visit } from "../visit.ts";
import { Kiosk } from "./kiosk.ts";
import type { KioskSettings } from "./settings.ts";

export function openKiosk(
  host: HTMLElement,
  site: URL,
  decoder: URL,
  tour: Tour,
  room: Room,
  settings: KioskSettings,
): void {
  const visit: Visit = new Visit(host, site, decoder, tour, room, {
    kiosk: true,
    opened: (of) => kiosk.opened(of),
    home: () => kiosk.home(),
  });
  const kiosk = new Kiosk(host, site, tour, settings, visit);
  visit.start(false);
  kiosk.run();
}
