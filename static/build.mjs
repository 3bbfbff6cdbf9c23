// Bundles the viewer into dist/: scripts, style and Draco decoder under names that carry their
// digest, so that they may be cached for ever, and manifest.json that says what they are called.
// What a visit may never use lies in scripts of its own. single.js is the same viewer in one script,
// for pages that carry all they show.
import { createHash } from "node:crypto";
import { copyFile, mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const dist = join(here, "dist");
const decoder = join(here, "node_modules/three/examples/jsm/libs/draco/gltf");
const decoderFiles = ["draco_wasm_wrapper.js", "draco_decoder.wasm"];

const digest = createHash("sha256");
for (const name of decoderFiles) digest.update(await readFile(join(decoder, name)));
const draco = `draco-${digest.digest("hex").slice(0, 8)}/`;

await rm(dist, { recursive: true, force: true });
await mkdir(join(dist, draco), { recursive: true });
for (const name of decoderFiles) await copyFile(join(decoder, name), join(dist, draco, name));
await copyFile(join(here, "src/icon.svg"), join(dist, "icon.svg"));

const common = {
  outdir: dist,
  bundle: true,
  minify: true,
  format: "esm",
  charset: "utf8", // or every letter of an Arabic word would be six
  target: ["es2022"],
  define: { DRACO_FOLDER: JSON.stringify(draco) },
  legalComments: "none",
  absWorkingDir: here,
  logLevel: "warning",
};

const { metafile } = await build({
  ...common,
  entryPoints: {
    viewer: join(here, "src/main.ts"),
    style: join(here, "src/page/style.css"),
    kiosk: join(here, "src/kiosk/kiosk.css"),
  },
  entryNames: "[name]-[hash]",
  chunkNames: "[name]-[hash]",
  splitting: true,
  metafile: true,
});
await build({ ...common, entryPoints: { single: join(here, "src/single.ts") } });
await requireInlinable(join(dist, "single.js"));

/** Refuses what the parser of a page would end, or change so that its digest differs. */
async function requireInlinable(script) {
  const found = /<\/script|<!--|[\r\0]/i.exec(await readFile(script, "utf8"));
  if (found) throw new Error(`${script}: found ${JSON.stringify(found[0])}, which no page can hold`);
}

// The service worker keeps its name and its place: at the site's root, told the site's files.
await build({
  ...common,
  entryPoints: { sw: join(here, "src/along/worker.ts") },
  format: "iife",
  define: { "process.env.NODE_ENV": JSON.stringify("production") },
});

/** The published name of the output that was made from `source`. */
function nameOf(source) {
  for (const [path, output] of Object.entries(metafile.outputs)) {
    if (output.entryPoint === source) return basename(path);
  }
  throw new Error(`${source}: expected an output, found none`);
}

/** What runs before a script can, it included, so that all of it can be asked for at once. */
function neededBy(source) {
  const found = new Set();
  const follow = (path) => {
    if (found.has(path)) return;
    found.add(path);
    for (const each of metafile.outputs[path].imports) {
      if (each.kind === "import-statement") follow(each.path);
    }
  };
  for (const [path, output] of Object.entries(metafile.outputs)) {
    if (output.entryPoint === source) follow(path);
  }
  return [...found].map((path) => basename(path));
}

const manifest = {
  script: nameOf("src/main.ts"),
  first: neededBy("src/main.ts"),
  soon: neededBy("src/visit.ts"),
  style: nameOf("src/page/style.css"),
  kiosk: nameOf("src/kiosk/kiosk.css"),
  draco,
  icon: "icon.svg",
};
await writeFile(join(dist, "manifest.json"), `${JSON.stringify(manifest, null, 2)}\n`);
