/** The service corner: behind a PIN, how the kiosk fares, and who came. */

import { button, element } from "../dom.ts";
import type { Tour } from "../tour.ts";
import { mannerOf, textIn, type Words } from "../words.ts";
import type { Faults } from "./faults.ts";
import type { Lock } from "./settings.ts";
import type { Visits } from "./visits.ts";

const TRIES = 5;
const BARRED_MS = 60_000;
const MB = 2 ** 20;
const SHOWN = 30;

/** Since the PIN was given last, by whatever pad. */
let tries = 0;
let barredUntil = 0;

/** Asks for the PIN; calls `opened` when it was given. */
export function pinPad(lock: Lock, words: Words, opened: () => void): HTMLElement {
  if (!window.isSecureContext) return element("p", {}, words.servicePlain); // no digests are made there
  const dots = element("p", { class: "pin-dots", "aria-live": "polite" });
  let given = "";
  const show = (): void => {
    dots.textContent = "●".repeat(given.length) + "○".repeat(lock.length - given.length);
  };
  const press = async (digit: string): Promise<void> => {
    if (performance.now() < barredUntil || given.length >= lock.length) return;
    given += digit;
    show();
    if (given.length < lock.length) return;
    const right = (await digestOf(given, lock)) === lock.digest;
    given = "";
    if (right) {
      tries = 0;
      return opened();
    }
    tries += 1;
    if (tries >= TRIES) barredUntil = performance.now() + BARRED_MS;
    dots.textContent = words.serviceWrong;
  };
  const keys = [..."123456789", "", "0"].map((digit) => {
    if (digit === "") return element("span", {});
    const key = button("pin-key", () => void press(digit));
    key.textContent = digit;
    return key;
  });
  show();
  return element("div", { class: "pin-pad" }, dots, element("div", { class: "pin-keys" }, ...keys));
}

async function digestOf(pin: string, { salt, rounds }: Lock): Promise<string> {
  const bytes = (hex: string): Uint8Array<ArrayBuffer> =>
    Uint8Array.from(hex.match(/../g) ?? [], (pair) => Number.parseInt(pair, 16));
  const key = await crypto.subtle.importKey(
    "raw",
    new TextEncoder().encode(pin),
    "PBKDF2",
    false,
    ["deriveBits"],
  );
  const how = { name: "PBKDF2", hash: "SHA-256", salt: bytes(salt), iterations: rounds };
  const bits = new Uint8Array(await crypto.subtle.deriveBits(how, key, 256));
  return [...bits].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

export interface ServiceHost {
  readonly tour: Tour;
  readonly visits: Visits;
  readonly faults: Faults;
  readonly language: string;
  readonly words: Words;
  /** Keeps the table. Returns what is to be said of it. */
  keep(csv: string): Promise<string>;
  restart(): void;
  /** Closes the browser; null where nobody can. */
  readonly end: (() => void) | null;
}

/** What the person in charge reads. */
export function serviceSheet(host: ServiceHost): Node[] {
  const { words, visits, faults, language } = host;
  const number = new Intl.NumberFormat(mannerOf(language));
  const list = element("dl", { class: "figures" });
  const row = (name: string, value: string): void => {
    list.append(element("div", {}, element("dt", {}, name), element("dd", {}, value)));
  };
  row(words.serviceUptime, lasting(performance.now() / 1000));
  row(words.serviceMemory, memory(number) ?? words.serviceUnknown);
  row(words.serviceVisits, number.format(visits.total));
  row(words.serviceFaults, number.format(faults.all.length));
  const told = element("p", { role: "status" });
  const act = (label: string, does: () => void): HTMLElement => {
    const made = button("plain-button", does);
    made.textContent = label;
    return made;
  };
  const kept = async (): Promise<void> => {
    told.textContent = await host.keep(visits.csv);
  };
  const acts = [act(words.serviceExport, () => void kept()), act(words.reload, host.restart)];
  if (host.end) acts.push(act(words.serviceEnd, host.end));
  return [
    list,
    element("div", { class: "service-acts" }, ...acts),
    told,
    ...(visits.rows.length > 0 ? [visitTable(host)] : []),
    ...(faults.all.length > 0 ? [faultList(faults)] : []),
  ];
}

function visitTable({ tour, visits, language, words }: ServiceHost): HTMLElement {
  const titles = new Map(tour.rooms.map((room) => [room.id, textIn(room.title, language)]));
  const whole = textIn(tour.title, language);
  const head = [words.serviceDay, words.room, words.language, words.serviceVisits];
  const rows = [...visits.rows].reverse().slice(0, SHOWN);
  return element(
    "table",
    { class: "service-table" },
    element("tr", {}, ...head.map((cell) => element("th", { scope: "col" }, cell))),
    ...rows.map(([day, room, spoken, count]) =>
      element(
        "tr",
        {},
        ...[day, room ? (titles.get(room) ?? room) : whole, spoken, String(count)].map((cell) =>
          element("td", {}, cell),
        ),
      ),
    ),
  );
}

function faultList(faults: Faults): HTMLElement {
  const lines = [...faults.all].reverse().map(({ at, what }) => element("li", {}, `${at} ${what}`));
  return element("ol", { class: "service-faults" }, ...lines);
}

/** Hours, minutes and seconds. */
function lasting(seconds: number): string {
  const parts = [seconds / 3600, (seconds / 60) % 60, seconds % 60];
  return parts.map((part) => String(Math.floor(part)).padStart(2, "0")).join(":");
}

/** The script's, where the browser tells. */
function memory(number: Intl.NumberFormat): string | null {
  const { memory: told } = performance as Performance & {
    readonly memory?: { readonly usedJSHeapSize: number };
  };
  const bytes = told?.usedJSHeapSize ?? NaN;
  return Number.isFinite(bytes) ? `${number.format(Math.round(bytes / MB))} MB` : null;
}
