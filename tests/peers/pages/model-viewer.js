// One model in model-viewer, seen from where the address says.
import { asked } from "./asked.js";

const { model, eye, target, upright } = asked();
const [x, y, z] = eye.map((value, axis) => value - target[axis]);
const reach = Math.hypot(x, y, z);
const element = document.createElement("model-viewer");
const attributes = {
  src: model,
  "camera-target": target.map((value) => `${value}m`).join(" "),
  "camera-orbit": `${Math.atan2(x, z)}rad ${Math.acos(y / reach)}rad ${reach}m`,
  "min-camera-orbit": "-Infinity 0deg 0.01m",
  "max-camera-orbit": "Infinity 180deg 100m",
  "field-of-view": `${upright}deg`,
  "max-field-of-view": "90deg",
  "interaction-prompt": "none",
  loading: "eager",
};
for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
element.addEventListener("load", () => (window.done = true));
document.body.append(element);
