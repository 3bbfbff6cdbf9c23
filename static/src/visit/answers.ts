/** What a visit answers to tests and the curious. */

import { Vector3 } from "three";
import type { Diagnostics } from "../diagnostics.ts";
import type { Rooms } from "../rooms.ts";
import type { Stage } from "../scene/stage.ts";
import type { Tools } from "../tools.ts";
import type { Triple } from "../tour.ts";
import type { Immersion } from "./immersion.ts";
import type { Walking } from "./walking.ts";
import type { Ways } from "./ways.ts";

export interface Asked {
  readonly stage: Stage;
  readonly rooms: Rooms;
  readonly walking: Walking;
  readonly ways: Ways;
  readonly tools: Tools;
  readonly immersion: Immersion;
}

export function answersOf({ stage, rooms, walking, ways, tools, immersion }: Asked): Diagnostics {
  return {
    get room() {
      return rooms.room.id;
    },
    get ready() {
      return rooms.isOpen;
    },
    get idle() {
      const busy = (rooms.tiles?.busy ?? true) || (ways.overview?.busy ?? false);
      return rooms.isOpen && stage.still && !busy;
    },
    get see() {
      return ways.way;
    },
    get position() {
      return triple(stage.camera.getWorldPosition(new Vector3()));
    },
    get look() {
      return triple(stage.camera.getWorldDirection(new Vector3()));
    },
    get stats() {
      const { render, memory } = stage.renderer.info;
      return {
        tiles: rooms.tiles?.tileCount ?? 0,
        triangles: render.triangles,
        drawCalls: render.calls,
        bytes: rooms.tiles?.bytes ?? 0,
        frames: render.frame,
        textures: memory.textures,
        geometries: memory.geometries,
      };
    },
    get isImmersed() {
      return immersion.isOn;
    },
    get metres() {
      return tools.metres;
    },
    teleport(position, lookAt) {
      walking.visitor.hover(new Vector3(...position), new Vector3(...lookAt));
      walking.aim();
    },
  };
}

function triple({ x, y, z }: Vector3): Triple {
  return [x, y, z];
}
