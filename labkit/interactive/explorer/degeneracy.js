// Which motions a set of pairs cannot see; mirrors labkit/degeneracy.py.

import { MIN_INFORMATION, MAX_TURN_OF_SHIFT } from "./constants.js";
import { lineInformation } from "./line_alignment.js";

// What the kept pairs that lie on a surface say about each direction of the motion; null for
// nothing.
export function observability(pairs, target) {
  const normals = Float64Array.from(
    pairs.source,
    (_, i) => target.normals[2 * pairs.targetIndex[i >> 1] + (i & 1)],
  );
  const weights = pairs.weights.map((w, i) => (Number.isFinite(normals[2 * i]) ? w : 0));
  return lineInformation(
    pairs.source,
    normals.map((coordinate) => coordinate || 0),
    weights,
  );
}

// The free motions in words, the freest first.
export function freeMotions({ values, vectors, center, length }) {
  const free = [0, 1, 2]
    .filter((k) => values[k] < MIN_INFORMATION)
    .sort((i, j) => values[i] - values[j]);
  return free.map((k) => {
    const [x, y, turn] = vectors.map((row) => row[k]);
    const reach = length / turn;
    const scale = Math.sign(Math.abs(x) > MAX_TURN_OF_SHIFT ? x : y) / Math.hypot(x, y);
    if (Math.abs(turn) < MAX_TURN_OF_SHIFT) {
      return `shift along (${metres(scale * x)}, ${metres(scale * y)})`;
    }
    return `turn about (${metres(center[0] - reach * y)}, ${metres(center[1] + reach * x)})`;
  });
}

const metres = (value) => value.toFixed(2).replace(/^-0\.00$/, "0.00");
