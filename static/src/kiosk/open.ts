/** Opens the tour as a kiosk. */

import type { Addresses } from "../address.ts";
import type { Files } from "../files.ts";
import type { Room, Tour } from "../tour.ts";
import { Visit } from "../visit.ts";
import { bringWords } from "../words.ts";
import { Kiosk } from "./kiosk.ts";
import type { KioskSettings } from "./settings.ts";

export async function openKiosk(
  host: HTMLElement,
  canvas: HTMLCanvasElement,
  files: Files,
  addresses: Addresses,
  tour: Tour,
  room: Room,
  settings: KioskSettings,
): Promise<void> {
  const [language = "en"] = tour.languages;
  await bringWords(...tour.languages); // any of them may be touched, and spoken at once
  const visit: Visit = await Visit.of(host, canvas, files, addresses, tour, room, {
    kiosk: true,
    language,
    opened: (of) => kiosk.opened(of),
    played: () => kiosk.played(),
    home: () => kiosk.home(),
  });
  const kiosk = new Kiosk(host, files, tour, settings, visit);
  visit.start(false);
  kiosk.run();
}
