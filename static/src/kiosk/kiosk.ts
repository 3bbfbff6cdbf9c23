/**
 * The kiosk: attracts while nobody is there, is somebody's visit from a touch on, asks after a while
 * without one whether they are still there, and returns to its start as if they never were.
 */

import { hasNews, takeAlong, takeOver, canTakeAlong } from "../along/along.ts";
import type { Files } from "../files.ts";
import type { Frontend } from "../page/frontend.ts";
import type { Room, Tour } from "../tour.ts";
import type { Visit } from "../visit.ts";
import { codeSheet } from "./code-sheet.ts";
import { Faults } from "./faults.ts";
import { isOpen } from "./hours.ts";
import { Idle } from "./idle.ts";
import { lock } from "./locks.ts";
import type { KioskSettings } from "./settings.ts";
import { StartScreen } from "./start-screen.ts";
import { Visits } from "./visits.ts";
import { Warning } from "./warning.ts";
import { Watch } from "./watch.ts";

type State = "attract" | "visit" | "warning" | "asleep";

const TICK_MS = 250;
/** What fails to come is asked for again after so long. */
const PATIENCE_S = 6;
/** A picture that stays lost is given up after so long: a page that begins anew takes a while, too. */
const LOST_S = 4;
const NEWS_S = 60;
/** Who is led or listens for so long without a touch has left. */
const LED_S = 1200;
/** So many touches in the upper left corner, none of them later than that, open the service. */
const CORNER_TOUCHES = 5;
const CORNER_PX = 96;
const CORNER_MS = 4000;

export class Kiosk {
  readonly #host: HTMLElement;
  readonly #files: Files;
  readonly #tour: Tour;
  readonly #settings: KioskSettings;
  readonly #visit: Visit;
  readonly #front: Frontend;
  readonly #start: StartScreen;
  readonly #warning = new Warning(() => this.#goOn());
  readonly #idle: Idle;
  readonly #visits = new Visits();
  readonly #faults = new Faults(window);
  readonly #watch: Watch | null;
  #state: State = "attract";
  #corner: number[] = [];
  #lostSince: number | null = null;
  #failedSince: number | null = null;
  #askedNews = performance.now();
  #isReloading = false;
  /** When somebody touched anything last. */
  #seen = performance.now();

  constructor(host: HTMLElement, files: Files, tour: Tour, settings: KioskSettings, visit: Visit) {
    this.#host = host;
    this.#files = files;
    this.#tour = tour;
    this.#settings = settings;
    this.#visit = visit;
    this.#front = visit.front;
    this.#watch = files.home && Watch.isOn(location.search) ? new Watch(files.home) : null;
    const logo = tour.logo === null ? null : files.source(tour.logo);
    this.#start = new StartScreen(tour, logo, (language) => this.#begin(language));
    host.append(this.#start.element, this.#warning.element);
    host.classList.toggle("low", settings.low);
    this.#idle = new Idle(window, (byPointer) => this.#touched(byPointer));
    lock(window, (address) => this.#showCode(address));
    window.addEventListener("pointerdown", (event) => this.#touchedAt(event), { capture: true });
    this.#front.canvas.addEventListener("webglcontextlost", () => {
      this.#faults.note("the graphics context was lost");
      this.#lostSince = performance.now();
    });
    this.#front.canvas.addEventListener("webglcontextrestored", () => (this.#lostSince = null));
  }

  /** Begins to attract. */
  run(): void {
    setInterval(() => this.#tick(), TICK_MS);
    this.#attract();
    const { home } = this.#files;
    if (home && canTakeAlong()) {
      void takeAlong(home).catch((error: unknown) => this.#faults.note(String(error)));
    }
  }

  /** Told of each room that opens. */
  opened(room: Room): void {
    this.#failedSince = null;
    if (this.#state !== "visit") return;
    this.#visits.entered(room.id, this.#front.language, new Date());
  }

  /** Told as long as a gamepad is used. */
  played(): void {
    this.#touched(false);
  }

  /** Everything as if nobody had been here. */
  home(): void {
    this.#attract();
  }

  // ------------------------------------------------------------------ states

  #enter(state: State): void {
    this.#state = state;
    this.#host.dataset["state"] = state;
  }

  #attract(): void {
    this.#enter("attract");
    this.#warning.hide();
    this.#visit.attract();
    this.#start.show();
  }

  #begin(language: string): void {
    this.#visits.begun(language, new Date());
    this.#idle.reset();
    this.#enter("visit");
    this.#start.hide();
    this.#visit.begin(language);
  }

  #goOn(): void {
    this.#idle.reset();
    this.#warning.hide();
    this.#enter("visit");
    this.#front.canvas.focus({ preventScroll: true });
  }

  #sleep(): void {
    this.#enter("asleep");
    this.#visit.rest();
    this.#start.hide();
  }

  /** Any sign of somebody. */
  #touched(byPointer: boolean): void {
    // A touch of the warning is for it alone: it goes once that has ended, or would reach the room.
    if (this.#state === "warning" && byPointer) return;
    this.#idle.reset();
    this.#seen = performance.now();
    if (this.#state === "warning") this.#goOn();
    if (this.#state === "asleep") this.#attract();
  }

  #tick(): void {
    if (this.#isReloading) return;
    const { idle_s, warning_s, hours } = this.#settings;
    const idle = this.#idle.seconds;
    this.#mend();
    const isLed = this.#visit.isBusy && performance.now() - this.#seen < LED_S * 1000;
    if (isLed) this.#idle.reset();
    if (this.#state === "visit" && idle > idle_s) {
      this.#enter("warning");
      this.#warning.show(this.#front.words);
    }
    if (this.#state === "warning") {
      const left = idle_s + warning_s - idle;
      if (left <= 0) this.#attract();
      else this.#warning.tell(left, warning_s, this.#front.words);
    }
    if (this.#state !== "attract" && this.#state !== "asleep") return;
    const closed = hours !== null && !isOpen(hours, new Date());
    if (closed && this.#state === "attract" && idle > idle_s) this.#sleep();
    if (!closed && this.#state === "asleep") this.#attract();
    if (performance.now() - this.#askedNews > NEWS_S * 1000) void this.#update();
  }

  /** A new version is taken over when it is here whole, and while nobody is. */
  async #update(): Promise<void> {
    this.#askedNews = performance.now();
    const { home } = this.#files;
    if (!home || !canTakeAlong()) return;
    await takeAlong(home).catch(() => undefined); // the disk may have been full before
    if (!(await hasNews(home))) return;
    if (this.#state !== "attract" && this.#state !== "asleep") return;
    await takeOver(home);
    this.#reload();
  }

  /** What does not come back by itself is begun anew. */
  #mend(): void {
    const now = performance.now();
    if (this.#lostSince !== null && now - this.#lostSince > LOST_S * 1000) this.#reload();
    if (!this.#visit.hasFailed) {
      this.#failedSince = null;
      return;
    }
    this.#failedSince ??= now;
    if (this.#state !== "attract" || now - this.#failedSince < PATIENCE_S * 1000) return;
    this.#failedSince = now;
    this.#visit.attract();
  }

  #reload(): void {
    if (this.#isReloading) return;
    this.#isReloading = true;
    const told = this.#watch?.post("leaves") ?? Promise.resolve();
    void told.then(() => location.reload());
  }

  // ------------------------------------------------------------------ codes and service

  #showCode(address: string): void {
    const path = this.#settings.codes[address];
    const picture = path === undefined ? null : this.#files.source(path);
    const { words, panel } = this.#front;
    panel.open(words.kioskCode, ...codeSheet(address, picture, words));
  }

  #touchedAt(event: PointerEvent): void {
    const now = performance.now();
    if (event.clientX > CORNER_PX || event.clientY > CORNER_PX) {
      this.#corner = [];
      return;
    }
    if (this.#state === "visit") event.stopPropagation(); // nobody walks to the ceiling
    this.#corner = [...this.#corner.filter((at) => now - at < CORNER_MS), now];
    if (this.#corner.length < CORNER_TOUCHES || !this.#settings.pin) return;
    this.#corner = [];
    void this.#askPin();
  }

  async #askPin(): Promise<void> {
    const { pin } = this.#settings;
    const script = await this.#front.brought(import("./service.ts"));
    if (!script || !pin) return;
    if (this.#state !== "visit") this.#begin(this.#front.language);
    const { panel, words } = this.#front;
    panel.open(words.service, script.pinPad(pin, words, () => void this.#openService()));
  }

  async #openService(): Promise<void> {
    const script = await this.#front.brought(import("./service.ts"));
    if (!script) return;
    const { panel, words, language } = this.#front;
    const watch = this.#watch;
    const content = script.serviceSheet({
      tour: this.#tour,
      visits: this.#visits,
      faults: this.#faults,
      language,
      words,
      keep: (csv) => this.#keep(csv),
      restart: () => this.#reload(),
      end: watch ? () => void watch.post("end") : null,
    });
    panel.open(words.service, ...content);
  }

  /** Keeps the table. Returns what is to be said of it. */
  async #keep(csv: string): Promise<string> {
    const { words } = this.#front;
    if (this.#watch) return (await this.#watch.post("visits", csv)) ?? words.serviceUnsaved;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([csv], { type: "text/csv" }));
    link.download = "visits.csv";
    link.click();
    URL.revokeObjectURL(link.href);
    return words.serviceSaved;
  }
}
