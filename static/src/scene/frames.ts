/**
 * Frames: those of the window, or of a headset while it shows the room. A headset that stands alone
 * halts the window's meanwhile, and tiles that waited for these would never come.
 */

import { Scheduler } from "3d-tiles-renderer/core";

/** Goes by a headset's frames from now on; by the window's again where there is none. */
export function goBy(session: XRSession | null): void {
  Scheduler.setXRSession(session as XRSession); // its types leave out that none is allowed
}

/** Does something with the next frame. */
export function onNextFrame(act: () => void): void {
  Scheduler.requestAnimationFrame(act);
}
