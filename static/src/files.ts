/** The files of a tour: where each lies, and how it comes. */

export interface Files {
  /** The site's folder, where a visitor can take the tour along from; null where it is carried. */
  readonly home: URL | null;
  /** Where a file lies, by its path below the site's folder; what it names relatively, too. */
  locate(path: string): URL;
  /** Brings what lies somewhere, as the browser's own `fetch` does. */
  fetch(at: URL | string, init?: RequestInit): Promise<Response>;
  /**
   * Asks for a file before whoever needs it runs: the next `fetch` of it is handed the answer. The
   * caller gets one of its own.
   */
  ask(at: URL): Promise<Response>;
  /** The address that a picture or a sound shows a file by. */
  source(path: string): string;
}

/** Files below a folder of a server. */
export class SiteFiles implements Files {
  readonly home: URL;
  readonly #coming = new Map<string, Promise<Response | null>>();

  constructor(site: URL) {
    this.home = site;
  }

  locate(path: string): URL {
    return new URL(path, this.home);
  }

  async fetch(at: URL | string, init?: RequestInit): Promise<Response> {
    const coming = this.#coming.get(String(at)) ?? null;
    this.#coming.delete(String(at));
    return (await coming) ?? fetch(at, init);
  }

  ask(at: URL): Promise<Response> {
    const answer = fetch(at, { priority: "low" });
    const own = answer.then((response) => response.clone());
    this.#coming.set(at.href, own.catch(() => null));
    return answer;
  }

  source(path: string): string {
    return this.locate(path).href;
  }
}

/** Not found anywhere; what should ever ask for it in earnest gets nothing. */
const NOWHERE = new URL("https://carried.invalid/");

/**
 * Files that the page itself carries, each the text of an element as a `data:` address. They stay
 * that text, and are decoded when they are asked for.
 */
export class CarriedFiles implements Files {
  readonly home = null;
  readonly #carriers = new Map<string, Element>();

  constructor(page: ParentNode) {
    for (const each of page.querySelectorAll("[data-file]")) {
      this.#carriers.set(each.getAttribute("data-file") ?? "", each);
    }
  }

  locate(path: string): URL {
    return new URL(path, NOWHERE);
  }

  async fetch(at: URL | string, init?: RequestInit): Promise<Response> {
    const path = decodeURIComponent(new URL(at).pathname.slice(1));
    if (!this.#carriers.has(path)) return new Response(null, { status: 404 });
    return fetch(this.source(path), init);
  }

  ask(at: URL): Promise<Response> {
    return this.fetch(at);
  }

  source(path: string): string {
    const carrier = this.#carriers.get(path);
    return carrier?.getAttribute("src") ?? carrier?.textContent ?? "";
  }

  /** Gives pictures and sounds of the page what they show; not done while the room can be shown. */
  show(page: ParentNode): void {
    for (const each of page.querySelectorAll("[data-shows]")) {
      each.setAttribute("src", this.source(each.getAttribute("data-shows") ?? ""));
    }
  }
}
