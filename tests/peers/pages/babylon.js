// One model in Babylon's viewer, seen from where the address says; bundled by the bench.
import { DracoDecoder } from "@babylonjs/core/Meshes/Compression/dracoDecoder.js";
import { MeshoptCompression } from "@babylonjs/core/Meshes/Compression/meshoptCompression.js";
import { CreateViewerForCanvas } from "@babylonjs/viewer";
import { asked } from "./asked.js";

DracoDecoder.DefaultConfiguration = {
  wasmUrl: "/libs/draco/draco_wasm_wrapper.js",
  wasmBinaryUrl: "/libs/draco/draco_decoder.wasm",
};
MeshoptCompression.Configuration.decoder.url = "/libs/meshopt_decoder.cjs";

const { model, eye, target, upright } = asked();
const mirrored = ([x, y, z]) => [-x, y, z]; // as it turns what it loads
const [to, from] = [mirrored(target), mirrored(eye)];
const [x, y, z] = from.map((value, axis) => value - to[axis]);
const reach = Math.hypot(x, y, z);
let camera;
const viewer = await CreateViewerForCanvas(document.querySelector("canvas"), {
  cameraOrbit: [Math.atan2(z, x), Math.acos(y / reach), reach],
  cameraTarget: to,
  environmentLighting: "none",
  onInitialized: (details) => (camera = details.camera),
});
const look = () => {
  camera.fov = (upright * Math.PI) / 180;
  camera.minZ = 0.02;
  camera.lowerRadiusLimit = null;
  camera.target.set(...to);
  camera.setPosition(camera.position.set(...from));
};
look();
await viewer.loadModel(model);
look();
window.done = true;
