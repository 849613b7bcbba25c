// Which motions a set of pairs cannot see; mirrors labkit/degeneracy.py.

import { MIN_INFORMATION, lineInformation } from "./line_alignment.js";

const SHIFT = 0.1;

// Those motions in words; none where all are seen, or nothing can be said.
export function unobservable(pairs, target) {
  const normals = new Float64Array(pairs.source.length), used = [];
  pairs.targetIndex.forEach((j, i) => {
    [normals[2 * i], normals[2 * i + 1]] = target.normals.subarray(2 * j, 2 * j + 2);
    if (pairs.kept[i] && Number.isFinite(normals[2 * i])) used.push(i);
  });
  const information = lineInformation({ ...pairs, normals }, used);
  return information === null ? [] : freeMotions(information);
}

function freeMotions({ values, vectors, center, length }) {
  const free = [0, 1, 2].filter((k) => values[k] < MIN_INFORMATION).sort((i, j) => values[i] - values[j]);
  return free.map((k) => {
    const [x, y, turn] = vectors.map((row) => row[k]);
    if (Math.abs(turn) < SHIFT) {
      const scale = Math.sign(Math.abs(x) > SHIFT ? x : y) / Math.hypot(x, y);
      return `shift along (${twoDigits(scale * x)}, ${twoDigits(scale * y)})`;
    }
    const reach = length / turn;
    return `turn about (${twoDigits(center[0] - reach * y)}, ${twoDigits(center[1] + reach * x)})`;
  });
}

function twoDigits(value) {
  const text = value.toFixed(2);
  return text === "-0.00" ? "0.00" : text;
}
