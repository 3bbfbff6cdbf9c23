/** No way out: what would leave the page, open a window or a menu, or spoil what others see. */

/** Keys that do something in the tour; with no modifier but Shift. */
const KEYS =
  /^(Arrow(Up|Down|Left|Right)|Page(Up|Down)|Home|End|Enter|Escape|Tab|Shift| |[a-zA-Z0-9])$/;
const REFUSED = [
  "contextmenu",
  "dragstart",
  "dragover",
  "drop",
  "gesturestart",
  "gesturechange",
  "selectstart",
  "auxclick",
  "copy",
  "cut",
  "paste",
  "beforeprint",
];

/** @param leave Told of the address of a link that would leave the tour. */
export function lock(page: Window, leave: (address: string) => void): void {
  const refuse = (event: Event): void => event.preventDefault();
  for (const kind of REFUSED) {
    page.addEventListener(kind, refuse, { capture: true, passive: false });
  }
  page.addEventListener(
    "wheel",
    (event) => {
      if (event.ctrlKey || event.metaKey) event.preventDefault(); // zooms the page
    },
    { capture: true, passive: false },
  );
  page.addEventListener(
    "touchmove",
    (event) => {
      if (event.touches.length > 1) event.preventDefault();
    },
    { capture: true, passive: false },
  );
  for (const kind of ["keydown", "keyup", "keypress"] as const) {
    page.addEventListener(
      kind,
      (event) => {
        if (!isRefused(event)) return;
        event.preventDefault();
        // That a key was let go is always heard, or its walk would have no end.
        if (kind !== "keyup") event.stopPropagation();
      },
      { capture: true },
    );
  }
  page.addEventListener(
    "click",
    (event) => {
      const link = event.target instanceof Element ? event.target.closest("a[href]") : null;
      if (!(link instanceof HTMLAnchorElement)) return;
      event.preventDefault();
      if (link.origin === page.location.origin) return; // a room: the tour's own list opens it
      event.stopPropagation();
      leave(link.getAttribute("href") ?? link.href);
    },
    { capture: true },
  );
  page.open = () => null;
}

type Pressed = Pick<KeyboardEvent, "key" | "ctrlKey" | "altKey" | "metaKey" | "shiftKey">;

/** Whether a key does something in the browser, and nothing in the tour. */
export function isRefused(event: Pressed): boolean {
  const modified = event.ctrlKey || event.altKey || event.metaKey;
  const tasks = event.shiftKey && event.key === "Escape"; // Chromium lists its own
  return modified || tasks || !KEYS.test(event.key);
}
