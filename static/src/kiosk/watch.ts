/**
 * The line to `tourgen kiosk`, where that has started this browser: it learns at once when the page
 * is gone, by its signs of life when the page hangs, and starts the browser anew.
 */

const ALIVE_MS = 2000;

export class Watch {
  readonly #site: URL;

  constructor(site: URL) {
    this.#site = site;
    new EventSource(new URL(".kiosk/line", site));
    setInterval(() => void this.post("alive"), ALIVE_MS);
  }

  /** Whether somebody watches: the address says so. */
  static isOn(search: string): boolean {
    return new URLSearchParams(search).has("watched");
  }

  /** Tells something. Returns the answer; null where there is none. */
  async post(what: "alive" | "leaves" | "visits" | "end", body = ""): Promise<string | null> {
    try {
      const response = await fetch(new URL(`.kiosk/${what}`, this.#site), { method: "POST", body });
      return response.ok ? await response.text() : null;
    } catch {
      return null; // the next sign comes soon
    }
  }
}
