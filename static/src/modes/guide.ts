/** The guided tour: from stop to stop, as long at each as reading takes, until one takes over. */

import { button, element, icon, ICONS } from "../dom.ts";
import type { Stop } from "../tour.ts";
import type { Words } from "../words.ts";
import { stayS } from "./stay.ts";

/** While it attracts, one stays so long at least. */
const UNHURRIED_S = 9;

export interface GuideHost {
  /** It attracts: goes on without end, and takes its time. */
  readonly attracts: boolean;
  readonly stops: readonly Stop[];
  /** Sets out for a stop. */
  leadTo(stop: Stop): void;
  /** Whether one stands where one was led, and sees it. */
  hasArrived(): boolean;
  /** Steps of time are wanted again. */
  woken(): void;
  /** The guided tour was closed. */
  closed(): void;
}

export class Guide {
  readonly element: HTMLElement;
  readonly #host: GuideHost;
  readonly #caption = element("p", { class: "guide-caption", "aria-live": "polite", tabindex: "0" });
  readonly #count = element("span", { class: "guide-count" });
  readonly #bar = element("div", { class: "guide-bar" });
  readonly #play: HTMLButtonElement;
  readonly #previous: HTMLButtonElement;
  readonly #next: HTMLButtonElement;
  readonly #close: HTMLButtonElement;
  #words: Words;
  #textOf: (stop: Stop) => string;
  #at = 0;
  #stayed = 0;
  #playing = true;

  constructor(host: GuideHost, words: Words, textOf: (stop: Stop) => string) {
    this.#host = host;
    this.#words = words;
    this.#textOf = textOf;
    this.#previous = button("round", () => this.step(-1));
    this.#play = button("round play", () => this.toggle());
    this.#next = button("round", () => this.step(1));
    this.#close = button("round", () => host.closed());
    this.#previous.append(icon(ICONS.previous));
    this.#next.append(icon(ICONS.next));
    this.#close.append(icon(ICONS.close));
    const controls = element(
      "div",
      { class: "guide-controls" },
      this.#previous,
      this.#play,
      this.#next,
      this.#count,
      this.#close,
    );
    this.element = element("section", { class: "guide" }, this.#bar, this.#caption, controls);
    this.say(words, textOf);
  }

  /** Speaks another language. */
  say(words: Words, textOf: (stop: Stop) => string): void {
    this.#words = words;
    this.#textOf = textOf;
    this.element.setAttribute("aria-label", words.guide);
    this.#previous.setAttribute("aria-label", words.previousStop);
    this.#next.setAttribute("aria-label", words.nextStop);
    this.#close.setAttribute("aria-label", words.endGuide);
    this.#tell();
    this.#show();
  }

  /** Begins, or goes on from a stop. */
  go(to: number): void {
    const count = this.#host.stops.length;
    const at = Math.min(count - 1, Math.max(0, to));
    const stop = this.#host.stops[at];
    if (!stop) return;
    this.#at = at;
    this.#stayed = 0;
    this.#tell();
    this.#show();
    this.#host.leadTo(stop);
  }

  toggle(): void {
    const last = this.#at === this.#host.stops.length - 1 && this.#stayed >= this.#stay;
    this.#playing = last || !this.#playing;
    if (last) this.go(0);
    this.#show();
    this.#host.woken();
  }

  /** To a stop so many on from this one. */
  step(by: number): void {
    this.go(this.#at + by);
  }

  /** The visitor took over. */
  pause(): void {
    if (!this.#playing) return;
    this.#playing = false;
    this.#show();
  }

  get hasFocus(): boolean {
    return this.element.contains(document.activeElement);
  }

  focus(): void {
    this.#play.focus({ preventScroll: true });
  }

  get attracts(): boolean {
    return this.#host.attracts;
  }

  get isPlaying(): boolean {
    return this.#playing;
  }

  /** One step of time. Returns whether more are wanted. */
  frame(dt: number): boolean {
    if (!this.#playing) return false;
    if (!this.#host.hasArrived()) return true;
    this.#stayed += dt;
    this.#fill();
    if (this.#stayed < this.#stay) return true;
    const { stops, attracts } = this.#host;
    if (this.#at < stops.length - 1) this.go(this.#at + 1);
    else if (attracts) this.go(0);
    else this.pause();
    return this.#playing;
  }

  get #stay(): number {
    const stop = this.#host.stops[this.#at];
    if (stop && this.#host.attracts) return stop.seconds ?? UNHURRIED_S;
    return stop ? stayS(stop, this.#textOf(stop)) : 0;
  }

  /** What is written, even the same, is read out again. */
  #tell(): void {
    const { stops } = this.#host;
    const stop = stops[this.#at];
    this.#caption.textContent = stop ? this.#textOf(stop) : "";
    this.#count.textContent = `${this.#at + 1} / ${stops.length}`;
    this.#fill();
  }

  #fill(): void {
    this.#bar.style.transform = `scaleX(${Math.min(1, this.#stayed / this.#stay).toFixed(3)})`;
  }

  #show(): void {
    this.#previous.disabled = this.#at === 0;
    this.#next.disabled = this.#at >= this.#host.stops.length - 1;
    this.#play.replaceChildren(icon(this.#playing ? ICONS.pause : ICONS.play));
    this.#play.setAttribute("aria-label", this.#playing ? this.#words.pause : this.#words.play);
  }
}
