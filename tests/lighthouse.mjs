// What Lighthouse finds on a page: node lighthouse.mjs URL CHROMIUM CATEGORIES [FLAG ...]
// Prints each category's score of 100, what cost some of it, and the figures behind it.
import { launch } from "chrome-launcher";
import lighthouse from "lighthouse";

const [url, chromePath, categories, ...chromeFlags] = process.argv.slice(2);
const chromium = await launch({ chromePath, chromeFlags: ["--headless=new", ...chromeFlags] });
try {
  const { lhr } = await lighthouse(url, {
    port: chromium.port,
    onlyCategories: categories.split(","),
    logLevel: "error",
  });
  if (lhr.runtimeError) throw new Error(lhr.runtimeError.message);
  const scores = {};
  const faults = [];
  for (const { id, score, auditRefs } of Object.values(lhr.categories)) {
    scores[id] = Math.round(score * 100);
    for (const { id: name, weight } of auditRefs) {
      const { score: part, title, details } = lhr.audits[name];
      if (weight === 0 || part === null || part === 1) continue;
      faults.push(`${id}: ${name}: ${title} ${JSON.stringify(details?.items ?? [])}`);
    }
  }
  const figures = {};
  for (const [name, { numericValue }] of Object.entries(lhr.audits)) {
    if (numericValue !== undefined) figures[name] = numericValue;
  }
  console.log(JSON.stringify({ scores, faults, figures }));
} finally {
  await chromium.kill();
}
