/** Tints what was inferred: surfaces that no measurement stands behind, as the tiles mark them. */

import type { MeshBasicMaterial } from "three";

/** As the tiles' `_INFERRED` arrives: in small letters. */
const ATTRIBUTE = "_inferred";
const COLOR = "vec3(0.98, 0.68, 0.38)";
const STRENGTH = 0.62;

const strength = { value: 0 };

/** Has a material follow `setTint`. */
export function tinted(material: MeshBasicMaterial): void {
  material.onBeforeCompile = (shader) => {
    shader.uniforms["tint"] = strength;
    shader.vertexShader = shader.vertexShader
      .replace("void main() {", `attribute float ${ATTRIBUTE};\nvarying float vInferred;\nvoid main() {`)
      .replace("#include <begin_vertex>", `#include <begin_vertex>\nvInferred = ${ATTRIBUTE};`);
    shader.fragmentShader = shader.fragmentShader
      .replace("void main() {", "uniform float tint;\nvarying float vInferred;\nvoid main() {")
      .replace(
        "#include <opaque_fragment>",
        `#include <opaque_fragment>\n` +
          `gl_FragColor.rgb = mix(gl_FragColor.rgb, ${COLOR}, tint * clamp(vInferred, 0.0, 1.0));`,
      );
  };
  material.customProgramCacheKey = () => "tinted";
}

/** Tints all rooms, or none. */
export function setTint(on: boolean): void {
  strength.value = on ? STRENGTH : 0;
}
