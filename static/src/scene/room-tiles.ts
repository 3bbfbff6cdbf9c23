/**
 * One room's tileset on screen: streamed by what the view asks for, its root tile first.
 *
 * Two levels below the root follow, then the finest: the level that is left out would be drawn over
 * at once. Only tiles in view are asked for; what lies around is fetched when the view is sharp
 * (`lookAround`), or when one turns to it. Until it is there the root stands in, since the renderer
 * itself would show a hole.
 */

import { TilesRenderer } from "3d-tiles-renderer/three";
import type { Tile } from "3d-tiles-renderer/core";
import {
  DoubleSide,
  FrontSide,
  Mesh,
  MeshBasicMaterial,
  NoColorSpace,
  Raycaster,
  type Group,
  type Intersection,
  type LoadingManager,
  type Object3D,
  type PerspectiveCamera,
  type Vector2,
} from "three";
import type { Files } from "../files.ts";
import { Collider } from "../walk/collider.ts";
import { Backoff } from "./backoff.ts";
import { onNextFrame } from "./frames.ts";
import { boxOf, checkerboard, type Levels } from "./levels.ts";
import { tinted } from "./tint.ts";

/** Screen error in pixels above which a tile is replaced by its children. */
const ERROR_TARGET_PX = 2;
const MIB = 2 ** 20;
export const CACHE_BYTES = 256 * MIB;
export const CACHE_BYTES_PHONE = 128 * MIB;
const ANISOTROPY = 8;
/** Levels of the tree that are gone into, one after the other. */
const ROOT_ALONE = 1;
const TWO_BELOW = 3;

export interface RoomEvents {
  /** Something changed that wants an update of the tiles or a new picture. */
  changed(): void;
  /** Bytes of the root tile that have come, 0 to 1. */
  progress(part: number): void;
  /**
   * The root tile is there: the room can be shown, and walked.
   *
   * @param collider Makes what one walks against, which takes a while: only for whoever walks.
   */
  root(collider: () => Collider): void;
  /** Nothing of the room can be shown. */
  failed(): void;
  /** A tile below the root stays missing however often it is asked for; its parent stands in. */
  partFailed(): void;
}

export interface RoomTilesOptions {
  readonly files: Files;
  /** Its path. */
  readonly tileset: string;
  readonly decoder: LoadingManager;
  readonly camera: PerspectiveCamera;
  readonly levels: Levels;
  /** How many bytes of tiles are held, at most. */
  readonly cacheBytes: number;
}

export class RoomTiles {
  readonly #tiles: TilesRenderer;
  readonly #files: Files;
  readonly #events: RoomEvents;
  readonly #pruned = new Map<Tile, Tile[]>();
  readonly #failed = new Set<Tile>();
  readonly #backoff = new Backoff(() => this.retry());
  #stale = true;
  #rootShown = false;
  #seenThrough = false;
  #bytes = 0;

  constructor(
    { files, tileset, decoder, camera, levels, cacheBytes }: RoomTilesOptions,
    events: RoomEvents,
  ) {
    this.#files = files;
    this.#events = events;
    const tiles = new TilesRenderer(files.locate(tileset).href);
    this.#tiles = tiles;
    tiles.manager = decoder;
    tiles.errorTarget = levels === "view" ? ERROR_TARGET_PX : 0;
    tiles.maxDepth = ROOT_ALONE;
    tiles.loadAncestors = false;
    tiles.loadSiblings = false;
    tiles.lruCache.maxBytesSize = cacheBytes;
    tiles.lruCache.minBytesSize = tiles.lruCache.maxBytesSize * 0.75;
    tiles.setCamera(camera);
    tiles.registerPlugin({ fetchData: (url: string, init: RequestInit) => this.#fetch(url, init) });
    if (levels !== "view") tiles.registerPlugin(new ForcedLevels(levels));
    tiles.addEventListener("needs-update", () => this.#touch());
    tiles.addEventListener("tile-visibility-change", () => events.changed());
    tiles.addEventListener("load-model", ({ scene, tile }) => this.#loaded(scene, tile));
    tiles.addEventListener("load-error", ({ tile }) => {
      if (tile) this.#failed.add(tile);
      if (tile?.parent) this.#standIn(tile.parent);
      else events.failed();
      this.#touch();
    });
  }

  get group(): Group {
    return this.#tiles.group;
  }

  /** Whether tiles are still to come for the present view. */
  get busy(): boolean {
    return this.#stale || !this.#rootShown || this.#coming > 0;
  }

  /** Whether tiles did not come that are asked for again later. */
  get lacks(): boolean {
    return this.#failed.size > 0;
  }

  /** Tiles on screen. */
  get tileCount(): number {
    return this.#tiles.visibleTiles.size;
  }

  /** Bytes fetched for this room. */
  get bytes(): number {
    return this.#bytes;
  }

  /** Brings the tiles up to the camera, whose matrices must be current. */
  update(camera: PerspectiveCamera, size: Vector2): void {
    this.#stale = false;
    this.#tiles.setResolution(camera, size);
    this.#tiles.update();
    for (const queue of this.#tiles.downloadQueue.originQueues.values()) {
      queue.tryRunJobs(); // or they would wait for the next picture
    }
    const { root } = this.#tiles;
    if (!root || !this.#rootShown) return;
    this.#tiles.lruCache.markUsed(root); // it stands in at any time
    const { maxDepth } = this.#tiles;
    if (maxDepth === ROOT_ALONE) {
      if (root.traversal.visible) this.#goDeeper(TWO_BELOW);
    } else if (lacksPart(root)) {
      this.#tiles.loadSiblings = true;
      this.#fallBack();
    } else if (maxDepth === TWO_BELOW && this.#coming === 0) {
      this.#goDeeper(Infinity);
    }
  }

  /** Fetches what lies beside the view, so that it can be turned; false where it was told before. */
  lookAround(): boolean {
    if (this.#tiles.loadSiblings) return false;
    this.#tiles.loadSiblings = true;
    this.#touch();
    return true;
  }

  /** To be called when the camera moved. */
  moved(): void {
    this.#stale = true;
  }

  /** Asks again for what failed; the renderer would not, as long as it holds it for cached. */
  retry(): void {
    for (const [tile, children] of this.#pruned) tile.children = children;
    this.#pruned.clear();
    this.#tiles.resetFailedTiles();
    for (const tile of this.#failed) this.#tiles.lruCache.remove(tile);
    this.#failed.clear();
    this.#touch();
  }

  /** Shows a room from outside: one looks through the backs of its walls. */
  seeThrough(through: boolean): void {
    this.#seenThrough = through;
    this.#tiles.forEachLoadedModel((scene) => this.#setSides(scene));
    this.#events.changed();
  }

  /** The first of the surfaces on screen that a ray from the camera meets. */
  pick(caster: Raycaster): Intersection | null {
    return caster.intersectObject(this.#tiles.group, true)[0] ?? null;
  }

  dispose(): void {
    this.#backoff.stop();
    this.#tiles.dispose();
  }

  /** How many tiles are asked for and not there. */
  get #coming(): number {
    const { queued, downloading, parsing } = statsOf(this.#tiles);
    return queued + downloading + parsing;
  }

  #goDeeper(levels: number): void {
    this.#tiles.maxDepth = levels;
    this.#touch();
  }

  /** Shows the root alone, which then stays until all that the view asks for is there. */
  #fallBack(): void {
    this.#tiles.maxDepth = ROOT_ALONE;
    this.#tiles.update();
    this.#touch();
  }

  /**
   * Shows a tile one of whose children is missing: the renderer would rather show a hole. Those of
   * its children that are on screen leave it before they are taken out of the tree.
   */
  #standIn(tile: Tile): void {
    if (!tile.traversal.visible) this.#fallBack();
    if (tile.children?.length) this.#pruned.set(tile, tile.children);
    tile.children = [];
    if (!this.#backoff.later()) this.#events.partFailed();
  }

  #touch(): void {
    this.#stale = true;
    this.#events.changed();
  }

  #loaded(scene: Object3D, tile: Tile): void {
    scene.traverse((object) => {
      object.name = tile.content?.uri ?? "";
    });
    for (const material of materialsOf(scene)) {
      if (material.map) {
        material.map.anisotropy = ANISOTROPY;
        material.map.colorSpace = NoColorSpace; // see `Stage`
      }
      tinted(material);
    }
    this.#setSides(scene);
    if (tile.parent === null && !this.#rootShown) {
      this.#rootShown = true;
      // It is drawn while its walls are made ready.
      onNextFrame(() => setTimeout(() => this.#events.root(() => colliderOf(scene))));
    }
    this.#touch();
  }

  #setSides(scene: Object3D): void {
    for (const material of materialsOf(scene)) {
      material.side = this.#seenThrough ? FrontSide : DoubleSide;
    }
  }

  /** Counts what comes, and tells how much of the root tile is there. */
  async #fetch(url: string, init: RequestInit): Promise<ArrayBuffer | object> {
    const response = await this.#files.fetch(url, init);
    if (!response.ok) throw new Error(`${url}: the server answered ${response.status}`);
    if (this.#rootShown || !response.body || !url.endsWith(".glb")) {
      const data = await response.arrayBuffer();
      this.#bytes += data.byteLength;
      return url.endsWith(".json") ? (JSON.parse(new TextDecoder().decode(data)) as object) : data;
    }
    const expected = Number(response.headers.get("content-length") ?? 0);
    const parts: Uint8Array[] = [];
    let got = 0;
    const reader = response.body.getReader();
    for (let next = await reader.read(); !next.done; next = await reader.read()) {
      parts.push(next.value);
      got += next.value.byteLength;
      this.#events.progress(expected > 0 ? Math.min(1, got / expected) : 0.5);
    }
    this.#bytes += got;
    setTimeout(() => this.#tiles.parseQueue.tryRunJobs()); // or it would wait for a picture
    return joined(Uint8Array, parts).buffer;
  }
}

/** Cuts the tree off where a test wants it to end; what is left is refined to its leaves. */
class ForcedLevels {
  readonly #levels: Levels;

  constructor(levels: Levels) {
    this.#levels = levels;
  }

  preprocessNode(tile: Tile, _folder: string, parent: Tile | null): void {
    if (this.#levels === "root" && parent === null) tile.children = [];
    if (this.#levels === "checkerboard" && parent !== null && parent.parent === null) {
      const siblings = parent.children ?? [];
      const coarse = checkerboard(siblings.map(boxOf));
      if (coarse[siblings.indexOf(tile)]) tile.children = [];
    }
  }
}

function materialsOf(scene: Object3D): MeshBasicMaterial[] {
  const found: MeshBasicMaterial[] = [];
  scene.traverse((object) => {
    if (object instanceof Mesh && object.material instanceof MeshBasicMaterial) {
      found.push(object.material);
    }
  });
  return found;
}

/** All triangles below `scene`, in the frame of the room. */
function colliderOf(scene: Object3D): Collider {
  scene.updateMatrixWorld(true);
  const corners: Float32Array[] = [];
  const faces: Uint32Array[] = [];
  let count = 0;
  scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const { geometry, matrixWorld } = object as Mesh;
    const position = geometry.getAttribute("position").clone().applyMatrix4(matrixWorld);
    const index = geometry.index?.array ?? Array.from({ length: position.count }, (_, i) => i);
    const start = count;
    faces.push(Uint32Array.from(index, (corner) => start + corner));
    corners.push(new Float32Array(position.array));
    count += position.count;
  });
  return new Collider(joined(Float32Array, corners), joined(Uint32Array, faces));
}

interface Numbers extends ArrayLike<number> {
  readonly buffer: ArrayBuffer;
  set(from: ArrayLike<number>, at: number): void;
}

/** Arrays one after the other in one. */
function joined<Kind extends Numbers>(
  kind: new (length: number) => Kind,
  parts: readonly ArrayLike<number>[],
): Kind {
  const whole = new kind(parts.reduce((length, part) => length + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

/** Whether a part of a tile's place that is in view is shown by no tile, be it this or one below. */
function lacksPart(tile: Tile): boolean {
  if (!isPrepared(tile)) return true;
  const { used, inFrustum, visible } = tile.traversal;
  if (!inFrustum || visible) return false;
  const children = tile.children ?? [];
  return !used || children.length === 0 || children.some(lacksPart);
}

/** Of large rooms not all tiles are prepared in one update, which the types leave out. */
function isPrepared(tile: Partial<Tile>): boolean {
  return tile.traversal !== undefined;
}

/** The renderer's counts, which its types leave out. */
function statsOf(tiles: TilesRenderer): { queued: number; downloading: number; parsing: number } {
  return (tiles as unknown as { stats: { queued: number; downloading: number; parsing: number } })
    .stats;
}
