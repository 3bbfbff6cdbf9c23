/** Asks again for what failed: soon, then ever later, then no more. */

const FIRST_MS = 1000;
const GROWTH = 2;
const TRIES = 5;

export class Backoff {
  readonly #again: () => void;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #tries = 0;

  constructor(again: () => void) {
    this.#again = again;
  }

  /** Asks again later, once for all that fails until then. Returns false where that is in vain. */
  later(): boolean {
    if (this.#timer !== undefined) return true;
    if (this.#tries >= TRIES) return false;
    this.#timer = setTimeout(
      () => {
        this.#timer = undefined;
        this.#again();
      },
      FIRST_MS * GROWTH ** this.#tries++,
    );
    return true;
  }

  stop(): void {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    this.#tries = TRIES;
  }
}
