/** What one does beside seeing: measure, cut open, tint, search, take a picture, pass it on. */

import type { Raycaster } from "three";
import { bytesOf, canTakeAlong, takeAlong } from "./along/along.ts";
import type { Frontend } from "./page/frontend.ts";
import type { Action } from "./page/notice.ts";
import type { Tool } from "./page/sheets.ts";
import type { Rooms } from "./rooms.ts";
import type { Stage } from "./scene/stage.ts";
import { setTint } from "./scene/tint.ts";
import type { Note, Room, Tour } from "./tour.ts";
import { mannerOf } from "./words.ts";
import type { Measure } from "./modes/measure.ts";

export interface ToolsHost {
  readonly tour: Tour;
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  /** Where nothing is saved, sent or worn. */
  readonly kiosk: boolean;
  /** Where the tour can be taken along from; null where it cannot. */
  readonly home: URL | null;
  /** Of the present view; null where it has none that others could use. */
  address(): string | null;
  /** Shows the room in a headset. */
  immerse(): void;
  /** Goes to a room, or to a note of it. */
  open(room: Room, note: Note | null): void;
}

/** Whether this browser, on this device, can show the room in a headset. */
async function canImmerse(): Promise<boolean> {
  try {
    return (await navigator.xr?.isSessionSupported("immersive-vr")) ?? false;
  } catch {
    return false; // refused by the page that frames this one
  }
}

export class Tools {
  readonly #host: ToolsHost;
  #measure: Measure | null = null;
  #isTinted = false;
  #isCut = false;
  #canImmerse = false;

  constructor(host: ToolsHost) {
    this.#host = host;
    const { canvas } = host.front;
    void canImmerse().then((can) => (this.#canImmerse = can));
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.#pickMiddle();
    });
  }

  /** Whether a click picks a point, and does not walk. */
  get picks(): boolean {
    return this.#measure !== null;
  }

  /** What was measured last. */
  get metres(): number | null {
    return this.#measure?.metres ?? null;
  }

  /** What can be done now. */
  list(): readonly Tool[] {
    const { words } = this.#host.front;
    const tools: Tool[] = [
      {
        name: words.measure,
        drawing: "measure",
        isOn: this.#measure !== null,
        act: () => void this.#toggleMeasure(),
      },
      { name: words.section, drawing: "section", isOn: this.#isCut, act: () => void this.#cut() },
      { name: words.tint, drawing: "tint", isOn: this.#isTinted, act: () => this.#toggleTint() },
    ];
    if (this.#host.kiosk) return tools;
    tools.push({ name: words.picture, drawing: "camera", act: () => this.#takePicture() });
    if (this.#host.address() !== null) {
      tools.push({ name: words.share, drawing: "share", act: () => void this.#share() });
    }
    if (this.#host.home && canTakeAlong()) {
      const size = new Intl.NumberFormat(mannerOf(this.#host.front.language), {
        style: "unit",
        unit: "megabyte",
        maximumFractionDigits: 0,
      }).format(bytesOf(this.#host.tour) / 1e6);
      const name = `${words.takeAlong} (${size})`;
      tools.push({ name, drawing: "along", act: () => void this.#takeAlong() });
    }
    if (this.#canImmerse) {
      const act = (): void => {
        this.#host.front.panel.close();
        this.#host.immerse();
      };
      tools.push({ name: words.vr, drawing: "headset", act });
    }
    if (document.fullscreenEnabled) {
      tools.push({ name: words.full, drawing: "full", act: () => void this.#fillScreen() });
    }
    return tools;
  }

  /** Leaves everything as a visitor finds it. */
  reset(): void {
    this.end();
    if (this.#isTinted) this.#toggleTint();
  }

  /** Takes away what belongs to the room that is left. */
  end(): void {
    this.#endMeasure();
    this.#uncut();
  }

  /** Speaks the language of the page. */
  say(): void {
    this.#measure?.say(this.#host.front.words);
  }

  frame(): void {
    const { camera, size } = this.#host.stage;
    this.#measure?.place(camera, size);
  }

  /** Returns whether the click was for a tool. */
  click(caster: Raycaster): boolean {
    if (!this.#measure) return false;
    const hit = this.#host.rooms.tiles?.pick(caster);
    if (hit) this.#measure.pick(hit.point);
    this.#host.stage.draw();
    return true;
  }

  async search(): Promise<void> {
    const { front, tour } = this.#host;
    const script = await front.brought(import("./modes/search.ts"));
    if (!script) return;
    const search = new script.Search(tour, front.language, front.words, {
      chosen: (room, note) => {
        front.panel.close();
        this.#host.open(room, note);
      },
    });
    front.panel.open(front.words.search, search.element);
    search.focus();
  }

  // ------------------------------------------------------------------ one by one

  async #toggleMeasure(): Promise<void> {
    const { front, stage } = this.#host;
    front.panel.close();
    if (this.#measure) return this.#endMeasure();
    const script = await front.brought(import("./modes/measure.ts"));
    if (!script || this.#measure) return;
    this.#measure = new script.Measure(front.words, () => this.#endMeasure());
    stage.scene.add(this.#measure.group);
    front.overlay.append(this.#measure.element);
    front.canvas.focus({ preventScroll: true });
    stage.draw();
  }

  #endMeasure(): void {
    if (!this.#measure) return;
    this.#host.stage.scene.remove(this.#measure.group);
    this.#measure.element.remove();
    this.#measure.dispose();
    this.#measure = null;
    this.#host.stage.draw();
  }

  /** By the keyboard: what the crosshair in the middle lies on. */
  #pickMiddle(): void {
    const { stage } = this.#host;
    if (this.#measure) this.click(stage.caster(stage.size.x / 2, stage.size.y / 2));
  }

  async #cut(): Promise<void> {
    const { front, rooms, stage } = this.#host;
    if (this.#isCut) {
      this.#uncut();
      return front.openTools();
    }
    const script = await front.brought(import("./modes/section.ts"));
    if (!script) return;
    const section = new script.Section(rooms.room, front.words, () => stage.draw());
    stage.renderer.clippingPlanes = [section.plane];
    this.#isCut = true;
    front.panel.open(front.words.section, section.element);
    stage.draw();
  }

  #uncut(): void {
    this.#isCut = false;
    this.#host.stage.renderer.clippingPlanes = [];
    this.#host.stage.draw();
  }

  #toggleTint(): void {
    const { front, stage } = this.#host;
    this.#isTinted = !this.#isTinted;
    setTint(this.#isTinted);
    front.panel.close();
    const ways: Action[] = [{ label: "close", act: () => this.#toggleTint() }];
    if (this.#isTinted) front.notice.tell({ says: "tinted", ways, lasts: true });
    else front.notice.withdraw("tinted");
    stage.draw();
  }

  #takePicture(): void {
    const { front, stage, rooms } = this.#host;
    front.panel.close();
    stage.picture((picture) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(picture);
      link.download = `${rooms.room.id}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    });
  }

  async #share(): Promise<void> {
    const { front } = this.#host;
    const address = this.#host.address();
    if (address === null) return;
    const script = await front.brought(import("./modes/share.ts"));
    if (!script) return;
    front.panel.open(front.words.share, script.shareSheet(front.title, address, front.words));
  }

  async #takeAlong(): Promise<void> {
    const { front, home } = this.#host;
    if (!home) return;
    front.panel.close();
    let told = "";
    const progress = (part: number): void => {
      const share = new Intl.NumberFormat(mannerOf(front.language), { style: "percent" }).format(part);
      if (share === told) return; // of most files nothing is to be read out
      told = share;
      front.notice.tell({ says: "takingAlong", of: share, lasts: true });
    };
    try {
      progress(0);
      await takeAlong(home, progress);
      front.notice.tellUntilClosed("along", true);
    } catch (error) {
      console.warn(error);
      front.notice.tellUntilClosed("notAlong", true);
    } finally {
      front.notice.withdraw("takingAlong");
    }
  }

  async #fillScreen(): Promise<void> {
    this.#host.front.panel.close();
    if (document.fullscreenElement) await document.exitFullscreen();
    else await document.documentElement.requestFullscreen();
  }
}
