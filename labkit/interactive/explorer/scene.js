// A pair of scans as Python packs it, ready to be matched.

import { prepareTarget } from "./icp.js";
import { transform } from "./se2.js";

export function unpacked({ source, target, normals, answer }) {
  return {
    source: floats(source),
    target: prepareTarget(floats(target), floats(normals)),
    known: answer && transform(...answer),
  };
}

export function floats(text) {
  return new Float64Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}
