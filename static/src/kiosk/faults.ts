/** What went wrong, kept on this device for the service corner. */

const KEY = "tourgen.faults";
const KEPT = 40;
const LETTERS = 300;

export interface Fault {
  /** ISO 8601. */
  readonly at: string;
  readonly what: string;
}

export class Faults {
  readonly #faults: Fault[];

  constructor(page: Window) {
    this.#faults = read();
    page.addEventListener("error", (event) => this.note(event.message));
    page.addEventListener("unhandledrejection", (event) => this.note(String(event.reason)));
  }

  get all(): readonly Fault[] {
    return this.#faults;
  }

  note(what: string): void {
    this.#faults.push({ at: new Date().toISOString(), what: what.slice(0, LETTERS) });
    this.#faults.splice(0, this.#faults.length - KEPT);
    try {
      localStorage.setItem(KEY, JSON.stringify(this.#faults));
    } catch {
      return; // a full disk
    }
  }
}

function read(): Fault[] {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    return Array.isArray(kept) ? (kept as Fault[]) : [];
  } catch {
    return [];
  }
}
