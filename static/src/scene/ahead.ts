/** Answers that are asked for before whoever needs them runs; each is handed over once. */

const coming = new Map<string, Promise<Response | null>>();

/** Asks for a file; the caller gets an answer of its own. */
export async function askAhead(url: URL): Promise<Response> {
  const answer = fetch(url, { priority: "low" });
  const own = answer.then((response) => response.clone());
  coming.set(url.href, own.catch(() => null));
  return answer;
}

/** What was asked for ahead, if it was and came; else null. */
export async function handedOver(url: string): Promise<Response | null> {
  const answer = coming.get(url) ?? null;
  coming.delete(url);
  return answer;
}
