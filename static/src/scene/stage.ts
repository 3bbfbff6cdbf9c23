/** Canvas, camera and the loop that draws only when something moved. */

import {
  Color,
  ColorManagement,
  LinearSRGBColorSpace,
  Mesh,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  WebGLRenderer,
  type Vector3,
} from "three";
import type { Look } from "../walk/look.ts";
import { Sharpness } from "./sharpness.ts";

/** What a step of the loop asks for: more steps because one moves, watches or waits, or none. */
export type Pace = "moving" | "watching" | "waiting" | "still";

// Light is baked into the textures and nothing adds to it: colours pass as they are. To have each
// texel of each picture turned into linear light and back costs a third of a weak machine's time.
ColorManagement.enabled = false;

const PIXEL_RATIO_MAX = 2;
/** A slow machine walks no slower down to four pictures a second. */
const STEP_MAX_S = 0.25;
const NEAR_M = 0.04;
const FAR_M = 500;
/** Vertical field of view of a wide window; a tall one sees at least `ACROSS_MIN_DEG` across. */
const UPRIGHT_DEG = 65;
const ACROSS_MIN_DEG = 48;
const UPRIGHT_MAX_DEG = 85;
const ZOOM_MIN = 0.45;

export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(UPRIGHT_DEG, 1, NEAR_M, FAR_M);
  readonly size = new Vector2(1, 1);
  readonly #frame: (dt: number) => Pace;
  readonly #sharpness = new Sharpness();
  #sharp = 1;
  #zoom = 1;
  #scheduled = 0;
  #isPaused = false;
  #before: number | null = null;
  #dirty = true;
  #hasBegun = false;

  /**
   * @param canvas Where to draw.
   * @param background CSS colour of the void.
   * @param frame Called before each picture with the seconds gone.
   */
  constructor(canvas: HTMLCanvasElement, background: string, frame: (dt: number) => Pace) {
    this.#frame = frame;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace; // that is, as they are
    this.scene.background = new Color(background);
    this.camera.up.set(0, 0, 1);
    new ResizeObserver(() => this.#fit()).observe(canvas);
    canvas.addEventListener("webglcontextrestored", () => this.draw());
    this.#fit();
  }

  /** Whether nothing is moving and the last picture stands. */
  get still(): boolean {
    return this.#scheduled === 0 && !this.#dirty;
  }

  /** Radians that a pixel spans in the middle of the picture. */
  get pixelAngle(): number {
    return (this.camera.fov * Math.PI) / 180 / this.size.y;
  }

  /** Asks for a picture. */
  draw(): void {
    this.#dirty = true;
    this.wake();
  }

  /** Asks for a step of the loop; a picture is drawn only if something is found changed. */
  wake(): void {
    if (this.#isPaused) return;
    if (this.#scheduled === 0) this.#scheduled = requestAnimationFrame((now) => this.#tick(now));
  }

  /** Leaves the loop to a headset, which asks for pictures at a pace of its own. */
  pauseFor(frame: (now: number) => void): void {
    cancelAnimationFrame(this.#scheduled);
    this.#scheduled = 0;
    this.#isPaused = true;
    this.renderer.setAnimationLoop((now) => {
      frame(now);
      this.render();
    });
  }

  /** Stops the loop for good: pictures are drawn by `render` alone, each as sharp as can be. */
  hold(): void {
    cancelAnimationFrame(this.#scheduled);
    this.#scheduled = 0;
    this.#isPaused = true;
  }

  /** Draws a picture at once. */
  render(): void {
    this.renderer.render(this.scene, this.camera);
  }

  /** Takes the loop back. */
  resume(): void {
    this.renderer.setAnimationLoop(null);
    this.#isPaused = false;
    this.#before = null;
    this.#fit();
  }

  zoom(factor: number): void {
    this.#zoom = Math.min(1, Math.max(ZOOM_MIN, this.#zoom * factor));
    this.#fit();
  }

  /** Takes the zoom back. */
  widen(): void {
    this.#zoom = 1;
    this.#fit();
  }

  aim(eye: Vector3, look: Look): void {
    this.camera.position.copy(eye);
    this.camera.lookAt(look.direction().add(eye));
    this.camera.updateMatrixWorld();
  }

  /** A ray through a place of the picture, pixels from the upper left. */
  caster(x: number, y: number): Raycaster {
    const caster = new Raycaster();
    const at = new Vector2((x / this.size.x) * 2 - 1, 1 - (y / this.size.y) * 2);
    caster.setFromCamera(at, this.camera);
    return caster;
  }

  /** Hands the picture out as a PNG. */
  picture(take: (picture: Blob) => void): void {
    this.render(); // or what is drawn may be gone already
    this.renderer.domElement.toBlob((picture) => {
      if (picture) take(picture);
    });
  }

  #tick(now: number): void {
    const dt = this.#before === null ? 1 / 60 : Math.min(STEP_MAX_S, (now - this.#before) / 1000);
    this.#scheduled = 0;
    const pace = this.#frame(dt);
    const sharp = this.#sharpness.next(dt, pace === "moving");
    if (sharp !== this.#sharp) {
      this.#sharp = sharp;
      this.#resize();
    }
    if (this.#dirty) {
      this.#dirty = false;
      // Each picture of nothing takes time from the first of a room, and its poster stands before it.
      this.#hasBegun ||= holdsMesh(this.scene);
      if (this.#hasBegun) this.render();
    }
    this.#before = pace === "still" ? null : now;
    if (pace !== "still") this.wake();
  }

  #fit(): void {
    const canvas = this.renderer.domElement;
    const width = Math.max(1, canvas.clientWidth);
    const height = Math.max(1, canvas.clientHeight);
    this.size.set(width, height);
    this.#resize();
    this.camera.aspect = width / height;
    this.camera.fov = uprightField(width / height) * this.#zoom;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  #resize(): void {
    const ratio = Math.min(window.devicePixelRatio, PIXEL_RATIO_MAX) * this.#sharp;
    const { x, y } = this.size;
    const has = this.renderer.getSize(new Vector2()).equals(this.size);
    // Being told anew, even the same, throws the picture away.
    if (has && this.renderer.getPixelRatio() === ratio) return;
    this.renderer.setDrawingBufferSize(x, y, ratio);
    this.#dirty = true;
  }
}

/** Vertical field of view, degrees, for a picture of this shape. */
export function uprightField(aspect: number): number {
  const across = Math.tan((ACROSS_MIN_DEG * Math.PI) / 360);
  const needed = (Math.atan(across / aspect) * 360) / Math.PI;
  return Math.min(UPRIGHT_MAX_DEG, Math.max(UPRIGHT_DEG, needed));
}

function holdsMesh(scene: Scene): boolean {
  let holds = false;
  scene.traverseVisible((object) => {
    holds ||= object instanceof Mesh;
  });
  return holds;
}
