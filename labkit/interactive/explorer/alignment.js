// Alignment for fixed correspondences; mirrors labkit/alignment.py.

import { transform } from "./se2.js";

const RELATIVE_RESOLUTION = 1e-10;

// The transform that best maps the kept source points onto theirs; null where degenerate.
export function align(pairs) {
  const kept = keptRows(pairs);
  const { source: p, target: q, weights: w } = pairs;
  let W = 0, px = 0, py = 0, qx = 0, qy = 0;
  for (const i of kept) {
    W += w[i];
    px += w[i] * p[2 * i];
    py += w[i] * p[2 * i + 1];
    qx += w[i] * q[2 * i];
    qy += w[i] * q[2 * i + 1];
  }
  if (!(W > 0)) return null;
  px /= W, py /= W, qx /= W, qy /= W;
  const spreads = [weightedSpread(p, w, kept, px, py, W), weightedSpread(q, w, kept, qx, qy, W)];
  if (spreads.includes(null)) return null;

  let a = 0, b = 0;
  for (const i of kept) {
    const x = p[2 * i] - px, y = p[2 * i + 1] - py; // (2.2)
    const u = q[2 * i] - qx, v = q[2 * i + 1] - qy;
    a += w[i] * (x * u + y * v); // (2.5)
    b += w[i] * (x * v - y * u); // (2.6)
  }
  if (Math.hypot(a, b) <= RELATIVE_RESOLUTION * W * spreads[0] * spreads[1]) return null;
  const { c, s } = transform(0, 0, Math.atan2(b, a)); // (2.7)
  return { c, s, x: qx - (c * px - s * py), y: qy - (s * px + c * py) }; // (2.3)
}

// Weighted root mean square distance from the centroid; null where the points coincide.
function weightedSpread(points, w, kept, x, y, W) {
  let squares = 0, largest = 0, largestCentered = 0;
  for (const i of kept) {
    const dx = points[2 * i] - x, dy = points[2 * i + 1] - y;
    squares += w[i] * (dx * dx + dy * dy);
    largest = Math.max(largest, Math.abs(points[2 * i]), Math.abs(points[2 * i + 1]));
    largestCentered = Math.max(largestCentered, Math.abs(dx), Math.abs(dy));
  }
  const spread = Math.sqrt(squares / W);
  const rounding = 64 * Number.EPSILON * largest;
  return spread <= Math.max(rounding, RELATIVE_RESOLUTION * largestCentered) ? null : spread;
}

// Numbers of the kept pairs.
export function keptRows(pairs) {
  const rows = [];
  for (let i = 0; i < pairs.kept.length; i++) if (pairs.kept[i]) rows.push(i);
  return rows;
}
