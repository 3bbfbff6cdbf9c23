/**
 * Film: the guided tour drawn picture by picture, each when all that it shows is there.
 *
 * Loaded by `?film` in the address alone (`&captions` writes captions into the picture); asked by
 * `window.tourgen.film`. No clock runs: a picture depends on its second and on nothing before it.
 */

import { readQuery, type FilmPlan } from "../diagnostics.ts";
import { element } from "../dom.ts";
import type { Files } from "../files.ts";
import { readingS } from "../modes/stay.ts";
import { tileDecoder } from "../scene/tile-decoder.ts";
import { Stage } from "../scene/stage.ts";
import { roomCalled, type Room, type Tour } from "../tour.ts";
import { directionOf, textIn, wordsIn } from "../words.ts";
import { cuesOf, type Cue } from "./cues.ts";
import { Lettering } from "./lettering.ts";
import { Scenery } from "./scenery.ts";
import { shotsOf, type Blocked, type Ground } from "./script.ts";
import { Timeline } from "./timeline.ts";

/** Colours of the mark, far apart from one picture to the next. */
const MARKS = 2 ** 24;
const MARK_STEP = 9_973_333;

interface Reel {
  readonly timeline: Timeline;
  readonly blocked: readonly Blocked[];
  /** In the film's language. */
  readonly cues: readonly Cue[];
}

export class Film {
  readonly #tour: Tour;
  readonly #language: string;
  readonly #stage: Stage;
  readonly #scenery: Scenery;
  readonly #lettering: Lettering;
  readonly #reel: Promise<Reel>;
  readonly #captions: boolean;
  /** Below the picture: tells by its colour which one stands on the screen. */
  readonly #mark = element("div", { class: "film-mark" });
  #drawn = 0;

  /** @param language Of titles and captions; its words were brought. */
  constructor(host: HTMLElement, files: Files, tour: Tour, language: string) {
    const asked = new URLSearchParams(location.search);
    const { background, levels } = readQuery(location.search);
    this.#tour = tour;
    this.#captions = asked.has("captions");
    this.#language = language;
    document.documentElement.lang = language;
    document.documentElement.dir = directionOf(language);
    this.#lettering = new Lettering(tour, files, language, wordsIn(language));
    const canvas = document.createElement("canvas");
    host.classList.add("film");
    host.replaceChildren(canvas, this.#lettering.element);
    document.body.append(this.#mark);
    this.#stage = new Stage(canvas, background, () => "still");
    this.#stage.hold();
    // Where two tiles meet the first one drawn wins: not the first one that came, as else.
    this.#stage.renderer.setOpaqueSort((a, b) => a.object.name.localeCompare(b.object.name, "en"));
    this.#scenery = new Scenery(files, this.#stage, tileDecoder(files).manager, levels);
    this.#reel = this.#cut();
    window.tourgen = { film: { plan: () => this.#plan(), frame: (t) => this.#frame(t) } };
  }

  /** Looks at every room once, and lays all shots out. */
  async #cut(): Promise<Reel> {
    const { stops } = this.#tour;
    const grounds = new Map<string, Ground>();
    for (const id of new Set(stops.map(({ room }) => room))) {
      const room = this.#roomCalled(id);
      grounds.set(id, { room, collider: await this.#scenery.enter(room) });
    }
    const { shots, blocked } = shotsOf(stops, grounds, ({ text }) => textIn(text, this.#language));
    const timeline = new Timeline(shots, readingS(this.#lettering.creditsText));
    await this.#lettering.ready();
    return { timeline, blocked, cues: this.#cuesIn(this.#language, timeline) };
  }

  async #plan(): Promise<FilmPlan> {
    const { timeline, blocked } = await this.#reel;
    return {
      seconds: timeline.seconds,
      language: this.#language,
      clear: timeline.clearS,
      stays: timeline.stays,
      cuts: timeline.cuts,
      cues: Object.fromEntries(
        this.#tour.languages.map((tag) => [tag, this.#cuesIn(tag, timeline)]),
      ),
      blocked,
    };
  }

  /** Draws the picture of a second, whole. Returns its mark. */
  async #frame(t: number): Promise<number> {
    const { timeline, cues } = await this.#reel;
    const { room, pose, ...over } = timeline.at(t);
    await this.#scenery.enter(room);
    await this.#scenery.see(pose);
    const cue = this.#captions ? cues.find(({ from, to }) => from <= t && t < to) : undefined;
    await nextPicture();
    this.#lettering.show(room, over, cue?.text ?? "");
    this.#stage.render();
    const mark = (++this.#drawn * MARK_STEP) % MARKS;
    this.#mark.style.backgroundColor = `#${mark.toString(16).padStart(6, "0")}`;
    await nextPicture();
    return mark;
  }

  #cuesIn(language: string, { stays }: Timeline): Cue[] {
    return stays.flatMap(({ stop, from, to }) =>
      cuesOf(textIn(this.#tour.stops[stop]?.text ?? {}, language), language, from, to),
    );
  }

  #roomCalled(id: string): Room {
    const room = roomCalled(this.#tour, id);
    if (!room) throw new Error(`room \`${id}\`: expected in the tour, found none`);
    return room;
  }
}

function nextPicture(): Promise<number> {
  return new Promise((done) => requestAnimationFrame(done));
}
