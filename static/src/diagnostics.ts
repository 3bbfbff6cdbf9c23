/**
 * What tests and the curious can ask of the viewer; documented here and nowhere in its interface.
 *
 * In the address: `?levels=root|leaves|checkerboard` forces levels of detail, where a
 * checkerboard shows every other tile below the root whole and its neighbours by their leaves;
 * `?background=ff00ff` colours the void, so that a hole shows. `window.tourgen` answers as below.
 */

import type { Way } from "./address.ts";
import { levelsOf, type Levels } from "./scene/levels.ts";
import type { Triple } from "./tour.ts";

export interface Diagnostics {
  /** Id of the room one is in, or on the way to. */
  readonly room: string;
  /** The room's root tile is on screen. */
  readonly ready: boolean;
  /** Nothing moves, nothing is being fetched, and the last picture shows all that the view asks for. */
  readonly idle: boolean;
  /** Which way one sees. */
  readonly see: Way;
  /** The eye, metres, room frame, z up. */
  readonly position: Triple;
  /** Where it looks, unit length, room frame. */
  readonly look: Triple;
  readonly stats: {
    readonly tiles: number;
    readonly triangles: number;
    readonly drawCalls: number;
    /** Fetched for this room's tiles. */
    readonly bytes: number;
    /** Pictures drawn since the page was opened. */
    readonly frames: number;
    /** On the graphics card. */
    readonly textures: number;
    readonly geometries: number;
  };
  /** A headset shows the room. */
  readonly isImmersed: boolean;
  /** What was measured last, or null. */
  readonly metres: number | null;
  /** Puts the eye at a place, through walls, floor or not. */
  teleport(position: Triple, lookAt: Triple): void;
}

/** What a film knows before its first picture; seconds count from its start. */
export interface FilmPlan {
  readonly seconds: number;
  readonly language: string;
  /** From here on nothing is written over the first room. */
  readonly clear: number;
  /** Number of each stop, from 0, and when the film stays there. */
  readonly stays: readonly { readonly stop: number; readonly from: number; readonly to: number }[];
  /** When another room takes the place of one. */
  readonly cuts: readonly number[];
  /** Captions by language. */
  readonly cues: Readonly<
    Record<string, readonly { readonly from: number; readonly to: number; readonly text: string }[]>
  >;
  /** Stops of a room with no way between them. */
  readonly blocked: readonly { readonly from: number; readonly to: number; readonly room: string }[];
}

/** What `tourgen film` asks of the viewer, by `?film` in the address; see film/film.ts. */
export interface FilmControls {
  plan(): Promise<FilmPlan>;
  /**
   * Draws the picture of a second, whole, over all of the window but its two last lines: when they
   * have the colour that is returned (0xRRGGBB), it stands on the screen.
   */
  frame(second: number): Promise<number>;
}

declare global {
  interface Window {
    tourgen?: Diagnostics | { readonly film: FilmControls };
  }
}

const SKY = "#cdd8e0";

export function readQuery(search: string): { levels: Levels; background: string } {
  const query = new URLSearchParams(search);
  const background = query.get("background") ?? "";
  return {
    levels: levelsOf(query.get("levels")),
    background: /^[0-9a-f]{6}$/i.test(background) ? `#${background}` : SKY,
  };
}
