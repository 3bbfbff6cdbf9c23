/** The ring on the floor that shows where a click leads. */

import { DoubleSide, Group, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";

const INNER_M = 0.13;
const OUTER_M = 0.16;
const LIFT_M = 0.015;
const FACING = new Vector3(0, 0, 1);

export class Marker {
  readonly group = new Group();

  constructor() {
    const ring = new Mesh(
      new RingGeometry(INNER_M, OUTER_M, 48),
      new MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.9, side: DoubleSide }),
    );
    const rim = new Mesh(
      new RingGeometry(INNER_M - 0.012, OUTER_M + 0.012, 48),
      new MeshBasicMaterial({ color: 0x1b1e23, transparent: true, opacity: 0.35, side: DoubleSide }),
    );
    ring.position.z = 0.004;
    this.group.add(rim, ring);
    this.group.visible = false;
  }

  /** Lays the ring on a surface. */
  show(point: Vector3, normal: Vector3): void {
    this.group.position.copy(point).addScaledVector(normal, LIFT_M);
    this.group.quaternion.setFromUnitVectors(FACING, normal);
    this.group.visible = true;
  }

  /** Returns whether there was something to hide. */
  hide(): boolean {
    const shown = this.group.visible;
    this.group.visible = false;
    return shown;
  }
}
