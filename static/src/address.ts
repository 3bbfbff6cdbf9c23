/**
 * Rooms, views and their addresses: `rooms/ID/index.html#at=x,y,z,yaw,pitch` below the site's
 * folder, whatever its path. Metres and degrees; the mode one looks in stands there too.
 */

import type { Triple, View } from "./tour.ts";

const ROOM_PATH = /^rooms\/([^/]+)\/(?:index\.html)?$/;
const FAR_M = 2;

/** Ways to see; walking is the rule and not named. */
export type Way = "walk" | "orbit" | "dollhouse" | "plan";

/** What an address says beside the room. */
export interface Place {
  readonly view: View | null;
  readonly way: Way;
  /** Number of a note, from 1, that is open. */
  readonly note: number | null;
}

/** The address of a room's page; what the present address asks for (`?...`) goes along. */
export function roomAddress(site: URL, id: string, search = "", place?: Place): string {
  const url = new URL(`rooms/${encodeURIComponent(id)}/index.html`, site);
  url.search = search;
  if (place) url.hash = hashOf(place);
  return url.href;
}

/** The room that an address names, or null where it is the tour's own page. */
export function roomAt(site: URL, address: string): string | null {
  const path = new URL(address).pathname;
  if (!path.startsWith(site.pathname)) return null;
  const match = ROOM_PATH.exec(path.slice(site.pathname.length));
  return match?.[1] === undefined ? null : decodeURIComponent(match[1]);
}

/** The part behind `#` that says a place. */
export function hashOf(place: Place): string {
  const parts: string[] = [];
  if (place.view) parts.push(`at=${numbersOf(place.view).join(",")}`);
  if (place.way !== "walk") parts.push(`see=${place.way}`);
  if (place.note !== null) parts.push(`note=${place.note}`);
  return parts.join("&");
}

/** What the part behind `#` says; what it says wrongly is left out. */
export function placeIn(hash: string): Place {
  const asked = new URLSearchParams(hash.replace(/^#/, ""));
  const note = Number(asked.get("note") ?? NaN);
  return {
    view: viewOf((asked.get("at") ?? "").split(",").map(Number)),
    way: wayOf(asked.get("see")),
    note: Number.isInteger(note) && note > 0 ? note : null,
  };
}

function wayOf(word: string | null): Way {
  return word === "orbit" || word === "dollhouse" || word === "plan" ? word : "walk";
}

/** Eye to the centimetre, heading and pitch to the tenth of a degree. */
function numbersOf({ position, look_at }: View): number[] {
  const [x, y, z] = [0, 1, 2].map((i) => (look_at[i] ?? 0) - (position[i] ?? 0));
  const yaw = (Math.atan2(y ?? 0, x ?? 0) * 180) / Math.PI;
  const pitch = (Math.atan2(z ?? 0, Math.hypot(x ?? 0, y ?? 0)) * 180) / Math.PI;
  return [...position.map((v) => rounded(v, 100)), rounded(yaw, 10), rounded(pitch, 10)];
}

function viewOf(numbers: readonly number[]): View | null {
  const [x, y, z, yawDeg, pitchDeg] = numbers;
  if (numbers.length !== 5 || !numbers.every((value) => Math.abs(value) < 1e6)) return null;
  if (x === undefined || y === undefined || z === undefined) return null;
  const yaw = ((yawDeg ?? 0) * Math.PI) / 180;
  const pitch = ((pitchDeg ?? 0) * Math.PI) / 180;
  const flat = Math.cos(pitch) * FAR_M;
  const look_at: Triple = [
    x + flat * Math.cos(yaw),
    y + flat * Math.sin(yaw),
    z + FAR_M * Math.sin(pitch),
  ];
  return { position: [x, y, z], look_at };
}

function rounded(value: number, parts: number): number {
  return Math.round(value * parts) / parts || 0;
}
