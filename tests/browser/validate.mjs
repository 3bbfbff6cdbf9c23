// Prints the Khronos validator's issues for each GLB named on standard input, as JSON.
import { readFile } from "node:fs/promises";
import { createInterface } from "node:readline";
import { createRequire } from "node:module";

const validator = createRequire(new URL("../package.json", import.meta.url))("gltf-validator");

for await (const file of createInterface({ input: process.stdin })) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: file,
    maxIssues: 0,
    writeTimestamp: false,
  });
  console.log(JSON.stringify({ file, ...issues }));
}
