/** Rooms and their addresses: `rooms/ID/index.html` below the site's folder, whatever its path. */

const ROOM_PATH = /^rooms\/([^/]+)\/(?:index\.html)?$/;

/** The address of a room's page; what the present address asks for (`?...`) goes along. */
export function roomAddress(site: URL, id: string, search = ""): string {
  const url = new URL(`rooms/${encodeURIComponent(id)}/index.html`, site);
  url.search = search;
  return url.href;
}

/** The room that an address names, or null where it is the tour's own page. */
export function roomAt(site: URL, address: string): string | null {
  const path = new URL(address).pathname;
  if (!path.startsWith(site.pathname)) return null;
  const match = ROOM_PATH.exec(path.slice(site.pathname.length));
  return match?.[1] === undefined ? null : decodeURIComponent(match[1]);
}
