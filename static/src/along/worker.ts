/**
 * The service worker: takes the whole tour along, so that it works without a network.
 *
 * A version is taken over only when all of its files have come and are what the build wrote, to
 * the byte; until then the one before serves. The list of files stands before this script, as
 * `self.tour`: a new build changes it, and with it this script, which browsers look for.
 */

import { clientsClaim, type WorkboxPlugin } from "workbox-core";
import { addPlugins, matchPrecache, precacheAndRoute } from "workbox-precaching";
import { RangeRequestsPlugin } from "workbox-range-requests";
import { NavigationRoute, registerRoute, setCatchHandler } from "workbox-routing";
import { NetworkOnly } from "workbox-strategies";
import type { Asked, Told } from "./messages.ts";

interface File {
  readonly url: string;
  readonly revision: string;
  readonly integrity: string;
}

declare const self: ServiceWorkerGlobalScope & {
  readonly tour: { readonly bytes: number; readonly files: File[] };
};

let taken = 0;

addPlugins([
  {
    handlerDidComplete: async ({ error, event }) => {
      if (error || event.type !== "install") return; // served, of a version that is here
      taken += 1;
      await tell({ taken: taken / self.tour.files.length });
    },
  },
  new RangeRequestsPlugin() as WorkboxPlugin, // sounds are asked for by parts
]);
precacheAndRoute(self.tour.files, { ignoreURLParametersMatching: [/./], cleanURLs: false });
// A page that is not of the tour: as the host answers, and where there is none, as it would.
registerRoute(new NavigationRoute(new NetworkOnly()));
setCatchHandler(async ({ request }) => {
  const page = request.destination === "document" ? await matchPrecache("404.html") : undefined;
  return page ?? Response.error();
});
clientsClaim();

self.addEventListener("message", (event: ExtendableMessageEvent) => {
  const asked = event.data as Asked;
  if (asked.takeOver) void self.skipWaiting();
});

async function tell(told: Told): Promise<void> {
  for (const client of await self.clients.matchAll({ includeUncontrolled: true })) {
    client.postMessage(told);
  }
}
