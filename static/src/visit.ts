/** A visit: one room after the other, and the loop that shows them. */

import { Raycaster, Vector2, Vector3, type LoadingManager } from "three";
import { roomAddress, roomAt } from "./address.ts";
import type { Collider, Hit } from "./collider.ts";
import { readQuery, type Diagnostics } from "./diagnostics.ts";
import { isTouch, prefersStillness } from "./dom.ts";
import { Frontend } from "./frontend.ts";
import { Keyboard } from "./keyboard.ts";
import { Marker } from "./marker.ts";
import type { Action } from "./notice.ts";
import { chosenLanguage, chooseLanguageForGood, leftAt, type Left } from "./past.ts";
import { Pointer } from "./pointer.ts";
import { Prefetch } from "./prefetch.ts";
import { RoomTiles, tileDecoder } from "./room-tiles.ts";
import { Stage, type Pace } from "./stage.ts";
import { Thresholds } from "./threshold.ts";
import { roomOf, type Link, type Room, type Tour, type Triple, type View } from "./tour.ts";
import { Visitor } from "./visitor.ts";
import { chooseLanguage } from "./words.ts";

const FADE_MS = 280;
const ZOOM_STEP = 1.08;
/** A click on a wall leads to the floor so far before it. */
const BEFORE_WALL_M = 0.45;
const FLOOR_MIN_RISE = 0.6;
/** A sign may hang so deep in what stands behind it. */
const SIGN_SLACK_M = 0.5;

type Phase = "opening" | "open" | "failed";

export class Visit {
  readonly #site: URL;
  readonly #tour: Tour;
  readonly #stage: Stage;
  readonly #front: Frontend;
  readonly #decoder: LoadingManager;
  readonly #query = readQuery(location.search);
  readonly #marker = new Marker();
  readonly #visitor: Visitor;
  readonly #pointer: Pointer;
  readonly #prefetch: Prefetch;
  #room: Room;
  #phase: Phase = "opening";
  #tiles: RoomTiles | null = null;
  #collider: Collider | null = null;
  #thresholds = new Thresholds<Link>([]);
  /** Counts the rooms entered, so that what comes late for an earlier one is known. */
  #entered = 0;

  constructor(host: HTMLElement, site: URL, decoder: URL, tour: Tour, room: Room) {
    this.#site = site;
    this.#tour = tour;
    this.#room = room;
    const wishes = [
      new URLSearchParams(location.search).get("lang"),
      chosenLanguage(),
      ...navigator.languages,
    ];
    const language = chooseLanguage(tour.languages, wishes);
    this.#front = new Frontend(host, site, tour, room, language, {
      door: (link) => this.#walkThrough(link),
      reached: (at) => this.#act(() => this.#visitor.face(new Vector3(...at))),
      chosen: (next) => this.#go(next, next.entry),
      language: (tag) => {
        chooseLanguageForGood(tag);
        this.#stage.draw();
      },
    });
    const canvas = this.#front.canvas;
    this.#stage = new Stage(canvas, this.#query.background, (dt) => this.#frame(dt));
    this.#stage.scene.add(this.#marker.group);
    this.#decoder = tileDecoder(decoder);
    this.#prefetch = new Prefetch(site, tour);
    const keyboard = new Keyboard(window, () => this.#act(() => this.#visitor.stop()));
    this.#visitor = new Visitor(keyboard, (door) => this.#pass(door));
    this.#pointer = this.#listen(canvas);
    canvas.addEventListener("webglcontextlost", () =>
      this.#front.notice.tell(this.#front.words.contextLost, []),
    );
    canvas.addEventListener("webglcontextrestored", () => this.#front.notice.clear());
    window.addEventListener("popstate", (event) => this.#returnTo(leftAt(event.state)));
    window.tourgen = this.#diagnostics();
  }

  /** Opens the first room, where it was left if this page was seen before. */
  start(): void {
    const left = leftAt(history.state);
    void this.#enter(this.#room, left?.room === this.#room.id ? left : this.#room.entry, false);
  }

  // ------------------------------------------------------------------ rooms

  async #enter(room: Room, view: View, passing: boolean): Promise<void> {
    const turn = ++this.#entered;
    this.#room = room;
    this.#phase = "opening";
    this.#marker.hide();
    this.#front.expect(room, passing);
    this.#visitor.stop();
    if (this.#tiles && !prefersStillness()) await pause(FADE_MS);
    if (turn !== this.#entered) return;
    this.#leave();
    const now = (act: () => void): void => {
      if (turn === this.#entered) act();
    };
    const tileset = new URL(room.tileset, this.#site);
    const { levels } = this.#query;
    this.#tiles = new RoomTiles(tileset, this.#decoder, this.#stage.camera, levels, isTouch(), {
      changed: () => now(() => this.#stage.draw()),
      progress: (part) => now(() => this.#front.cover.progress(part)),
      root: (collider) => now(() => this.#open(room, view, collider)),
      failed: () => now(() => this.#fail(room, view)),
      partFailed: () => now(() => this.#tellPartMissing()),
    });
    this.#stage.scene.add(this.#tiles.group);
    this.#visitor.wait(view);
    this.#aim();
  }

  #leave(): void {
    if (!this.#tiles) return;
    this.#stage.scene.remove(this.#tiles.group);
    this.#tiles.dispose();
    this.#tiles = null;
    this.#collider = null;
  }

  #open(room: Room, view: View, collider: Collider): void {
    this.#collider = collider;
    this.#visitor.enter(view, collider, room.bounds);
    this.#thresholds = new Thresholds(room.links);
    this.#phase = "open";
    this.#front.reveal();
    this.#aim();
  }

  #walkThrough(link: Link): void {
    const collider = this.#collider;
    if (collider) this.#act(() => this.#visitor.walkThrough(link, collider));
  }

  /** Through a door. */
  #pass(link: Link): void {
    const next = this.#tour.rooms.find(({ id }) => id === link.to);
    if (next && this.#phase === "open") this.#go(next, link.arrive);
  }

  /** To another room's page, by its address. */
  #go(room: Room, view: View): void {
    const left: Left = { room: this.#room.id, ...this.#view() };
    history.replaceState(left, "");
    history.pushState(null, "", roomAddress(this.#site, room.id, location.search));
    void this.#enter(room, view, true);
  }

  #returnTo(left: Left | null): void {
    const room = roomOf(this.#tour, left?.room ?? roomAt(this.#site, location.href));
    void this.#enter(room, left ?? room.entry, true);
  }

  #fail(room: Room, view: View): void {
    this.#phase = "failed";
    const { words } = this.#front;
    const ways: Action[] = [{ label: words.retry, act: () => void this.#enter(room, view, true) }];
    if (room.id !== this.#tour.start) {
      const start = roomOf(this.#tour, this.#tour.start);
      ways.push({ label: words.back, act: () => this.#go(start, start.entry) });
    }
    this.#front.notice.tell(words.noRoom, ways, true);
  }

  #tellPartMissing(): void {
    const { words } = this.#front;
    const retry = { label: words.retry, act: () => this.#tiles?.retry() };
    this.#front.notice.tell(words.partMissing, [retry]);
  }

  // ------------------------------------------------------------------ the loop

  /** One step of the loop. */
  #frame(dt: number): Pace {
    const moved = this.#phase === "open" && this.#visitor.move(dt);
    if (moved) {
      this.#aim();
      const feet = this.#visitor.feet;
      const door = feet && this.#thresholds.passed(feet);
      if (door) this.#pass(door);
    }
    const tiles = this.#tiles;
    tiles?.update(this.#stage.camera, this.#stage.size);
    if (this.#phase === "open") this.#placeSigns();
    const busy = tiles?.busy ?? false;
    if (!busy && this.#phase === "open") void this.#prefetch.neighbours(this.#room);
    if (moved) return "moving";
    return busy && this.#phase !== "failed" ? "waiting" : "still";
  }

  /** Does something that may set the visitor moving. */
  #act(act: () => void): void {
    act();
    this.#front.hideHint();
    this.#stage.wake();
  }

  /** Looks through the visitor's eyes. */
  #aim(): void {
    this.#stage.aim(this.#visitor.eye, this.#visitor.look);
    this.#tiles?.moved();
    this.#stage.draw();
  }

  #placeSigns(): void {
    const { camera, size } = this.#stage;
    this.#front.spots.place(
      camera,
      size,
      (at) => this.#collider?.blocks(camera.position, at, SIGN_SLACK_M) ?? false,
    );
  }

  // ------------------------------------------------------------------ mouse and fingers

  #listen(canvas: HTMLCanvasElement): Pointer {
    return new Pointer(canvas, {
      look: (dx, dy) => {
        const angle = this.#stage.pixelAngle;
        this.#visitor.turn(dx * angle, dy * angle);
        this.#aim();
      },
      click: (x, y) => {
        const place = this.#placeAt(this.#pick(x, y));
        if (place) this.#act(() => this.#visitor.walkTo(place));
      },
      hover: (x, y) => this.#hover(x, y),
      leave: () => {
        if (this.#marker.hide()) this.#stage.draw();
      },
      stick: (ahead, left) => this.#act(() => this.#visitor.setStick(ahead, left)),
      wheel: (sense) => {
        this.#stage.zoom(ZOOM_STEP ** sense);
        this.#tiles?.moved();
      },
    });
  }

  #pick(x: number, y: number): Hit | null {
    const { camera, size } = this.#stage;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((x / size.x) * 2 - 1, 1 - (y / size.y) * 2), camera);
    return this.#collider?.cast(caster.ray.origin, caster.ray.direction) ?? null;
  }

  /** Where a click leads: to the floor that it hit, or to the foot of the wall. */
  #placeAt(hit: Hit | null): Vector3 | null {
    if (!hit) return null;
    const place = hit.point.clone();
    if (isFloor(hit)) return place;
    place.addScaledVector(hit.normal, BEFORE_WALL_M);
    const floor = this.#collider?.heightBelow(place.x, place.y, place.z);
    return place.setZ(floor ?? this.#visitor.feet?.z ?? place.z);
  }

  #hover(x: number, y: number): void {
    const hit = this.#pointer.dragging ? null : this.#pick(x, y);
    const floor = hit && isFloor(hit) ? hit : null;
    this.#front.canvas.classList.toggle("on-floor", floor !== null);
    if (floor) this.#marker.show(floor.point, floor.normal);
    if (floor || this.#marker.hide()) this.#stage.draw();
  }

  // ------------------------------------------------------------------ diagnostics

  #view(): View {
    const eye = this.#stage.camera.position;
    return {
      position: triple(eye),
      look_at: triple(this.#visitor.look.direction().add(eye)),
    };
  }

  #diagnostics(): Diagnostics {
    const visit = this;
    return {
      get room() {
        return visit.#room.id;
      },
      get ready() {
        return visit.#phase === "open";
      },
      get idle() {
        return visit.#phase === "open" && visit.#stage.still && !(visit.#tiles?.busy ?? true);
      },
      get position() {
        return visit.#view().position;
      },
      get look() {
        return triple(visit.#visitor.look.direction());
      },
      get stats() {
        const { render } = visit.#stage.renderer.info;
        return {
          tiles: visit.#tiles?.tileCount ?? 0,
          triangles: render.triangles,
          drawCalls: render.calls,
          bytes: visit.#tiles?.bytes ?? 0,
          frames: render.frame,
        };
      },
      teleport(position, lookAt) {
        visit.#visitor.hover(new Vector3(...position), new Vector3(...lookAt));
        visit.#aim();
      },
    };
  }
}

function isFloor(hit: Hit): boolean {
  return hit.normal.z > FLOOR_MIN_RISE;
}

function triple({ x, y, z }: Vector3): Triple {
  return [x, y, z];
}

function pause(ms: number): Promise<void> {
  return new Promise((done) => setTimeout(done, ms));
}
