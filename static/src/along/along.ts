/** Taking the tour along: registers the service worker, and knows whether a new version waits. */

import type { Tour } from "../tour.ts";
import type { Asked, Told } from "./messages.ts";

const WORKER = "sw.js";
const MB = 1e6;
/** Larger tours are taken along only by who asks for it. */
const UNASKED_BYTES = 64 * MB;
/** Who stays so long is on a visit, and may come back. */
const VISIT_MS = 20_000;

interface Connection {
  readonly saveData?: boolean;
  readonly type?: string;
}

/** About how many bytes a tour has: those of its rooms. */
export function bytesOf(tour: Tour): number {
  return tour.rooms.reduce((sum, { made }) => sum + made.bytes, 0);
}

/** Whether this browser, at this address, can take a tour along. */
export function canTakeAlong(): boolean {
  return window.isSecureContext && "serviceWorker" in navigator;
}

/**
 * Takes the tour along.
 *
 * @param progress Told how much has come, 0 to 1.
 * @throws Error Not all of it came, or there was no room for it.
 */
export async function takeAlong(site: URL, progress?: (part: number) => void): Promise<void> {
  const heard = ({ data }: MessageEvent<Told>): void => progress?.(data.taken);
  navigator.serviceWorker.addEventListener("message", heard);
  try {
    const address = new URL(WORKER, site);
    const registration = await navigator.serviceWorker.register(address, { scope: site.href });
    const worker = registration.installing;
    if (worker) await installed(worker);
  } finally {
    navigator.serviceWorker.removeEventListener("message", heard);
  }
}

/** The same without being asked: after a while, where that costs a visitor nothing. */
export function takeAlongInTime(site: URL, tour: Tour): void {
  const { connection } = navigator as Navigator & { readonly connection?: Connection };
  const costs = connection?.saveData === true || connection?.type === "cellular";
  const isGuest = window.top !== window; // in a frame of somebody else's page
  if (!canTakeAlong() || costs || isGuest || bytesOf(tour) > UNASKED_BYTES) return;
  setTimeout(() => void takeAlong(site).catch(() => undefined), VISIT_MS);
}

/** Looks for a new version. Returns whether one waits, whole. */
export async function hasNews(site: URL): Promise<boolean> {
  const registration = await navigator.serviceWorker.getRegistration(site);
  try {
    await registration?.update();
  } catch {
    // There is no network, or no server: what is here stays.
  }
  return Boolean(registration?.waiting);
}

/** Has the version that waits take over; the page is to be loaded again when this resolves. */
export async function takeOver(site: URL): Promise<void> {
  const registration = await navigator.serviceWorker.getRegistration(site);
  const { waiting } = registration ?? {};
  if (!waiting) return;
  const changed = new Promise((done) => {
    navigator.serviceWorker.addEventListener("controllerchange", done, { once: true });
  });
  const asked: Asked = { takeOver: true };
  waiting.postMessage(asked);
  await changed;
}

function installed(worker: ServiceWorker): Promise<void> {
  return new Promise((done, failed) => {
    const look = (): void => {
      // One that waits for the version before to go has all files, too.
      if (worker.state === "installed" || worker.state === "activated") done();
      if (worker.state === "redundant") failed(new Error("the tour did not come whole"));
    };
    worker.addEventListener("statechange", look);
    look();
  });
}
