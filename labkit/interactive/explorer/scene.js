// A pair of scans as Python packs it, ready to be matched.

import { NearestNeighbors } from "./neighbors.js";
import { transform } from "./se2.js";

export function unpacked({ source, target, normals, answer }) {
  return {
    source: floats(source),
    target: prepareTarget(floats(target), floats(normals)),
    known: answer && transform(...answer),
  };
}

// A target prepared once and matched against as often as one likes; its normals are NaN where a
// point lies on no line.
export function prepareTarget(points, normals) {
  return { points, normals, search: new NearestNeighbors(points) };
}

export function floats(text) {
  return new Float64Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}
