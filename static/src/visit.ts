/** A visit: one way of seeing after the other, room after room, and the loop that shows it all. */

import { Vector3, type LoadingManager, type Raycaster } from "three";
import { placeIn, type Addresses, type Place, type Way } from "./address.ts";
import type { Hit } from "./walk/collider.ts";
import { readQuery, type Diagnostics } from "./diagnostics.ts";
import { prefersStillness } from "./dom.ts";
import type { Files } from "./files.ts";
import { Frontend } from "./page/frontend.ts";
import { PlanSheet } from "./page/plan-sheet.ts";
import { Tools } from "./tools.ts";
import { Gamepads } from "./walk/gamepad.ts";
import { Keyboard } from "./walk/keyboard.ts";
import { Marker } from "./scene/marker.ts";
import { chosenLanguage, chooseLanguageForGood } from "./past.ts";
import { Pointer } from "./walk/pointer.ts";
import { Rooms } from "./rooms.ts";
import { tileDecoder } from "./scene/room-tiles.ts";
import { Stage, type Pace } from "./scene/stage.ts";
import { Thresholds } from "./walk/threshold.ts";
import {
  roomCalled,
  startOf,
  type Link,
  type Note,
  type Room,
  type Stop,
  type Tour,
  type Triple,
  type View,
} from "./tour.ts";
import { Visitor } from "./walk/visitor.ts";
import { chooseLanguage } from "./words.ts";
import type { Guide } from "./modes/guide.ts";
import type { Immersive } from "./modes/immersive.ts";
import type { Overview } from "./modes/overview.ts";

const ZOOM_STEP = 1.08;
/** A click on a wall leads to the floor so far before it. */
const BEFORE_WALL_M = 0.45;
const FLOOR_MIN_RISE = 0.6;
/** A sign may hang so deep in what stands behind it. */
const SIGN_SLACK_M = 0.5;
/** The address follows the view when it has rested for so long. */
const REST_MS = 400;
/** An address may name a place so far outside of a room. */
const OUTSIDE_M = 3;
const EYE_M = 1.6;
/** Part of the usual speed at which a tour shows itself. */
const UNHURRIED = 0.6;
/** A gamepad's button opens what hangs within so much of the middle of the picture. */
const AIM_PX = 130;

/** How a visit is held: on a page of its own, or at a kiosk, where nothing outlasts it. */
export interface Manner {
  readonly kiosk: boolean;
  /** Told of each room that opens. */
  opened(room: Room): void;
  /** Back to the start was chosen. */
  home(): void;
}

export class Visit {
  readonly front: Frontend;
  readonly #manner: Manner;
  readonly #addresses: Addresses;
  readonly #tour: Tour;
  readonly #stage: Stage;
  readonly #query = readQuery(location.search);
  readonly #marker = new Marker();
  readonly #keyboard: Keyboard;
  readonly #gamepads: Gamepads;
  readonly #visitor: Visitor;
  readonly #pointer: Pointer;
  readonly #rooms: Rooms;
  readonly #tools: Tools;
  #thresholds = new Thresholds<Link>([]);
  #way: Way = "walk";
  #overview: Overview | null = null;
  #sheet: PlanSheet | null = null;
  #guide: Guide | null = null;
  #immersive: Immersive | null = null;
  #note: Note | null = null;
  /** What shall be done once the room on the way is open. */
  #then: (() => void) | null = null;
  #rest: ReturnType<typeof setTimeout> | undefined;

  constructor(
    host: HTMLElement,
    files: Files,
    addresses: Addresses,
    tour: Tour,
    room: Room,
    manner: Manner,
  ) {
    this.#addresses = addresses;
    this.#tour = tour;
    this.#manner = manner;
    const asked = addresses.languageAt(new URL(location.href));
    const wishes = [asked, chosenLanguage(), ...navigator.languages];
    const language = manner.kiosk ? firstOf(tour) : chooseLanguage(tour.languages, wishes);
    this.front = new Frontend(host, files, addresses, tour, room, language, manner.kiosk, {
      door: (link) => this.#walkThrough(link),
      reached: (at) => this.#act(() => this.#visitor.face(new Vector3(...at))),
      chosen: (next) => this.#go(next, next.entry),
      noted: (of, note, lead) => this.#open(of, note, lead),
      closed: () => this.#closeNote(),
      see: (way) => void this.#see(way),
      guide: () => void this.#lead(),
      search: () => void this.#tools.search(),
      tools: () => this.#tools.list(),
      language: (tag) => this.#speak(tag),
      home: () => manner.home(),
    });
    const canvas = this.front.canvas;
    this.#stage = new Stage(canvas, this.#query.background, (dt) => this.#frame(dt));
    this.#stage.scene.add(this.#marker.group);
    const manager: LoadingManager = tileDecoder(files);
    this.#rooms = new Rooms(
      files,
      tour,
      room,
      this.#stage,
      this.front,
      manager,
      this.#query.levels,
      {
        expected: (view) => {
          this.#visitor.wait(view);
          this.#aim();
        },
        opened: (of, view, collider) => {
          this.#visitor.enter(view, collider, of.bounds);
          this.#thresholds = new Thresholds(of.links);
          this.#aim();
          this.#standImmersed();
          const then = this.#then;
          this.#then = null;
          then?.();
          manner.opened(of);
        },
        wanted: (next, view) => this.#go(next, view),
      },
    );
    this.#keyboard = new Keyboard(window, () => this.#act(() => this.#takeOver()));
    this.#gamepads = new Gamepads(
      {
        act: () => this.front.spots.nearest(AIM_PX)?.click(),
        back: () => this.front.panel.close(),
        previous: () => this.#guide?.go(this.#guide.at - 1),
        next: () => this.#guide?.go(this.#guide.at + 1),
      },
      () => this.#stage.wake(),
    );
    this.#visitor = new Visitor(
      () => this.#gamepads.wish() ?? this.#keyboard.wish(),
      (door) => this.#pass(door),
    );
    this.#tools = new Tools({
      tour,
      stage: this.#stage,
      front: this.front,
      rooms: this.#rooms,
      kiosk: manner.kiosk,
      home: files.home,
      address: () => this.#address(),
      immerse: () => void this.#immerse(),
      open: (of, note) => (note ? this.#open(of, note, true) : this.#go(of, of.entry)),
    });
    this.#pointer = this.#listen(canvas);
    canvas.addEventListener("webglcontextlost", () =>
      this.front.notice.tell(this.front.words.contextLost, []),
    );
    canvas.addEventListener("webglcontextrestored", () => this.front.notice.clear());
    window.addEventListener("popstate", () => this.#follow());
    window.tourgen = this.#diagnostics();
  }

  /** Opens the first room, as the address says. */
  start(isMissing: boolean): void {
    const place = placeIn(location.hash);
    this.front.mark("walk");
    this.#then = () => {
      if (isMissing || location.hash === "#missing") this.#tell(this.front.words.noPage);
    };
    this.#enter(this.#rooms.room, place, false);
  }

  // ------------------------------------------------------------------ at a kiosk

  /** Shows the tour by itself, without end. */
  attract(): void {
    this.#clear();
    void this.#lead(true);
  }

  /** Begins as a visitor finds it, at the start, in a language. */
  begin(language: string): void {
    this.#clear();
    this.front.speak(language);
    const start = startOf(this.#tour);
    if (start !== this.#rooms.room || !this.#rooms.isOpen) this.#go(start, start.entry);
    else {
      this.#visitor.jump(start.entry);
      this.#aim();
      this.#manner.opened(start);
    }
  }

  /** Stands still. */
  rest(): void {
    this.#clear();
  }

  /** Whether a visitor listens or looks on without touching anything. */
  get isBusy(): boolean {
    if (this.#rooms.hasFailed) return false;
    const attracts = this.#guide?.attracts ?? false;
    return (!attracts && (this.#guide?.isPlaying ?? false)) || this.front.panel.isSounding;
  }

  /** Whether the room that was asked for did not come. */
  get hasFailed(): boolean {
    return this.#rooms.hasFailed;
  }

  /** Takes away whatever a visitor has left. */
  #clear(): void {
    this.#endGuide();
    this.#takeOver();
    this.#leaveWay();
    this.#tools.reset();
    this.front.panel.close();
    this.front.notice.clear();
    this.front.speak(firstOf(this.#tour));
    this.#stage.widen();
  }

  // ------------------------------------------------------------------ rooms

  /** Enters a room at a place of an address. */
  #enter(room: Room, place: Place, passing: boolean): void {
    this.#leaveWay();
    const wrong = place.view !== null && !isInside(room, place.view.position);
    const view = (wrong ? null : place.view) ?? room.entry;
    const before = this.#then;
    this.#then = () => {
      before?.();
      if (wrong) this.#tell(this.front.words.noView);
      const note = place.note === null ? undefined : room.notes[place.note - 1];
      if (note) this.#open(room, note, place.view === null);
      if (place.way !== "walk") void this.#see(place.way);
    };
    void this.#rooms.enter(room, view, passing);
  }

  #walkThrough(link: Link): void {
    const collider = this.#rooms.collider;
    if (!collider) return;
    this.#takeOver();
    this.#act(() => this.#visitor.walkThrough(link, collider));
  }

  /** Through a door. */
  #pass(link: Link): void {
    const next = roomCalled(this.#tour, link.to);
    if (next && this.#rooms.isOpen) this.#go(next, link.arrive);
  }

  /** To another room's page, by its address. */
  #go(room: Room, view: View, then: (() => void) | null = null): void {
    this.#noteView();
    if (!this.#manner.kiosk) {
      history.pushState(null, "", this.#addresses.ofRoom(new URL(location.href), room.id));
    }
    this.#leaveWay();
    this.#then = then;
    void this.#rooms.enter(room, view, true);
  }

  /** Goes where the address says, after a step through the history or by hand. */
  #follow(): void {
    const named = this.#addresses.roomAt(new URL(location.href));
    const room = roomCalled(this.#tour, named) ?? startOf(this.#tour);
    const place = placeIn(location.hash);
    if (room !== this.#rooms.room || !this.#rooms.isOpen) this.#enter(room, place, true);
    else {
      if (place.way !== this.#way) void this.#see(place.way);
      if (place.view && isInside(room, place.view.position)) this.#visitor.jump(place.view);
      this.#aim();
      const note = place.note === null ? undefined : room.notes[place.note - 1];
      if (note && note !== this.#note) this.#open(room, note, place.view === null);
    }
  }

  /** Writes into the address how one sees, and from where. */
  #noteView(): void {
    clearTimeout(this.#rest);
    if (!this.#rooms.isOpen || this.#manner.kiosk) return;
    const address = this.#addresses.ofPlace(new URL(location.href), this.#place());
    if (address !== location.href) history.replaceState(history.state, "", address);
  }

  #place(): Place {
    const note = this.#note ? this.#rooms.room.notes.indexOf(this.#note) + 1 : 0;
    return { view: this.#view(), way: this.#way, note: note > 0 ? note : null };
  }

  #address(): string | null {
    const here = new URL(location.href);
    const { id } = this.#rooms.room;
    return this.#addresses.forOthers(here, this.#tour.address, id, this.#place());
  }

  #tell(message: string): void {
    this.front.notice.tell(message, [{ label: this.front.words.close, act: () => undefined }]);
  }

  // ------------------------------------------------------------------ ways to see

  /** Sees in another way. */
  async #see(way: Way): Promise<void> {
    if (way === this.#way || !this.#rooms.isOpen) return;
    this.#takeOver();
    const room = this.#rooms.room;
    const before = this.#overview;
    if (way === "walk" && before) {
      await before.land(room, this.#visitor.view);
      if (before !== this.#overview) return;
    }
    this.#leaveWay();
    if (way === "walk") return this.#aim();
    if (way === "plan") this.#showPlan();
    else {
      const { Overview } = await import("./modes/overview.ts");
      if (room !== this.#rooms.room || this.#overview) return;
      this.#overview = new Overview(
        {
          tour: this.#tour,
          stage: this.#stage,
          rooms: this.#rooms,
          titleOf: (each) => this.front.text(each.title),
          wish: () => this.#gamepads.wish() ?? this.#keyboard.wish(),
          enter: (into, view) => void this.#descend(into, view),
        },
        way === "dollhouse",
      );
      this.front.showSigns(this.#overview.signs());
    }
    this.#way = way;
    this.front.mark(way);
    this.front.hideHint();
    this.#stage.draw();
    this.#noteView();
  }

  /** From outside down into a room. */
  async #descend(room: Room, view: View): Promise<void> {
    const overview = this.#overview;
    await overview?.land(room, view);
    if (overview !== this.#overview) return;
    if (room !== this.#rooms.room) return this.#go(room, view);
    this.#leaveWay();
    this.#visitor.jump(view);
    this.#aim();
  }

  #showPlan(): void {
    const titleOf = (room: Room): string => this.front.text(room.title);
    this.#sheet = new PlanSheet(this.#tour, this.front.words, titleOf, {
      chosen: (room, at) => this.#goOnPlan(room, at),
    });
    this.front.overlay.append(this.#sheet.element);
    this.#sheet.stand(this.#rooms.room, this.#visitor.eye, this.#visitor.look.yaw);
  }

  #goOnPlan(room: Room, [x, y, z]: Triple): void {
    const ahead = this.#visitor.look.direction();
    const position: Triple = [x, y, z + EYE_M];
    const view: View = { position, look_at: [x + ahead.x, y + ahead.y, z + EYE_M] };
    if (room !== this.#rooms.room) return this.#go(room, view);
    this.#leaveWay();
    this.#visitor.jump(view);
    this.#aim();
  }

  /** Takes away whatever stands between the visitor and walking. */
  #leaveWay(): void {
    this.#sheet?.element.remove();
    this.#sheet = null;
    if (this.#overview) {
      this.#overview.leave();
      this.#overview = null;
      this.front.showSigns();
    }
    this.#tools.end();
    this.#way = "walk";
    this.front.mark("walk");
    this.#marker.hide();
  }

  // ------------------------------------------------------------------ notes and the guide

  /** @param lead Whether one is brought before it. */
  #open(room: Room, note: Note, lead: boolean): void {
    if (room !== this.#rooms.room) return this.#go(room, note.view, () => this.#open(room, note, false));
    if (this.#way !== "walk") this.#leaveWay();
    if (lead) {
      this.#act(() => {
        if (prefersStillness() || !this.#visitor.glide(note.view)) this.#visitor.jump(note.view);
      });
      this.#aim();
    }
    this.front.openNote(note);
    this.#note = note;
    this.#noteView();
  }

  #closeNote(): void {
    if (!this.#note) return;
    this.#note = null;
    this.#noteView();
  }

  /** @param attracts By itself, until somebody comes. */
  async #lead(attracts = false): Promise<void> {
    if (this.#guide) return this.#guide.toggle();
    const { Guide } = await import("./modes/guide.ts");
    if (this.#guide) return;
    if (this.#way !== "walk") this.#leaveWay();
    this.#guide = new Guide(
      {
        attracts,
        stops: this.#tour.stops,
        leadTo: (stop) => this.#leadTo(stop),
        hasArrived: () => this.#rooms.isOpen && !this.#visitor.isUnderWay,
        woken: () => this.#stage.wake(),
        closed: () => this.#endGuide(),
      },
      this.front.words,
      (stop) => this.front.text(stop.text),
    );
    if (!attracts) this.front.overlay.append(this.#guide.element);
    this.front.panel.close();
    this.front.hideHint();
    const here = this.#tour.stops.findIndex(({ room }) => room === this.#rooms.room.id);
    this.#guide.go(attracts ? 0 : Math.max(0, here));
  }

  #leadTo(stop: Stop): void {
    const room = roomCalled(this.#tour, stop.room);
    if (!room) return;
    if (room !== this.#rooms.room) this.#go(room, stop);
    else if (this.#rooms.isOpen) {
      this.#leaveWay();
      const pace = this.#guide?.attracts ? UNHURRIED : 1;
      if (prefersStillness() || !this.#visitor.glide(stop, pace)) this.#visitor.jump(stop);
      this.#aim();
    }
    this.#stage.wake();
  }

  #endGuide(): void {
    this.#guide?.element.remove();
    this.#guide = null;
  }

  /** The visitor acts: whatever moves by itself leaves off. */
  #takeOver(): void {
    this.#guide?.pause();
    if (this.#visitor.isUnderWay) this.#visitor.stop();
  }

  // ------------------------------------------------------------------ virtual reality

  async #immerse(): Promise<void> {
    const { Immersive } = await import("./modes/immersive.ts");
    const feet = this.#visitor.feet;
    if (this.#immersive || !feet) return;
    this.#leaveWay();
    this.#endGuide();
    try {
      this.#immersive = await Immersive.begin(
        {
          stage: this.#stage,
          rooms: this.#rooms,
          text: (texts) => this.front.text(texts),
          step: () => this.#rooms.tiles?.update(this.#stage.camera, this.#stage.size),
          pass: (link) => this.#pass(link),
          ended: (view) => {
            this.#immersive = null;
            this.#visitor.jump(view);
            this.#aim();
          },
        },
        feet,
        this.#visitor.look.yaw,
      );
    } catch (error) {
      console.warn(error);
      this.#tell(this.front.words.noVr);
    }
  }

  #standImmersed(): void {
    const feet = this.#visitor.feet;
    if (feet) this.#immersive?.stand(feet, this.#visitor.look.yaw);
  }

  #speak(language: string): void {
    if (!this.#manner.kiosk) this.#keepLanguage(language);
    this.#guide?.say(this.front.words, (stop) => this.front.text(stop.text));
    this.#sheet?.say(this.front.words);
    this.#tools.say();
    if (this.#overview) this.front.showSigns(this.#overview.signs());
    this.#stage.draw();
  }

  #keepLanguage(language: string): void {
    chooseLanguageForGood(language);
    const address = this.#addresses.inLanguage(new URL(location.href), language);
    history.replaceState(history.state, "", address);
  }

  // ------------------------------------------------------------------ the loop

  /** One step of the loop. */
  #frame(dt: number): Pace {
    const moved = this.#overview ? this.#overview.frame(dt) : this.#walk(dt);
    if (moved) {
      if (this.#overview) {
        this.#overview.moved();
        this.#stage.draw();
      } else this.#aim();
    }
    const { tiles } = this.#rooms;
    tiles?.update(this.#stage.camera, this.#stage.size);
    if (this.#rooms.isOpen) this.#placeSigns();
    this.#tools.frame();
    const guided = this.#guide?.frame(dt) ?? false;
    const busy = (tiles?.busy ?? false) || (this.#overview?.busy ?? false);
    if (this.#rooms.isOpen) this.#rooms.lookAhead(busy);
    if (moved) return "moving";
    if (guided) return "watching";
    if (busy && !this.#rooms.hasFailed) return "waiting";
    return this.#gamepads.isThere ? "watching" : "still";
  }

  #walk(dt: number): boolean {
    if (!this.#rooms.isOpen || this.#sheet) return false;
    const moved = this.#visitor.move(dt);
    const feet = this.#visitor.feet;
    const door = moved && feet && !this.#guide?.isPlaying ? this.#thresholds.passed(feet) : null;
    if (door) this.#pass(door);
    return moved;
  }

  /** Does something that may set the visitor moving. */
  #act(act: () => void): void {
    act();
    this.front.hideHint();
    this.#stage.wake();
  }

  /** Looks through the visitor's eyes. */
  #aim(): void {
    if (this.#overview || this.#immersive) return;
    this.#stage.aim(this.#visitor.eye, this.#visitor.look);
    this.#rooms.tiles?.moved();
    this.#stage.draw();
    this.front.map.stand(this.#rooms.room, this.#visitor.eye, this.#visitor.look.yaw);
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.#noteView(), REST_MS);
  }

  #placeSigns(): void {
    const { camera, size } = this.#stage;
    const outside = this.#overview !== null;
    this.front.spots.place(
      camera,
      size,
      (at) => !outside && (this.#rooms.collider?.blocks(camera.position, at, SIGN_SLACK_M) ?? false),
    );
  }

  // ------------------------------------------------------------------ mouse and fingers

  #listen(canvas: HTMLCanvasElement): Pointer {
    return new Pointer(canvas, {
      look: (dx, dy) => {
        if (this.#overview) return this.#act(() => undefined);
        this.#takeOver();
        const angle = this.#stage.pixelAngle;
        this.#visitor.turn(dx * angle, dy * angle);
        this.#aim();
      },
      click: (x, y) => {
        const caster = this.#stage.caster(x, y);
        if (this.#tools.click(caster)) return;
        if (this.#overview) return this.#overview.click(caster);
        const place = this.#placeAt(this.#cast(caster));
        this.#takeOver();
        if (place) this.#act(() => this.#visitor.walkTo(place));
      },
      hover: (x, y) => this.#hover(x, y),
      leave: () => {
        if (this.#marker.hide()) this.#stage.draw();
      },
      stick: (ahead, left) => {
        if (this.#overview) return this.#act(() => undefined);
        this.#takeOver();
        this.#act(() => this.#visitor.setStick(ahead, left));
      },
      wheel: (sense) => {
        if (this.#overview) return this.#act(() => undefined);
        this.#stage.zoom(ZOOM_STEP ** sense);
        this.#rooms.tiles?.moved();
      },
    });
  }

  #cast({ ray }: Raycaster): Hit | null {
    return this.#rooms.collider?.cast(ray.origin, ray.direction) ?? null;
  }

  /** Where a click leads: to the floor that it hit, or to the foot of the wall. */
  #placeAt(hit: Hit | null): Vector3 | null {
    if (!hit) return null;
    const place = hit.point.clone();
    if (isFloor(hit)) return place;
    place.addScaledVector(hit.normal, BEFORE_WALL_M);
    const floor = this.#rooms.collider?.heightBelow(place.x, place.y, place.z);
    return place.setZ(floor ?? this.#visitor.feet?.z ?? place.z);
  }

  #hover(x: number, y: number): void {
    const idle = this.#pointer.dragging || this.#overview !== null || this.#tools.picks;
    const hit = idle ? null : this.#cast(this.#stage.caster(x, y));
    const floor = hit && isFloor(hit) ? hit : null;
    this.front.canvas.classList.toggle("on-floor", floor !== null);
    if (floor) this.#marker.show(floor.point, floor.normal);
    if (floor || this.#marker.hide()) this.#stage.draw();
  }

  // ------------------------------------------------------------------ diagnostics

  #view(): View {
    return this.#visitor.view;
  }

  #diagnostics(): Diagnostics {
    const visit = this;
    return {
      get room() {
        return visit.#rooms.room.id;
      },
      get ready() {
        return visit.#rooms.isOpen;
      },
      get idle() {
        const busy = (visit.#rooms.tiles?.busy ?? true) || (visit.#overview?.busy ?? false);
        return visit.#rooms.isOpen && visit.#stage.still && !busy;
      },
      get see() {
        return visit.#way;
      },
      get position() {
        return triple(visit.#stage.camera.getWorldPosition(new Vector3()));
      },
      get look() {
        return triple(visit.#stage.camera.getWorldDirection(new Vector3()));
      },
      get stats() {
        const { render, memory } = visit.#stage.renderer.info;
        return {
          tiles: visit.#rooms.tiles?.tileCount ?? 0,
          triangles: render.triangles,
          drawCalls: render.calls,
          bytes: visit.#rooms.tiles?.bytes ?? 0,
          frames: render.frame,
          textures: memory.textures,
          geometries: memory.geometries,
        };
      },
      get isImmersed() {
        return visit.#immersive !== null;
      },
      get metres() {
        return visit.#tools.metres;
      },
      teleport(position, lookAt) {
        visit.#visitor.hover(new Vector3(...position), new Vector3(...lookAt));
        visit.#aim();
      },
    };
  }
}

/** The tour's first language. */
function firstOf({ languages }: Tour): string {
  return languages[0] ?? "en";
}

function isFloor(hit: Hit): boolean {
  return hit.normal.z > FLOOR_MIN_RISE;
}

function isInside({ bounds: { min, max } }: Room, position: Triple): boolean {
  return position.every(
    (value, i) => value > (min[i] ?? 0) - OUTSIDE_M && value < (max[i] ?? 0) + OUTSIDE_M,
  );
}

function triple({ x, y, z }: Vector3): Triple {
  return [x, y, z];
}
