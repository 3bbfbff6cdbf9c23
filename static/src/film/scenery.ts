/** Scenery: one room at a time, its tiles awaited until all are there that a picture shows. */

import { Vector3, type LoadingManager } from "three";
import { pause } from "../dom.ts";
import type { Files } from "../files.ts";
import type { Levels } from "../scene/levels.ts";
import { RoomTiles } from "../scene/room-tiles.ts";
import type { Stage } from "../scene/stage.ts";
import type { Room } from "../tour.ts";
import type { Collider } from "../walk/collider.ts";
import { poseOf, type Pose } from "./shots.ts";

/** A picture of 4K may show most of a room as fine as it is. */
const CACHE_BYTES = 3 * 2 ** 30;
const TURN_MS = 4;

export class Scenery {
  readonly #files: Files;
  readonly #stage: Stage;
  readonly #decoder: LoadingManager;
  readonly #levels: Levels;
  #room: Room | null = null;
  #tiles: RoomTiles | null = null;
  #collider: Collider | null = null;
  #lost = false;

  constructor(files: Files, stage: Stage, decoder: LoadingManager, levels: Levels) {
    this.#files = files;
    this.#stage = stage;
    this.#decoder = decoder;
    this.#levels = levels;
  }

  /** Walls of a room, which takes the place of the one before. Throws where it does not come. */
  async enter(room: Room): Promise<Collider> {
    if (this.#room !== room) this.#change(room);
    while (this.#collider === null) {
      this.#update();
      await pause(TURN_MS);
    }
    return this.#collider;
  }

  /** Aims the camera and waits for all tiles that it sees. Throws where one does not come. */
  async see(pose: Pose): Promise<void> {
    this.#aim(pose);
    this.#tiles?.moved();
    this.#update();
    while (this.#tiles?.busy || this.#tiles?.lacks) {
      await pause(TURN_MS);
      this.#update();
    }
  }

  #aim({ eye, ahead }: Pose): void {
    const { camera } = this.#stage;
    camera.position.copy(eye);
    camera.lookAt(new Vector3().addVectors(eye, ahead));
    camera.updateMatrixWorld();
  }

  #update(): void {
    if (this.#lost) {
      throw new Error(`room \`${this.#room?.id}\`: expected all of its tiles, found one missing`);
    }
    this.#tiles?.update(this.#stage.camera, this.#stage.size);
  }

  #change(room: Room): void {
    if (this.#tiles) {
      this.#stage.scene.remove(this.#tiles.group);
      this.#tiles.dispose();
    }
    const lose = (): void => {
      this.#lost = true;
    };
    this.#room = room;
    this.#collider = null;
    this.#aim(poseOf(room.entry)); // what is not in sight does not come
    this.#tiles = new RoomTiles(
      {
        files: this.#files,
        tileset: room.tileset,
        decoder: this.#decoder,
        camera: this.#stage.camera,
        levels: this.#levels,
        cacheBytes: CACHE_BYTES,
      },
      {
        changed: () => undefined,
        progress: () => undefined,
        root: (collider) => {
          this.#collider = collider();
        },
        failed: lose,
        partFailed: lose,
      },
    );
    this.#stage.scene.add(this.#tiles.group);
  }
}
