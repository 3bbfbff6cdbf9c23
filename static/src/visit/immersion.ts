/** Into a headset and out of it again, where one then stands. */

import type { Immersive } from "../modes/immersive.ts";
import type { Frontend } from "../page/frontend.ts";
import type { Rooms } from "../rooms.ts";
import type { Stage } from "../scene/stage.ts";
import type { Link } from "../tour.ts";
import type { Walking } from "./walking.ts";

export interface ImmersionHost {
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  readonly walking: Walking;
  /** The picture is to be the headset's alone. */
  begins(): void;
  /** Through a door. */
  pass(link: Link): void;
}

export class Immersion {
  readonly #host: ImmersionHost;
  #immersive: Immersive | null = null;

  constructor(host: ImmersionHost) {
    this.#host = host;
  }

  /** Whether a headset shows the room. */
  get isOn(): boolean {
    return this.#immersive !== null;
  }

  async begin(): Promise<void> {
    const { front, rooms, stage, walking } = this.#host;
    const { visitor } = walking;
    const script = await front.brought(import("../modes/immersive.ts"));
    const { feet } = visitor;
    if (!script || this.#immersive || !feet) return;
    this.#host.begins();
    try {
      this.#immersive = await script.Immersive.begin(
        {
          stage,
          rooms,
          text: (texts) => front.text(texts),
          step: () => rooms.tiles?.update(stage.camera, stage.size),
          pass: (link) => this.#host.pass(link),
          ended: (view) => {
            this.#immersive = null;
            walking.jump(view);
          },
        },
        feet,
        visitor.look.yaw,
      );
    } catch (error) {
      console.warn(error);
      front.notice.tellUntilClosed("noVr");
    }
  }

  /** Stands where the visitor came into a room. */
  stand(): void {
    const { feet, look } = this.#host.walking.visitor;
    if (feet) this.#immersive?.stand(feet, look.yaw);
  }
}
