/**
 * How many visits there were, by day and language, and how often each room was entered; on this
 * device, of nobody.
 */

const KEY = "tourgen.visits";
const DAYS_KEPT = 400;
const TOUR = "";

/** By day, "2026-05-12", then by "room language"; " language" is of the tour. */
type Counts = Record<string, Record<string, number>>;

export class Visits {
  #counts: Counts;

  constructor() {
    this.#counts = read();
  }

  /** Counts a visit, which has begun. */
  begun(language: string, now: Date): void {
    this.#count(TOUR, language, now);
  }

  /** Counts a room that a visitor has come to. */
  entered(room: string, language: string, now: Date): void {
    this.#count(room, language, now);
  }

  #count(room: string, language: string, now: Date): void {
    const day = dayOf(now);
    const today = (this.#counts[day] ??= {});
    const key = `${room} ${language}`;
    today[key] = (today[key] ?? 0) + 1;
    const days = Object.keys(this.#counts).sort();
    for (const old of days.slice(0, Math.max(0, days.length - DAYS_KEPT))) delete this.#counts[old];
    write(this.#counts);
  }

  /** Of all days. */
  get total(): number {
    return this.rows.reduce((sum, [, room, , visits]) => sum + (room === TOUR ? visits : 0), 0);
  }

  /** One line each: day, room, "" for the tour, language, visits. */
  get rows(): readonly (readonly [day: string, room: string, language: string, visits: number])[] {
    return Object.entries(this.#counts)
      .sort()
      .flatMap(([day, counts]) =>
        Object.entries(counts)
          .sort()
          .map(([key, visits]) => {
            const [room = "", language = ""] = key.split(" ");
            return [day, room, language, visits] as const;
          }),
      );
  }

  /** As RFC 4180 has it. */
  get csv(): string {
    return [["day", "room", "language", "visits"], ...this.rows]
      .map((row) => `${row.join(",")}\r\n`)
      .join("");
  }
}

function dayOf(now: Date): string {
  const part = (value: number): string => String(value).padStart(2, "0");
  return `${now.getFullYear()}-${part(now.getMonth() + 1)}-${part(now.getDate())}`;
}

function read(): Counts {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(KEY) ?? "{}");
    return typeof kept === "object" && kept !== null ? (kept as Counts) : {};
  } catch {
    return {}; // refused, or cut short by a power cut
  }
}

/** A full disk loses counts, not the tour. */
function write(counts: Counts): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(counts));
  } catch {
    return;
  }
}
