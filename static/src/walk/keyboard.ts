/** Keys that walk and turn, told by their place on the keyboard: WASD is ZQSD in France. */

const MOVES: Readonly<Record<string, readonly [ahead: number, left: number, turn: number, up: number]>> = {
  KeyW: [1, 0, 0, 0],
  ArrowUp: [1, 0, 0, 0],
  KeyS: [-1, 0, 0, 0],
  ArrowDown: [-1, 0, 0, 0],
  KeyA: [0, 1, 0, 0],
  KeyD: [0, -1, 0, 0],
  ArrowLeft: [0, 0, 1, 0],
  ArrowRight: [0, 0, -1, 0],
  KeyQ: [0, 0, 1, 0],
  KeyE: [0, 0, -1, 0],
  PageUp: [0, 0, 0, 1],
  PageDown: [0, 0, 0, -1],
};

export interface Wish {
  /** Steps ahead and to the left, turns to the left and up: -1 to 1 each. */
  ahead: number;
  left: number;
  turn: number;
  up: number;
  fast: boolean;
}

export class Keyboard {
  readonly #down = new Set<string>();
  /** Let go since the last step: a slow machine takes none while a key is tapped. */
  readonly #up = new Set<string>();
  #fast = false;

  /** @param wake Called when a key goes down that matters. */
  constructor(target: Window, wake: () => void) {
    target.addEventListener("keydown", (event) => {
      this.#fast = event.shiftKey;
      if (!(event.code in MOVES) || event.ctrlKey || event.altKey || event.metaKey) return;
      if (keepsKeys(event.target, event.code)) return;
      event.preventDefault();
      this.#down.add(event.code);
      this.#up.delete(event.code);
      wake();
    });
    target.addEventListener("keyup", (event) => {
      this.#fast = event.shiftKey;
      if (this.#down.has(event.code)) this.#up.add(event.code);
    });
    target.addEventListener("blur", () => this.#down.clear());
  }

  /** What the keys ask for that are down, or were since the last time. */
  wish(): Wish {
    const wish: Wish = { ahead: 0, left: 0, turn: 0, up: 0, fast: this.#fast };
    for (const code of this.#down) {
      const [ahead, left, turn, up] = MOVES[code] ?? [0, 0, 0, 0];
      wish.ahead += ahead;
      wish.left += left;
      wish.turn += turn;
      wish.up += up;
    }
    for (const code of this.#up) this.#down.delete(code);
    this.#up.clear();
    return wish;
  }
}

/**
 * Whether the element uses such keys itself: a choice of languages, a text that scrolls. Letters
 * walk only where nothing that could be meant by them has the focus.
 */
function keepsKeys(target: EventTarget | null, code: string): boolean {
  if (!(target instanceof Element)) return false;
  if (target.closest("select, input, textarea, audio, .panel, .plan-sheet, .guide-caption")) return true;
  return code.startsWith("Key") && target !== document.body && !(target instanceof HTMLCanvasElement);
}
