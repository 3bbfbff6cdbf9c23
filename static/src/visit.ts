/** A visit: its parts, the loop that shows them, and what a kiosk asks of it. */

import { Vector3, type LoadingManager } from "three";
import type { Addresses } from "./address.ts";
import { readQuery } from "./diagnostics.ts";
import type { Files } from "./files.ts";
import { Frontend } from "./page/frontend.ts";
import { chooseLanguageForGood } from "./past.ts";
import { Rooms } from "./rooms.ts";
import { tileDecoder } from "./scene/tile-decoder.ts";
import { Stage, type Pace } from "./scene/stage.ts";
import { Tools } from "./tools.ts";
import { startOf, type Room, type Tour } from "./tour.ts";
import { answersOf } from "./visit/answers.ts";
import { Guidance } from "./visit/guidance.ts";
import { Immersion } from "./visit/immersion.ts";
import { Journey } from "./visit/journey.ts";
import { Pointing } from "./visit/pointing.ts";
import { Walking } from "./visit/walking.ts";
import { Ways } from "./visit/ways.ts";
import { Gamepads } from "./walk/gamepad.ts";
import { Keyboard, type Wish } from "./walk/keyboard.ts";

/** A sign may hang so deep in what stands behind it. */
const SIGN_SLACK_M = 0.5;
/** A gamepad's button opens what hangs within so much of the middle of the picture. */
const AIM_PX = 130;

/** How a visit is held: on a page of its own, or at a kiosk, where nothing outlasts it. */
export interface Manner {
  readonly kiosk: boolean;
  /** The one that is spoken at first; its words were brought. */
  readonly language: string;
  /** Told of each room that opens. */
  opened(room: Room): void;
  /** Told as long as a gamepad is used: the page hears nothing of it. */
  played(): void;
  /** Back to the start was chosen. */
  home(): void;
}

export class Visit {
  readonly front: Frontend;
  readonly #manner: Manner;
  readonly #addresses: Addresses;
  readonly #tour: Tour;
  readonly #stage: Stage;
  readonly #keyboard: Keyboard;
  readonly #gamepads: Gamepads;
  readonly #rooms: Rooms;
  readonly #walking: Walking;
  readonly #ways: Ways;
  readonly #journey: Journey;
  readonly #guidance: Guidance;
  readonly #immersion: Immersion;
  readonly #tools: Tools;
  readonly #pointing: Pointing;

  /** Starts what a visit decodes with, before there is one. */
  static prepare(files: Files): void {
    tileDecoder(files);
  }

  /** Makes a visit while what decodes its tiles starts. */
  static async of(
    host: HTMLElement,
    canvas: HTMLCanvasElement,
    files: Files,
    addresses: Addresses,
    tour: Tour,
    room: Room,
    manner: Manner,
  ): Promise<Visit> {
    const { manager, started } = tileDecoder(files);
    await started;
    return new Visit(host, canvas, files, addresses, tour, room, manner, manager);
  }

  private constructor(
    host: HTMLElement,
    canvas: HTMLCanvasElement,
    files: Files,
    addresses: Addresses,
    tour: Tour,
    room: Room,
    manner: Manner,
    manager: LoadingManager,
  ) {
    this.#addresses = addresses;
    this.#tour = tour;
    this.#manner = manner;
    const query = readQuery(location.search);
    const { kiosk, language } = manner;
    const front = new Frontend(host, canvas, files, addresses, tour, room, language, kiosk, {
      door: (link) => {
        this.#takeOver();
        this.#walking.walkThrough(link);
      },
      reached: (at) => this.#walking.face(new Vector3(...at)),
      chosen: (next) => this.#journey.choose(next),
      noted: (of, note, lead) => this.#journey.open(of, note, lead),
      closed: () => this.#journey.closed(),
      see: (way) => void this.#ways.see(way),
      guide: () => void this.#guidance.lead(),
      search: () => void this.#tools.search(),
      tools: () => this.#tools.list(),
      language: (tag) => this.#speak(tag),
      home: () => manner.home(),
    });
    this.front = front;
    const stage = new Stage(canvas, query.background, (dt) => this.#frame(dt));
    this.#stage = stage;
    const rooms: Rooms = new Rooms(files, tour, room, stage, front, manager, query.levels, {
      expected: (view) => this.#walking.wait(view),
      opened: (of, view, collider) => {
        this.#walking.enter(of, view, collider);
        this.#immersion.stand();
        this.#journey.opened();
        manner.opened(of);
      },
      wanted: (next, view) => this.#journey.go(next, view),
    });
    this.#rooms = rooms;
    const walks = (): void => this.#walking.act(() => this.#takeOver());
    this.#keyboard = new Keyboard(window, walks);
    this.#gamepads = new Gamepads(
      {
        pushed: walks,
        act: () => this.#actAhead(),
        back: () => front.panel.close(),
        previous: () => this.#guidance.guide?.step(-1),
        next: () => this.#guidance.guide?.step(1),
      },
      () => stage.wake(),
    );
    const wish = (): Wish => this.#gamepads.wish ?? this.#keyboard.wish();
    const walking = new Walking({
      stage,
      front,
      rooms,
      wish,
      isElsewhere: () => this.#ways.overview !== null || this.#immersion.isOn,
      pass: (link) => this.#journey.pass(link),
      aimed: () => this.#journey.recordAtRest(),
    });
    this.#walking = walking;
    const takeOver = (): void => this.#takeOver();
    const ways = new Ways({
      tour,
      stage,
      front,
      rooms,
      walking,
      wish,
      takeOver,
      go: (next, view) => this.#journey.go(next, view),
      changed: () => this.#journey.record(),
      left: () => {
        this.#tools.end();
        this.#pointing.unmark();
      },
    });
    this.#ways = ways;
    const isTraced = !kiosk;
    const journey = new Journey({ addresses, tour, front, rooms, walking, ways, isTraced });
    this.#journey = journey;
    this.#guidance = new Guidance({
      tour,
      stage,
      front,
      rooms,
      walking,
      ways,
      go: (next, view) => journey.go(next, view),
    });
    const immersion = new Immersion({
      stage,
      front,
      rooms,
      walking,
      begins: () => {
        ways.leave();
        this.#guidance.end();
      },
      pass: (link) => journey.pass(link),
    });
    this.#immersion = immersion;
    const tools = new Tools({
      tour,
      stage,
      front,
      rooms,
      kiosk,
      home: files.home,
      address: () => journey.address(),
      immerse: () => void immersion.begin(),
      open: (of, note) => (note ? journey.open(of, note, true) : journey.choose(of)),
    });
    this.#tools = tools;
    this.#pointing = new Pointing({ stage, front, rooms, walking, ways, tools, takeOver });
    front.canvas.addEventListener("webglcontextlost", () =>
      front.notice.tell({ says: "contextLost", lasts: true }),
    );
    front.canvas.addEventListener("webglcontextrestored", () => front.notice.withdraw("contextLost"));
    window.tourgen = answersOf({ stage, rooms, walking, ways, tools, immersion });
  }

  /** Opens the first room, as the address says. */
  start(isMissing: boolean): void {
    this.front.mark("walk");
    this.#journey.start(isMissing);
  }

  // ------------------------------------------------------------------ at a kiosk

  /** Shows the tour by itself, without end. */
  attract(): void {
    this.rest();
    void this.#guidance.lead(true);
  }

  /** Begins as a visitor finds it, at the start, in a language. */
  begin(language: string): void {
    this.rest();
    this.front.speak(language);
    const start = startOf(this.#tour);
    if (start !== this.#rooms.room || !this.#rooms.isOpen) this.#journey.go(start, start.entry);
    else {
      this.#walking.jump(start.entry);
      this.#manner.opened(start);
    }
  }

  /** Stands still, and takes away whatever a visitor has left. */
  rest(): void {
    this.#guidance.end();
    this.#takeOver();
    this.#ways.leave();
    this.#tools.reset();
    this.front.panel.close();
    this.front.notice.clear();
    this.front.speak(this.#manner.language);
    this.#stage.widen();
  }

  /** Whether a visitor listens or looks on without touching anything. */
  get isBusy(): boolean {
    if (this.#rooms.hasFailed) return false;
    const { guide } = this.#guidance;
    return (guide !== null && !guide.attracts && guide.isPlaying) || this.front.panel.isSounding;
  }

  /** Whether the room that was asked for did not come. */
  get hasFailed(): boolean {
    return this.#rooms.hasFailed;
  }

  // ------------------------------------------------------------------ of all parts

  /** Whether the tour shows itself, and there is no visitor yet. */
  get #attracts(): boolean {
    return this.#guidance.guide?.attracts ?? false;
  }

  /** Does what the sign before one is for, if it can be seen. */
  #actAhead(): void {
    if (!this.#attracts && this.#ways.way !== "plan") this.front.spots.nearest(AIM_PX)?.click();
  }

  /** The visitor acts: whatever moves by itself leaves off. */
  #takeOver(): void {
    const { visitor } = this.#walking;
    if (this.#attracts) return;
    this.#guidance.guide?.pause();
    if (visitor.isUnderWay) visitor.stop();
  }

  /** One step of the loop. */
  #frame(dt: number): Pace {
    if (this.#gamepads.poll()) this.#manner.played();
    const moved = this.#ways.frame(dt);
    const { tiles } = this.#rooms;
    tiles?.update(this.#stage.camera, this.#stage.size);
    if (this.#rooms.isOpen) this.#placeSigns();
    this.#tools.frame();
    const guided = this.#guidance.guide?.frame(dt) ?? false;
    const busy = (tiles?.busy ?? false) || (this.#ways.overview?.busy ?? false);
    if (this.#rooms.isOpen) this.#rooms.lookAhead(busy);
    if (moved) return "moving";
    if (guided) return "watching";
    if (busy && !this.#rooms.hasFailed) return "waiting";
    return this.#gamepads.isThere ? "watching" : "still";
  }

  #placeSigns(): void {
    const { camera, size } = this.#stage;
    const outside = this.#ways.overview !== null;
    this.front.spots.place(
      camera,
      size,
      (at) => !outside && (this.#rooms.collider?.blocks(camera.position, at, SIGN_SLACK_M) ?? false),
    );
  }

  #speak(language: string): void {
    if (!this.#manner.kiosk) this.#keepLanguage(language);
    this.#guidance.say();
    this.#ways.say();
    this.#tools.say();
    this.#stage.draw();
  }

  #keepLanguage(language: string): void {
    chooseLanguageForGood(language);
    const address = this.#addresses.inLanguage(new URL(location.href), language);
    history.replaceState(history.state, "", address);
  }
}
