/** A visit: one room after the other, and all that happens in between. */

import { Raycaster, Vector2, Vector3, type LoadingManager } from "three";
import { roomAddress, roomAt } from "./address.ts";
import type { Collider, Hit } from "./collider.ts";
import { Cover } from "./cover.ts";
import { readQuery } from "./diagnostics.ts";
import { element, icon, ICONS, isTouch, prefersStillness } from "./dom.ts";
import { Errand } from "./errand.ts";
import { Header } from "./header.ts";
import { Hotspots, type Spot } from "./hotspots.ts";
import { Keyboard } from "./keyboard.ts";
import { Look } from "./look.ts";
import { Marker } from "./marker.ts";
import { Notice } from "./notice.ts";
import { Panel, prose } from "./panel.ts";
import { Pointer } from "./pointer.ts";
import { Prefetch } from "./prefetch.ts";
import { RoomTiles, tileDecoder } from "./room-tiles.ts";
import { Stage } from "./stage.ts";
import { Thresholds } from "./threshold.ts";
import { roomOf, type Link, type Note, type Room, type Tour, type Triple, type View } from "./tour.ts";
import { Walker } from "./walker.ts";
import { chooseLanguage, textIn, wordsIn, type Words } from "./words.ts";

const WALK_M_S = 1.7;
const RUN_M_S = 3.4;
const TURN_RAD_S = 1.5;
const FADE_MS = 280;
const STEER_PER_S = 5;
/** Time steps of a walk that is not shown, for visitors who asked for less motion. */
const CUT_STEP_S = 0.05;
const CUT_STEPS = 200;
const ZOOM_STEP = 1.08;
/** How near to a door's floor a walk that a click started must come. */
const DOOR_WITHIN_M = 0.45;
/** A click on a wall leads to the floor so far before it. */
const BEFORE_WALL_M = 0.45;
const FLOOR_MIN_RISE = 0.6;
const DOOR_FADE_M = [9, 18] as const;
const NOTE_FADE_M = [4, 8] as const;
const DOOR_SLACK_M = 0.5;
const LANGUAGE_KEY = "tourgen.language";

/** What history remembers of a room that was left. */
interface Remembered {
  readonly room: string;
  readonly eye: Triple;
  readonly target: Triple;
}

type Phase = "opening" | "open" | "failed";

export class Visit {
  readonly #site: URL;
  readonly #tour: Tour;
  readonly #stage: Stage;
  readonly #decoder: LoadingManager;
  readonly #query = readQuery(location.search);
  readonly #look = new Look();
  readonly #marker = new Marker();
  readonly #spots = new Hotspots();
  readonly #panel = new Panel();
  readonly #notice = new Notice();
  readonly #cover: Cover;
  readonly #header: Header;
  readonly #keyboard: Keyboard;
  readonly #pointer: Pointer;
  readonly #prefetch: Prefetch;
  readonly #canvas = element("canvas", { tabindex: "0", role: "application" });
  readonly #hint = element("p", { class: "hint" });
  #language: string;
  #words: Words;
  #room: Room;
  #phase: Phase = "opening";
  #tiles: RoomTiles | null = null;
  #collider: Collider | null = null;
  #walker: Walker | null = null;
  #thresholds: Thresholds<Link> | null = null;
  #errand: Errand | null = null;
  #errandDoor: Link | null = null;
  #steerTo: Vector3 | null = null;
  #stick: readonly [number, number] = [0, 0];
  #visits = 0;

  constructor(host: HTMLElement, site: URL, decoder: URL, tour: Tour, room: Room) {
    this.#site = site;
    this.#tour = tour;
    this.#room = room;
    this.#language = chooseLanguage(tour.languages, [
      new URLSearchParams(location.search).get("lang"),
      stored(LANGUAGE_KEY),
      ...navigator.languages,
    ]);
    this.#words = wordsIn(this.#language);
    this.#stage = new Stage(this.#canvas, this.#query.background, (dt) => this.#frame(dt));
    this.#stage.scene.add(this.#marker.group);
    this.#decoder = tileDecoder(decoder);
    this.#prefetch = new Prefetch(site, tour);
    this.#cover = new Cover(host.querySelector("img") ?? element("img", { alt: "" }));
    this.#header = new Header(tour.languages, {
      rooms: () => this.#showRooms(),
      about: () => this.#showText(),
      language: (tag) => this.#speak(tag),
    });
    host.replaceChildren(
      this.#canvas,
      this.#cover.element,
      this.#spots.element,
      this.#hint,
      this.#header.element,
      this.#panel.element,
      this.#notice.element,
    );
    this.#keyboard = new Keyboard(window, () => {
      this.#stopErrand();
      this.#stage.wake();
    });
    this.#pointer = this.#listen();
    this.#canvas.addEventListener("webglcontextlost", () =>
      this.#notice.tell(this.#words.contextLost, []),
    );
    this.#canvas.addEventListener("webglcontextrestored", () => this.#notice.clear());
    window.addEventListener("popstate", (event) => this.#returnTo(event.state as Remembered | null));
    window.tourgen = this.#diagnostics();
  }

  /** Opens the first room, where it was left if this page was seen before. */
  start(): void {
    const remembered = history.state as Remembered | null;
    const view = remembered?.room === this.#room.id ? viewOf(remembered) : this.#room.entry;
    void this.#enter(this.#room, view, false);
  }

  // ------------------------------------------------------------------ rooms

  async #enter(room: Room, view: View, passing: boolean): Promise<void> {
    const visit = ++this.#visits;
    this.#room = room;
    this.#phase = "opening";
    this.#stopErrand();
    this.#marker.hide();
    this.#panel.close();
    this.#notice.clear();
    this.#walker = null;
    this.#spots.show([]);
    this.#say();
    const poster = new URL(room.poster, this.#site).href;
    this.#cover.show(poster, textIn(room.title, this.#language), this.#words.loading, passing);
    if (this.#tiles && !prefersStillness()) await pause(FADE_MS);
    if (visit !== this.#visits) return;
    this.#leave();
    const current = (act: () => void) => () => {
      if (visit === this.#visits) act();
    };
    this.#tiles = new RoomTiles(
      new URL(room.tileset, this.#site),
      this.#decoder,
      this.#stage.camera,
      this.#query.levels,
      isTouch(),
      {
        changed: current(() => this.#stage.draw()),
        progress: (part) => {
          if (visit === this.#visits) this.#cover.progress(part);
        },
        root: (collider) => {
          if (visit === this.#visits) this.#open(room, view, collider);
        },
        failed: current(() => this.#fail(room, view)),
        partFailed: current(() => this.#tellPartMissing()),
      },
    );
    this.#stage.scene.add(this.#tiles.group);
    this.#aim(new Vector3(...view.position), new Vector3(...view.look_at));
    this.#stage.draw();
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
    this.#walker = new Walker(collider, room.bounds);
    this.#walker.place(new Vector3(...view.position));
    this.#aim(this.#walker.eye, new Vector3(...view.look_at));
    this.#thresholds = new Thresholds(room.links);
    this.#phase = "open";
    this.#cover.progress(1);
    this.#cover.hide();
    this.#showSpots();
    this.#stage.draw();
  }

  /** Through a door: to the other room's page, by its address. */
  #pass(link: Link): void {
    const next = this.#tour.rooms.find(({ id }) => id === link.to);
    if (!next || this.#phase === "opening") return;
    this.#go(next, link.arrive);
  }

  #go(room: Room, view: View): void {
    const { eye, target } = this.#where();
    const here: Remembered = { room: this.#room.id, eye, target };
    history.replaceState(here, "");
    history.pushState(null, "", roomAddress(this.#site, room.id, location.search));
    void this.#enter(room, view, true);
  }

  #returnTo(remembered: Remembered | null): void {
    const room = roomOf(this.#tour, remembered?.room ?? roomAt(this.#site, location.href));
    void this.#enter(room, remembered ? viewOf(remembered) : room.entry, true);
  }

  #fail(room: Room, view: View): void {
    this.#phase = "failed";
    const actions = [
      { label: this.#words.retry, act: () => void this.#enter(room, view, true) },
    ];
    if (room.id !== this.#tour.start) {
      const start = roomOf(this.#tour, this.#tour.start);
      actions.push({ label: this.#words.back, act: () => this.#go(start, start.entry) });
    }
    this.#notice.tell(this.#words.noRoom, actions, true);
  }

  #tellPartMissing(): void {
    const retry = { label: this.#words.retry, act: () => this.#tiles?.retry() };
    this.#notice.tell(this.#words.partMissing, [retry]);
  }

  // ------------------------------------------------------------------ the loop

  /** One step of the loop. Returns whether there will be more to do. */
  #frame(dt: number): boolean {
    const moving = this.#move(dt);
    const tiles = this.#tiles;
    if (moving) {
      tiles?.moved();
      this.#stage.draw();
    }
    tiles?.update(this.#stage.camera, this.#stage.size);
    if (this.#walker) this.#placeSpots();
    const busy = tiles?.busy ?? false;
    if (!busy && this.#phase === "open") this.#whenIdle();
    return moving || (busy && this.#phase !== "failed");
  }

  /** Moves and turns the visitor. Returns whether anything moved. */
  #move(dt: number): boolean {
    const walker = this.#walker;
    if (!walker) return false;
    const wish = this.#keyboard.wish();
    const ahead = wish.ahead + this.#stick[0];
    const left = wish.left + this.#stick[1];
    let moving = this.#keyboard.active || ahead !== 0 || left !== 0;
    this.#look.turn(wish.turn * TURN_RAD_S * dt, wish.up * TURN_RAD_S * dt * 0.6);
    if (this.#steerTo) moving = this.#steer(this.#steerTo, dt) || moving;
    if (ahead !== 0 || left !== 0) {
      const speed = (wish.fast ? RUN_M_S : WALK_M_S) / Math.max(1, Math.hypot(ahead, left));
      const c = Math.cos(this.#look.yaw) * speed;
      const s = Math.sin(this.#look.yaw) * speed;
      walker.walk(ahead * c - left * s, ahead * s + left * c, dt);
      this.#hideHint();
    } else if (this.#errand) {
      moving = true;
      this.#runErrand(walker, this.#errand, dt);
    }
    moving = walker.settle(dt, !prefersStillness()) || moving;
    if (moving) {
      this.#stage.aim(walker.eye, this.#look);
      const door = this.#thresholds?.passed(walker.feet);
      if (door) this.#pass(door);
    }
    return moving;
  }

  #runErrand(walker: Walker, errand: Errand, dt: number): void {
    walker.walk(...errand.velocity(walker.feet), dt);
    if (errand.judge(walker.feet, dt) === "walking") return;
    const door = this.#errandDoor;
    this.#stopErrand();
    if (door) this.#pass(door);
  }

  /** Turns toward a point as a head does. Returns whether it is still turning. */
  #steer(target: Vector3, dt: number): boolean {
    const goal = new Look();
    goal.at(this.#stage.camera.position, target);
    const part = prefersStillness() ? 1 : 1 - Math.exp(-STEER_PER_S * dt);
    if (this.#look.approach(goal.yaw, goal.pitch, part) > 0.01) return true;
    this.#steerTo = null;
    return true;
  }

  #aim(eye: Vector3, target: Vector3): void {
    this.#look.at(eye, target);
    this.#stage.aim(eye, this.#look);
    this.#tiles?.moved();
  }

  #placeSpots(): void {
    const { camera, size } = this.#stage;
    this.#spots.place(camera, size, (at) =>
      this.#collider ? this.#collider.blocks(camera.position, at, DOOR_SLACK_M) : false,
    );
  }

  #whenIdle(): void {
    const room = this.#room;
    const idle = window.requestIdleCallback ?? ((act: () => void) => setTimeout(act, 200));
    idle(() => {
      if (room === this.#room) void this.#prefetch.neighbours(room);
    });
  }

  // ------------------------------------------------------------------ mouse and fingers

  #listen(): Pointer {
    return new Pointer(this.#canvas, {
      look: (dx, dy) => {
        const angle = this.#stage.pixelAngle;
        this.#steerTo = null;
        this.#look.turn(dx * angle, dy * angle);
        this.#turned();
      },
      click: (x, y) => {
        const hit = this.#pick(x, y);
        if (hit) this.#walkTo(hit);
      },
      hover: (x, y) => this.#hover(x, y),
      leave: () => this.#marker.hide() && this.#stage.draw(),
      stick: (ahead, left) => {
        this.#stick = [ahead, left];
        if (ahead !== 0 || left !== 0) this.#stopErrand();
        this.#stage.wake();
      },
      wheel: (delta) => {
        this.#stage.zoom(ZOOM_STEP ** delta);
        this.#tiles?.moved();
      },
    });
  }

  #turned(): void {
    if (this.#walker) this.#stage.aim(this.#walker.eye, this.#look);
    this.#tiles?.moved();
    this.#stage.draw();
  }

  #pick(x: number, y: number): Hit | null {
    const { camera, size } = this.#stage;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((x / size.x) * 2 - 1, 1 - (y / size.y) * 2), camera);
    return this.#collider?.cast(ray.ray.origin, ray.ray.direction) ?? null;
  }

  #hover(x: number, y: number): void {
    const hit = this.#pointer.dragging ? null : this.#pick(x, y);
    const onFloor = hit !== null && hit.normal.z > FLOOR_MIN_RISE;
    this.#canvas.classList.toggle("on-floor", onFloor);
    if (onFloor) this.#marker.show(hit.point, hit.normal);
    if (onFloor || this.#marker.hide()) this.#stage.draw();
  }

  #walkTo(hit: Hit): void {
    const target = hit.point.clone();
    if (hit.normal.z <= FLOOR_MIN_RISE) target.addScaledVector(hit.normal, BEFORE_WALL_M);
    this.#begin(new Errand(target), null);
  }

  #walkThrough(link: Link): void {
    const at = new Vector3(...link.at);
    this.#begin(new Errand(at, DOOR_WITHIN_M), link);
    this.#steerTo = at;
  }

  #begin(errand: Errand, door: Link | null): void {
    if (!this.#walker) return;
    this.#hideHint();
    this.#errand = errand;
    this.#errandDoor = door;
    this.#steerTo = null;
    if (prefersStillness()) this.#cutTo(this.#walker, errand);
    this.#stage.wake();
  }

  /** Walks without showing the way. */
  #cutTo(walker: Walker, errand: Errand): void {
    for (let i = 0; i < CUT_STEPS && errand.judge(walker.feet, CUT_STEP_S) === "walking"; i++) {
      walker.walk(...errand.velocity(walker.feet), CUT_STEP_S);
    }
  }

  #stopErrand(): void {
    this.#errand = null;
    this.#errandDoor = null;
    this.#steerTo = null;
  }

  // ------------------------------------------------------------------ what is told

  #showSpots(): void {
    const doors = this.#room.links.map((link) => this.#doorSpot(link));
    const notes = this.#room.notes.map((note) => this.#noteSpot(note));
    this.#spots.show([...doors, ...notes]);
  }

  #doorSpot(link: Link): Spot {
    const name = textIn(link.title, this.#language);
    const button = element(
      "button",
      {
        type: "button",
        class: "spot door",
        "data-to": link.to,
        "aria-label": this.#words.goTo.replace("{name}", name),
      },
      icon(ICONS.door),
      element("span", {}, name),
    );
    button.addEventListener("click", () => this.#walkThrough(link));
    this.#faceOnFocus(button, link.at);
    return { at: link.at, button, fade: DOOR_FADE_M };
  }

  #noteSpot(note: Note): Spot {
    const title = textIn(note.title, this.#language);
    const button = element("button", { type: "button", class: "spot note", "aria-label": title });
    button.append(element("span", {}, title));
    button.addEventListener("click", () => this.#showNote(note));
    this.#faceOnFocus(button, note.at);
    return { at: note.at, button, fade: NOTE_FADE_M };
  }

  /** By keyboard one reaches what is behind one's back: look there. */
  #faceOnFocus(button: HTMLButtonElement, at: Triple): void {
    button.addEventListener("focus", () => {
      if (!button.matches(":focus-visible")) return;
      this.#steerTo = new Vector3(...at);
      this.#stage.wake();
    });
  }

  #showNote(note: Note): void {
    const content: Node[] = [];
    if (note.image) {
      const source = new URL(note.image, this.#site).href;
      content.push(element("img", { src: source, alt: textIn(note.title, this.#language) }));
    }
    content.push(prose(textIn(note.text, this.#language)));
    this.#panel.open(textIn(note.title, this.#language), ...content);
  }

  #showText(): void {
    this.#panel.open(
      textIn(this.#room.title, this.#language),
      prose(textIn(this.#room.text, this.#language)),
    );
  }

  #showRooms(): void {
    const items = this.#tour.rooms.map((room) => {
      const current = room === this.#room;
      const link = element(
        "a",
        { href: roomAddress(this.#site, room.id), ...(current ? { "aria-current": "page" } : {}) },
        element("img", { src: new URL(room.poster, this.#site).href, alt: "", loading: "lazy" }),
        element("span", {}, textIn(room.title, this.#language)),
      );
      link.addEventListener("click", (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        event.preventDefault();
        this.#panel.close();
        if (!current) this.#go(room, room.entry);
      });
      return element("li", {}, link);
    });
    this.#panel.open(this.#words.rooms, element("ul", { class: "rooms" }, ...items));
  }

  #speak(language: string): void {
    this.#language = language;
    this.#words = wordsIn(language);
    store(LANGUAGE_KEY, language);
    this.#panel.close();
    this.#notice.clear();
    this.#say();
    if (this.#phase === "open") this.#showSpots();
    this.#stage.draw();
  }

  #say(): void {
    const room = textIn(this.#room.title, this.#language);
    const tour = textIn(this.#tour.title, this.#language);
    document.documentElement.lang = this.#language;
    document.title = room === tour ? tour : `${room} – ${tour}`;
    this.#header.say(
      this.#words,
      this.#language,
      tour,
      room,
      textIn(this.#room.text, this.#language) !== "",
    );
    this.#panel.setWords(this.#words.close);
    this.#canvas.setAttribute("aria-label", this.#words.view);
    this.#spots.element.setAttribute("aria-label", `${this.#words.doors}, ${this.#words.notes}`);
    this.#hint.textContent = isTouch() ? this.#words.hintTouch : this.#words.hintMouse;
  }

  #hideHint(): void {
    this.#hint.classList.add("gone");
  }

  // ------------------------------------------------------------------ diagnostics

  #where(): { eye: Triple; target: Triple } {
    const eye = this.#stage.camera.position;
    const target = this.#look.direction().add(eye);
    return { eye: [eye.x, eye.y, eye.z], target: [target.x, target.y, target.z] };
  }

  #diagnostics(): NonNullable<Window["tourgen"]> {
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
        return visit.#where().eye;
      },
      get look() {
        const { x, y, z } = visit.#look.direction();
        return [x, y, z] as const;
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
        visit.#stopErrand();
        visit.#walker?.hover(new Vector3(...position));
        visit.#aim(new Vector3(...position), new Vector3(...lookAt));
        visit.#stage.draw();
      },
    };
  }
}

function viewOf(remembered: Remembered): View {
  return { position: remembered.eye, look_at: remembered.target };
}

function pause(ms: number): Promise<void> {
  return new Promise((done) => setTimeout(done, ms));
}

/** Storage is refused where cookies are: the choice then lasts for the page. */
function stored(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

function store(key: string, value: string): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    return;
  }
}
