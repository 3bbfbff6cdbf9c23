/** What decodes Draco geometry: the paths of the files, below the site's folder. */

/** The decoder's folder in that of the viewer; the bundler fills it in. */
declare const DRACO_FOLDER: string;

export const WRAPPER = `viewer/${DRACO_FOLDER}draco_wasm_wrapper.js`;
export const BINARY = `viewer/${DRACO_FOLDER}draco_decoder.wasm`;
