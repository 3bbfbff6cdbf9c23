/** What every room's tiles are decoded with; made once. */

import { LoadingManager } from "three";
import { DRACOLoader } from "three/addons/loaders/DRACOLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Files } from "../files.ts";
import { BINARY, WRAPPER } from "./decoder.ts";

/** A triangle in Draco, in Base64: to decode it a worker must start. */
const TRIANGLE =
  "RFJBQ08CAgEAAAABAwEAAQIBAQAJAwAAAgABAQACAwFAAQDIAAAAAAABAAAAAAAAAAAAAAAAAAAAAACAPwE=";

/** That tiles after the first are shared out among. */
const WORKERS = 4;

const TILES = /\.glb$/;

export interface TileDecoder {
  readonly manager: LoadingManager;
  /** Resolves when its first worker is starting, which takes as long as making a visit. */
  readonly started: Promise<void>;
}

let made: TileDecoder | null = null;

/** Started by whoever asks first, for all. */
export function tileDecoder(files: Files): TileDecoder {
  return (made ??= startedDecoder(files));
}

function startedDecoder(files: Files): TileDecoder {
  const manager = new LoadingManager();
  const started = new Promise<void>((done) => {
    manager.onLoad = done; // whether it came or not: tiles tell
  });
  const draco = decodeAnew(manager, files);
  draco.parse(bytesOf(TRIANGLE), (triangle) => triangle.dispose());
  const sources = [WRAPPER, BINARY].map((path) => files.source(path));
  manager.onError = (url) => {
    // A decoder that did not come once never would: what is asked for again asks another.
    if (sources.includes(url)) decodeAnew(manager, files);
  };
  return { manager, started };
}

/** Has tiles decoded from now on by what is yet to be fetched, with the first of them. */
function decodeAnew(manager: LoadingManager, files: Files): DRACOLoader {
  const draco = new DRACOLoader(manager);
  draco.setDecoderPath({
    js: files.source(WRAPPER),
    wasm: files.source(BINARY),
  });
  draco.setWorkerLimit(1); // or the first tile would wait for another one to start
  const loader = new GLTFLoader(manager).setDRACOLoader(draco);
  const afterRoot = async (): Promise<void> => void draco.setWorkerLimit(WORKERS);
  loader.register(() => ({ name: "spread", afterRoot }));
  manager.removeHandler(TILES);
  manager.addHandler(TILES, loader);
  return draco;
}

function bytesOf(base64: string): ArrayBuffer {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}
