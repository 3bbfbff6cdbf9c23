/** Measures: from one point of a surface to another, metres. */

import {
  BufferGeometry,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  Vector3,
  type Vector2,
  type PerspectiveCamera,
} from "three";
import { button, element, icon, ICONS } from "../dom.ts";
import type { Words } from "../words.ts";

const COLOR = 0xe9c46a;
/** A dot's radius, of its distance from the eye. */
const DOT = 0.006;

export class Measure {
  readonly group = new Group();
  readonly element = element("div", { class: "measure" });
  readonly #label = element("output", { class: "measure-label", hidden: true });
  readonly #cross = element("div", { class: "crosshair", "aria-hidden": "true" });
  readonly #hint = element("p", { class: "tool-hint", role: "status" });
  readonly #dots: readonly [Mesh, Mesh];
  readonly #line: Line<BufferGeometry, LineBasicMaterial>;
  readonly #close: HTMLButtonElement;
  #words: Words;
  #from: Vector3 | null = null;
  #to: Vector3 | null = null;

  /** @param close The visitor is done. */
  constructor(words: Words, close: () => void) {
    this.#words = words;
    this.#close = button("round", close);
    this.#close.append(icon(ICONS.close));
    const over = { color: COLOR, depthTest: false, transparent: true };
    const dot = (): Mesh => new Mesh(new SphereGeometry(1, 16, 12), new MeshBasicMaterial(over));
    this.#dots = [dot(), dot()];
    this.#line = new Line(new BufferGeometry(), new LineBasicMaterial(over));
    for (const each of [...this.#dots, this.#line]) {
      each.renderOrder = 10;
      each.visible = false;
      each.frustumCulled = false;
      this.group.add(each);
    }
    const told = element("div", { class: "tool-bar" }, this.#hint, this.#close);
    this.element.append(this.#label, this.#cross, told);
    this.say(words);
  }

  say(words: Words): void {
    this.#words = words;
    this.#close.setAttribute("aria-label", words.close);
    this.#hint.textContent = this.#told();
  }

  /** Takes a point of a surface: the first, the second, or the first of another measure. */
  pick(point: Vector3): void {
    if (!this.#from || this.#to) {
      this.#from = point.clone();
      this.#to = null;
    } else {
      this.#to = point.clone();
    }
    this.#hint.textContent = this.#told();
  }

  /** Metres between the points, if there are two. */
  get metres(): number | null {
    return this.#from && this.#to ? this.#from.distanceTo(this.#to) : null;
  }

  /** Brings dots, line and label up to the camera. */
  place(camera: PerspectiveCamera, size: Vector2): void {
    const ends = [this.#from, this.#to];
    this.#dots.forEach((dot, i) => {
      const end = ends[i];
      dot.visible = Boolean(end);
      if (end) dot.position.copy(end);
      if (end) dot.scale.setScalar(DOT * camera.position.distanceTo(end));
    });
    this.#line.visible = this.metres !== null;
    this.#label.hidden = this.metres === null;
    if (!this.#from || !this.#to) return;
    this.#line.geometry.setFromPoints([this.#from, this.#to]);
    const middle = this.#from.clone().add(this.#to).multiplyScalar(0.5);
    const seen = middle.project(camera);
    this.#label.hidden = seen.z > 1;
    const x = ((seen.x + 1) / 2) * size.x;
    const y = ((1 - seen.y) / 2) * size.y;
    this.#label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    this.#label.textContent = this.#length();
  }

  dispose(): void {
    for (const each of [...this.#dots, this.#line]) {
      each.geometry.dispose();
      (each.material as MeshBasicMaterial).dispose();
    }
  }

  #length(): string {
    const form = new Intl.NumberFormat(document.documentElement.lang, {
      style: "unit",
      unit: "meter",
      minimumFractionDigits: 2,
      maximumFractionDigits: 2,
    });
    return form.format(this.metres ?? 0);
  }

  #told(): string {
    const { metres } = this;
    if (metres !== null) return this.#words.measured.replace("{}", this.#length());
    return this.#from ? this.#words.measureTo : this.#words.measureFrom;
  }
}
