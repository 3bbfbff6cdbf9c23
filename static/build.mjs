// Bundles the viewer into dist/: script, style and Draco decoder under names that carry their
// digest, so that they may be cached for ever, and manifest.json that says what they are called.
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

const { metafile } = await build({
  entryPoints: { viewer: join(here, "src/main.ts"), style: join(here, "src/style.css") },
  outdir: dist,
  entryNames: "[name]-[hash]",
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  define: { DRACO_FOLDER: JSON.stringify(draco) },
  legalComments: "none",
  metafile: true,
  absWorkingDir: here,
  logLevel: "warning",
});

/** The published name of the output that was made from `source`. */
function nameOf(source) {
  for (const [path, output] of Object.entries(metafile.outputs)) {
    if (output.entryPoint === source) return basename(path);
  }
  throw new Error(`${source}: expected an output, found none`);
}

const manifest = {
  script: nameOf("src/main.ts"),
  style: nameOf("src/style.css"),
  draco,
  icon: "icon.svg",
};
await writeFile(join(dist, "manifest.json"), `${JSON.stringify(manifest, null, 2)}\n`);
