/** What pages and the service worker tell each other. */

/** From a page: take over from the version before. */
export interface Asked {
  readonly takeOver: true;
}

/** From the worker: so much of a version has come, 0 to 1. */
export interface Told {
  readonly taken: number;
}
