/** The timeline: at which second which shot runs, how dark it is, and what is written over it. */

import type { Room } from "../tour.ts";
import { ease } from "../walk/glide.ts";
import type { Pose, Shot } from "./shots.ts";

/** The title stands on the dark, which then lifts from the first room. */
const TITLE_S = 2.6;
const LIFT_S = 1.4;
const TITLE_GONE_S = 4.4;
/** Between two rooms it gets dark and light again in so long, and stays dark for a moment. */
const DIP_S = 1.1;
const DARK_S = 0.16;
/** After the last stop. */
const FALL_S = 1.2;
const FADE_S = 0.6;
/** A room's name comes a little after the room, and stays. */
const NAME_AFTER_S = 0.7;
const NAME_S = 4;

export interface Staying {
  readonly stop: number;
  readonly from: number;
  readonly to: number;
}

/** What stands over a picture, each 0 to 1. */
export interface Over {
  /** How much of the picture the dark covers. */
  readonly dark: number;
  readonly title: number;
  readonly name: number;
  readonly credits: number;
}

/** A picture of the film. */
export interface Moment extends Over {
  readonly room: Room;
  readonly pose: Pose;
}

export class Timeline {
  readonly seconds: number;
  readonly stays: readonly Staying[];
  /** When another room takes the place of one. */
  readonly cuts: readonly number[];
  readonly #starts: readonly number[];
  readonly #shots: readonly Shot[];
  readonly #lastS: number;

  /**
   * @param shots At least one.
   * @param creditsS How long the credits stand.
   */
  constructor(shots: readonly Shot[], creditsS: number) {
    const starts: number[] = [];
    const cuts: number[] = [];
    let at = TITLE_S;
    shots.forEach((shot, i) => {
      const before = shots[i - 1];
      if (before && before.room !== shot.room) cuts.push(at);
      starts.push(at);
      at += shot.seconds;
    });
    this.#shots = shots;
    this.#starts = starts;
    this.cuts = cuts;
    this.#lastS = at;
    this.seconds = at + FALL_S + creditsS;
    this.stays = shots.flatMap(({ stop, seconds }, i) => {
      const from = starts[i] ?? 0;
      return stop === null ? [] : [{ stop, from, to: from + seconds }];
    });
  }

  /** When the first room stands alone in the picture. */
  get clearS(): number {
    return NAME_S + NAME_AFTER_S + TITLE_S + LIFT_S;
  }

  /** What is seen at a second. */
  at(t: number): Moment {
    const i = Math.max(0, this.#starts.findLastIndex((start) => start <= t));
    const shot = this.#shots[i];
    if (!shot) throw new Error("timeline: expected a shot, found none");
    const seconds = Math.min(shot.seconds, Math.max(0, t - (this.#starts[i] ?? 0)));
    return {
      room: shot.room,
      pose: shot.pose(seconds),
      dark: Math.max(this.#ends(t), ...this.cuts.map((cut) => dip(t - cut))),
      title: window(t, 0.3, TITLE_GONE_S),
      name: Math.max(...this.#namesFrom().map((from) => window(t, from, from + NAME_S))),
      credits: window(t, this.#lastS + FALL_S, this.seconds - 0.3),
    };
  }

  #namesFrom(): readonly number[] {
    return [TITLE_S + LIFT_S, ...this.cuts.map((cut) => cut + DIP_S / 2)].map(
      (seen) => seen + NAME_AFTER_S,
    );
  }

  #ends(t: number): number {
    return Math.max(1 - ease((t - TITLE_S) / LIFT_S), ease((t - this.#lastS) / FALL_S));
  }
}

/** How dark it is so many seconds after a cut, or before it. */
function dip(t: number): number {
  return 1 - ease((Math.abs(t) - DARK_S / 2) / ((DIP_S - DARK_S) / 2));
}

/** Comes and goes softly between two seconds. */
function window(t: number, from: number, to: number): number {
  return Math.min(ease((t - from) / FADE_S), ease((to - t) / FADE_S));
}
