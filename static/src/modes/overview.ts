/** From outside: one room to be turned about, or all of them in their places, cut open. */

import CameraControls from "camera-controls";
import {
  Box3,
  Matrix4,
  Quaternion,
  Raycaster,
  Sphere,
  Spherical,
  Vector2,
  Vector3,
  Vector4,
  type PerspectiveCamera,
} from "three";
import { prefersStillness } from "../dom.ts";
import type { Spot } from "../page/hotspots.ts";
import { placeSpot } from "../page/signs.ts";
import type { Rooms } from "../rooms.ts";
import { between } from "../scene/place.ts";
import type { RoomTiles } from "../scene/room-tiles.ts";
import type { Stage } from "../scene/stage.ts";
import type { Room, Tour, Triple, View } from "../tour.ts";
import type { Wish } from "../walk/keyboard.ts";
import { EYE_M } from "../walk/walker.ts";

CameraControls.install({
  THREE: {
    Box3,
    Matrix4,
    Quaternion,
    Raycaster,
    Sphere,
    Spherical,
    Vector2,
    Vector3,
    Vector4,
  },
});

/** Where the camera flies to: so high above the horizon, with so much room around. */
const ELEVATION = 0.75;
const MARGIN = 1.2;
const LOWEST = 1.5;
const FLIGHT_S = 0.55;
const TURN_RAD_S = 1.2;
const DOLLY_PER_S = 1.1;

export interface OverviewHost {
  readonly tour: Tour;
  readonly stage: Stage;
  readonly rooms: Rooms;
  /** A title in the visitor's language. */
  titleOf(room: Room): string;
  /** What the keys ask for. */
  wish(): Wish;
  /** A place was clicked: one goes down to it. */
  enter(room: Room, view: View): void;
}

interface Shown {
  readonly room: Room;
  readonly tiles: RoomTiles;
  /** From the room's frame into that of the room one came from. */
  readonly matrix: Matrix4;
}

export class Overview {
  readonly #host: OverviewHost;
  readonly #controls: CameraControls;
  readonly #shown: readonly Shown[];
  readonly #others: readonly Shown[];
  #leaving = false;

  /** @param all All rooms, or the one that one is in. */
  constructor(host: OverviewHost, all: boolean) {
    this.#host = host;
    const { rooms, stage, tour } = host;
    const here = rooms.room;
    this.#others = all
      ? tour.rooms.filter((room) => room !== here).map((room) => this.#load(room, here))
      : [];
    const mine = rooms.tiles && { room: here, tiles: rooms.tiles, matrix: new Matrix4() };
    this.#shown = mine ? [mine, ...this.#others] : this.#others;
    for (const { tiles } of this.#shown) tiles.seeThrough(true);
    this.#controls = new CameraControls(stage.camera, stage.renderer.domElement);
    const controls = this.#controls;
    controls.smoothTime = FLIGHT_S;
    controls.maxPolarAngle = LOWEST;
    controls.minDistance = 1;
    controls.dollyToCursor = true;
    controls.draggingSmoothTime = prefersStillness() ? 0 : 0.12;
    this.#frameAll();
  }

  /** Names of rooms to hang where they stand. */
  signs(): Spot[] {
    if (this.#others.length === 0) return [];
    return this.#shown.map(({ room, matrix }) => {
      const { x, y, z } = centreOf(room).applyMatrix4(matrix);
      const enter = (): void => this.#host.enter(room, room.entry);
      return placeSpot(this.#host.titleOf(room), [x, y, z], enter, {
        reached: (at) => this.#bring(at),
      });
    });
  }

  /** One step of time. Returns whether the picture changed. */
  frame(dt: number): boolean {
    const wish = this.#host.wish();
    const asked = wish.turn !== 0 || wish.up !== 0 || wish.ahead !== 0 || wish.left !== 0;
    if (asked) {
      void this.#controls.rotate(-(wish.turn + wish.left) * TURN_RAD_S * dt, wish.up * TURN_RAD_S * dt, false);
      void this.#controls.dollyTo(this.#controls.distance * DOLLY_PER_S ** (-wish.ahead * dt * 10), false);
    }
    const moved = this.#controls.update(dt);
    const { camera, size } = this.#host.stage;
    for (const { tiles } of this.#others) tiles.update(camera, size);
    return moved || asked;
  }

  /** Whether rooms are still on their way. */
  get busy(): boolean {
    return this.#others.some(({ tiles }) => tiles.busy);
  }

  moved(): void {
    for (const { tiles } of this.#others) tiles.moved();
  }

  /** Goes down to what was clicked. */
  click(caster: Raycaster): void {
    const hits = this.#shown.flatMap((each) => {
      const hit = each.tiles.pick(caster);
      return hit ? [{ ...each, hit }] : [];
    });
    hits.sort((a, b) => a.hit.distance - b.hit.distance);
    const nearest = hits[0];
    if (!nearest) return;
    const into = nearest.matrix.clone().invert();
    const at = nearest.hit.point.clone().applyMatrix4(into);
    const way = caster.ray.direction.clone().transformDirection(into).setZ(0).normalize();
    at.z += EYE_M;
    this.#host.enter(nearest.room, {
      position: [at.x, at.y, at.z],
      look_at: [at.x + 2 * way.x, at.y + 2 * way.y, at.z - 0.2],
    });
  }

  /** Flies to an eye and its look in a room shown, and takes all that came for the overview away. */
  async land(room: Room, view: View): Promise<void> {
    if (this.#leaving) return;
    this.#leaving = true;
    const target = this.#shown.find((each) => each.room === room)?.matrix;
    if (target && !prefersStillness()) {
      const eye = new Vector3(...view.position).applyMatrix4(target);
      const look = new Vector3(...view.look_at).applyMatrix4(target);
      this.#controls.minDistance = 0;
      this.#controls.maxPolarAngle = Math.PI;
      await Promise.race([
        this.#controls.setLookAt(eye.x, eye.y, eye.z, look.x, look.y, look.z, true),
        new Promise((done) => setTimeout(done, 3 * FLIGHT_S * 1000)),
      ]);
    }
  }

  leave(): void {
    this.#controls.dispose();
    for (const { tiles } of this.#shown) tiles.seeThrough(false);
    for (const { tiles } of this.#others) {
      this.#host.stage.scene.remove(tiles.group);
      tiles.dispose();
    }
  }

  /** Moves until a place is in the picture that is out of it. */
  #bring(at: Triple): void {
    const { camera } = this.#host.stage;
    const { x, y, z } = new Vector3(...at).project(camera);
    if (z < 1 && Math.max(Math.abs(x), Math.abs(y)) < 1) return;
    void this.#controls.moveTo(...at, !prefersStillness());
    this.#host.stage.wake();
  }

  #load(room: Room, here: Room): Shown {
    const { rooms, stage } = this.#host;
    const draw = (): void => stage.draw();
    const nothing = (): void => undefined;
    const tiles = rooms.tilesOf(room, "root", {
      changed: draw,
      progress: nothing,
      root: draw,
      failed: nothing,
      partFailed: nothing,
    });
    const matrix = between(room.place, here.place);
    matrix.decompose(tiles.group.position, tiles.group.quaternion, tiles.group.scale);
    tiles.group.updateMatrixWorld(true);
    stage.scene.add(tiles.group);
    return { room, tiles, matrix };
  }

  /** Flies out until all is in the picture, on the side from which one looked. */
  #frameAll(): void {
    const { camera } = this.#host.stage;
    const box = new Box3();
    for (const { room, matrix } of this.#shown) box.union(boxOf(room).applyMatrix4(matrix));
    const centre = box.getCenter(new Vector3());
    const ahead = camera.getWorldDirection(new Vector3()).setZ(0);
    if (ahead.lengthSq() < 1e-6) ahead.set(1, 0, 0);
    ahead.normalize().multiplyScalar(Math.cos(ELEVATION)).setZ(-Math.sin(ELEVATION));
    const corners = this.#shown.flatMap(({ room, matrix }) =>
      cornersOf(boxOf(room)).map((corner) => corner.applyMatrix4(matrix).sub(centre)),
    );
    const distance = distanceFor(corners, ahead, camera);
    const eye = centre.clone().addScaledVector(ahead, -distance);
    this.#controls.maxDistance = 3 * distance;
    const start = camera.position.clone();
    const toward = start.clone().add(camera.getWorldDirection(new Vector3()));
    const { x, y, z } = centre;
    void this.#controls.setLookAt(start.x, start.y, start.z, toward.x, toward.y, toward.z, false);
    void this.#controls.setLookAt(eye.x, eye.y, eye.z, x, y, z, !prefersStillness());
  }
}

/** How far away from the middle all places are in the picture, seen in a direction. */
function distanceFor(places: readonly Vector3[], ahead: Vector3, camera: PerspectiveCamera): number {
  const right = new Vector3().crossVectors(ahead, new Vector3(0, 0, 1)).normalize();
  const up = new Vector3().crossVectors(right, ahead);
  const high = Math.tan((camera.fov * Math.PI) / 360) / MARGIN;
  const wide = high * camera.aspect;
  return Math.max(
    ...places.map(
      (at) => Math.max(Math.abs(at.dot(right)) / wide, Math.abs(at.dot(up)) / high) - at.dot(ahead),
    ),
  );
}

function cornersOf({ min, max }: Box3): Vector3[] {
  return [min.x, max.x].flatMap((x) =>
    [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new Vector3(x, y, z))),
  );
}

function boxOf(room: Room): Box3 {
  return new Box3(new Vector3(...room.bounds.min), new Vector3(...room.bounds.max));
}

function centreOf(room: Room): Vector3 {
  return boxOf(room).getCenter(new Vector3());
}
