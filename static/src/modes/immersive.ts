/**
 * Virtual reality: one stands in the room, points at the floor to go there, and turns in steps.
 *
 * What moves the picture without the head moving makes people ill, so nothing glides here: places
 * and headings are changed at once, behind a dark rim that closes for a moment.
 */

import {
  BufferGeometry,
  CanvasTexture,
  Color,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Raycaster,
  RingGeometry,
  Sprite,
  SpriteMaterial,
  Vector3,
  type Material,
  type Object3D,
  type XRTargetRaySpace,
} from "three";
import type { Rooms } from "../rooms.ts";
import { goBy } from "../scene/frames.ts";
import { Marker } from "../scene/marker.ts";
import type { Stage } from "../scene/stage.ts";
import type { Link, Texts, Triple, View } from "../tour.ts";
import { isFloor } from "../walk/collider.ts";
import { EYE_M } from "../walk/walker.ts";

const TURN_RAD = Math.PI / 6;
/** A stick counts from the first on, and again once it fell below the second. */
const STICK = [0.7, 0.3] as const;
const REACH_M = 12;
const SIGN_M = 0.22;
const SIGN_WITHIN = 0.97;
const VIGNETTE_S = 0.35;
const UPRIGHT = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2);
const UP = new Vector3(0, 0, 1);

export interface ImmersiveHost {
  readonly stage: Stage;
  readonly rooms: Rooms;
  text(texts: Texts): string;
  /** Brings everything but the picture up to the time. */
  step(): void;
  /** Through a door. */
  pass(link: Link): void;
  /** The session is over; where one stood last. */
  ended(view: View): void;
}

export class Immersive {
  readonly #host: ImmersiveHost;
  readonly #session: XRSession;
  readonly #rig = new Group();
  readonly #marker = new Marker();
  readonly #signs = new Group();
  readonly #vignette = vignette();
  readonly #doors = new Map<Sprite, Link>();
  /** Takes away what was added to each hand, which three.js hands out to the next session again. */
  readonly #lettingGo: (() => void)[] = [];
  #pointing: XRTargetRaySpace | null = null;
  #stickIsOut = false;
  #dark = 0;
  #feet = new Vector3();
  #yaw = 0;
  #before: number | null = null;

  private constructor(host: ImmersiveHost, session: XRSession) {
    this.#host = host;
    this.#session = session;
  }

  /** Begins a session, standing as in a view. */
  static async begin(host: ImmersiveHost, feet: Vector3, yaw: number): Promise<Immersive> {
    const xr = navigator.xr;
    if (!xr) throw new Error("WebXR: expected it in this browser, found none");
    const session = await xr.requestSession("immersive-vr", {
      optionalFeatures: ["local-floor"],
    });
    const made = new Immersive(host, session);
    await made.#open(feet, yaw);
    return made;
  }

  /** Stands somewhere else: after a door, in another room. */
  stand(feet: Vector3, yaw: number): void {
    this.#feet.copy(feet);
    this.#yaw = yaw;
    this.#place();
    this.#showSigns();
    this.#dark = 1;
  }

  end(): void {
    void this.#session.end();
  }

  async #open(feet: Vector3, yaw: number): Promise<void> {
    const { stage } = this.#host;
    const { renderer, scene, camera } = stage;
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local-floor");
    this.#rig.add(camera, this.#vignette);
    scene.add(this.#rig, this.#marker.group, this.#signs);
    for (const hand of [0, 1]) this.#hold(hand);
    stage.pauseFor((now) => this.#frame(now));
    try {
      await renderer.xr.setSession(this.#session);
    } catch (error) {
      await this.#session.end().catch(() => undefined); // it may be over already
      this.#leave();
      throw error;
    }
    goBy(this.#session);
    this.#session.addEventListener("end", () => this.#close());
    this.stand(feet, yaw);
  }

  #close(): void {
    const { stage, ended } = this.#host;
    const eye = stage.camera.getWorldPosition(new Vector3());
    const ahead = stage.camera.getWorldDirection(new Vector3()).add(eye);
    this.#leave();
    ended.call(this.#host, {
      position: [eye.x, eye.y, this.#feet.z + EYE_M],
      look_at: [ahead.x, ahead.y, this.#feet.z + EYE_M],
    });
  }

  /** Gives camera, hands and loop back, and frees what was for this session alone. */
  #leave(): void {
    const { stage } = this.#host;
    const own = [this.#rig, this.#marker.group, this.#signs];
    goBy(null);
    this.#rig.remove(stage.camera);
    stage.scene.remove(...own);
    for (const each of own) free(each);
    for (const letGo of this.#lettingGo) letGo();
    stage.renderer.xr.enabled = false;
    stage.resume();
  }

  #frame(now: number): void {
    const dt = this.#before === null ? 1 / 72 : (now - this.#before) / 1000;
    this.#before = now;
    this.#readSticks();
    this.#aim();
    this.#dark = Math.max(0, this.#dark - dt / VIGNETTE_S);
    const rim = this.#vignette.material as MeshBasicMaterial;
    rim.opacity = this.#dark;
    this.#vignette.visible = this.#dark > 0;
    const { camera } = this.#host.stage;
    this.#vignette.position.copy(camera.position);
    this.#vignette.quaternion.copy(camera.quaternion);
    this.#vignette.translateZ(-0.3);
    this.#host.step();
  }

  // ------------------------------------------------------------------ hands

  #hold(hand: number): void {
    const space = this.#host.stage.renderer.xr.getController(hand);
    const points = [new Vector3(0, 0, 0), new Vector3(0, 0, -3)];
    const ray = new Line(
      new BufferGeometry().setFromPoints(points),
      new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.6 }),
    );
    const heard = {
      selectstart: () => void (this.#pointing = space),
      selectend: () => this.#go(space),
      squeezestart: () => this.end(),
    };
    const kinds = ["selectstart", "selectend", "squeezestart"] as const;
    this.#rig.add(space);
    space.add(ray);
    for (const kind of kinds) space.addEventListener(kind, heard[kind]);
    this.#lettingGo.push(() => {
      space.remove(ray);
      for (const kind of kinds) space.removeEventListener(kind, heard[kind]);
    });
  }

  /** Shows where one would go. */
  #aim(): void {
    const hit = this.#pointing && this.#floorAt(this.#pointing);
    if (hit) this.#marker.show(hit, UP);
    else this.#marker.hide();
  }

  /** Goes where a hand points: through the door whose sign it is, or to the floor. */
  #go(space: XRTargetRaySpace): void {
    this.#pointing = null;
    const door = this.#doorAt(space);
    if (door) return this.#host.pass(door);
    const place = this.#floorAt(space);
    if (!place) return;
    const head = this.#host.stage.camera.getWorldPosition(new Vector3());
    this.#feet.add(new Vector3().subVectors(place, head)).setZ(place.z);
    this.#place();
    this.#dark = 1;
  }

  #floorAt(space: XRTargetRaySpace): Vector3 | null {
    const { origin, direction } = rayOf(space);
    const hit = this.#host.rooms.collider?.cast(origin, direction, REACH_M);
    return hit && isFloor(hit) ? hit.point : null;
  }

  #doorAt(space: XRTargetRaySpace): Link | null {
    const { origin, direction } = rayOf(space);
    for (const [sign, link] of this.#doors) {
      const way = sign.getWorldPosition(new Vector3()).sub(origin).normalize();
      if (way.dot(direction) > SIGN_WITHIN) return link;
    }
    return null;
  }

  #readSticks(): void {
    const asked = [...this.#session.inputSources].map(({ gamepad }) => gamepad?.axes[2] ?? 0);
    const x = asked.find((each) => Math.abs(each) > STICK[1]) ?? 0;
    if (x === 0) this.#stickIsOut = false;
    else if (Math.abs(x) > STICK[0] && !this.#stickIsOut) {
      this.#stickIsOut = true;
      this.#turn(-Math.sign(x) * TURN_RAD);
    }
  }

  /** Turns about the head. */
  #turn(by: number): void {
    const head = this.#host.stage.camera.getWorldPosition(new Vector3());
    this.#yaw += by;
    this.#feet.sub(head).applyAxisAngle(UP, by).add(head).setZ(this.#rig.position.z);
    this.#place();
    this.#dark = 1;
  }

  #place(): void {
    this.#rig.position.copy(this.#feet);
    // The headset looks along its own -z, which lies along the room's +y then.
    const heading = new Quaternion().setFromAxisAngle(UP, this.#yaw - Math.PI / 2);
    this.#rig.quaternion.copy(heading).multiply(UPRIGHT);
    this.#rig.updateMatrixWorld(true);
  }

  // ------------------------------------------------------------------ signs

  #showSigns(): void {
    free(this.#signs);
    this.#signs.clear();
    this.#doors.clear();
    const { room } = this.#host.rooms;
    for (const link of room.links) {
      const sign = signOf(this.#host.text(link.title), link.at);
      this.#doors.set(sign, link);
      this.#signs.add(sign);
    }
    for (const note of room.notes) this.#signs.add(signOf(this.#host.text(note.title), note.at));
  }
}

function rayOf(space: XRTargetRaySpace): Raycaster["ray"] {
  space.updateWorldMatrix(true, false);
  const caster = new Raycaster();
  caster.ray.origin.setFromMatrixPosition(space.matrixWorld);
  caster.ray.direction.set(0, 0, -1).transformDirection(space.matrixWorld);
  return caster.ray;
}

/** Words that hang in the room and turn to whoever looks. */
function signOf(text: string, at: Triple): Sprite {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d");
  const font = "500 44px system-ui, sans-serif";
  canvas.height = 88;
  if (context) {
    context.font = font;
    canvas.width = Math.ceil(context.measureText(text).width) + 64;
    context.font = font;
    context.fillStyle = "rgb(20 22 26 / 82%)";
    context.roundRect(0, 0, canvas.width, canvas.height, 44);
    context.fill();
    context.fillStyle = "#f4f1ea";
    context.textBaseline = "middle";
    context.fillText(text, 32, 46);
  }
  const material = new SpriteMaterial({ map: new CanvasTexture(canvas), depthTest: false });
  const sign = new Sprite(material);
  sign.position.set(...at);
  sign.scale.set((SIGN_M * canvas.width) / canvas.height, SIGN_M, 1);
  return sign;
}

/** Frees what the graphics card holds of all below; the shape of signs is shared by all there are. */
function free(root: Object3D): void {
  root.traverse((object) => {
    if (object instanceof Sprite) object.material.map?.dispose();
    if (object instanceof Mesh || object instanceof Line) object.geometry.dispose();
    if ("material" in object) (object.material as Material).dispose();
  });
}

/** A dark rim before the eyes, clear in the middle. */
function vignette(): Mesh {
  const geometry = new RingGeometry(0.12, 1.2, 48, 8);
  const places = geometry.getAttribute("position");
  const colors: number[] = [];
  for (let i = 0; i < places.count; i++) {
    const radius = Math.hypot(places.getX(i), places.getY(i));
    colors.push(0, 0, 0, Math.min(1, (radius - 0.12) / 0.25));
  }
  geometry.setAttribute("color", new Float32BufferAttribute(colors, 4));
  const made = new Mesh(
    geometry,
    new MeshBasicMaterial({
      color: new Color(0x000000),
      vertexColors: true,
      transparent: true,
      depthTest: false,
      depthWrite: false,
    }),
  );
  made.renderOrder = 1000;
  made.frustumCulled = false;
  return made;
}
