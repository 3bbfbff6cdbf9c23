/** What decodes Draco geometry: the files beside the viewer, by what each is. */

export const WRAPPER = "draco_wasm_wrapper.js";
export const BINARY = "draco_decoder.wasm";
export const DECODER = [WRAPPER, BINARY] as const;
