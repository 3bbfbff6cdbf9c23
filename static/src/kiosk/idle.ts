/** How long nobody has touched anything. */

const SIGNS = ["pointerdown", "pointermove", "wheel", "keydown", "touchstart", "gamepadconnected"];

export class Idle {
  /** Of the clock that no change of date moves. */
  #since = performance.now();

  /** @param touched Told of each sign of somebody; by a pointer or not. */
  constructor(target: Window, touched: (byPointer: boolean) => void) {
    for (const sign of SIGNS) {
      const byPointer = /^(pointer|touch)/.test(sign);
      target.addEventListener(sign, () => touched(byPointer), { capture: true, passive: true });
    }
  }

  get seconds(): number {
    return (performance.now() - this.#since) / 1000;
  }

  reset(): void {
    this.#since = performance.now();
  }
}
