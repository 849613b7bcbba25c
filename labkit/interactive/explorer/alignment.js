// Alignment for fixed correspondences; mirrors labkit/alignment.py.

import { RELATIVE_RESOLUTION } from "./constants.js";

// The transform that best maps points p onto q under weights w; null where it is undetermined.
export function align(p, q, w) {
  const [px, py] = centroid(p, w);
  const [qx, qy] = centroid(q, w); // (2.2)
  let a = 0;
  let b = 0;
  let W = 0;
  for (let i = 0; i < w.length; i++) {
    if (!(w[i] > 0)) continue;
    const x = p[2 * i] - px;
    const y = p[2 * i + 1] - py;
    const u = q[2 * i] - qx;
    const v = q[2 * i + 1] - qy;
    a += w[i] * (x * u + y * v); // (2.5)
    b += w[i] * (x * v - y * u); // (2.6)
    W += w[i];
  }
  const spreads = [spread(p, w, px, py), spread(q, w, qx, qy)];
  if (spreads.includes(0) || Math.hypot(a, b) <= RELATIVE_RESOLUTION * W * spreads[0] * spreads[1])
    return null;
  return turnAbout([px, py], Math.atan2(b, a), qx - px, qy - py); // (2.7), (2.3)
}

// Weighted mean of points; (0, 0) where none has weight.
export function centroid(points, weights) {
  let x = 0;
  let y = 0;
  let total = 0;
  for (let i = 0; i < weights.length; i++) {
    x += weights[i] * points[2 * i];
    y += weights[i] * points[2 * i + 1];
    total += weights[i];
  }
  return total > 0 ? [x / total, y / total] : [0, 0];
}

// The motion that turns by theta about a place and then moves by (dx, dy).
export function turnAbout([x, y], theta, dx, dy) {
  const c = Math.cos(theta);
  const s = Math.sin(theta);
  return { c, s, x: x + dx - (c * x - s * y), y: y + dy - (s * x + c * y) };
}

// Weighted root mean square distance from the centroid; 0 where the points coincide, or none has
// weight.
function spread(points, w, x, y) {
  let squares = 0;
  let total = 0;
  let maxCoordinate = 0;
  let arm = 0;
  for (let i = 0; i < w.length; i++) {
    if (!(w[i] > 0)) continue;
    const dx = points[2 * i] - x;
    const dy = points[2 * i + 1] - y;
    squares += w[i] * (dx * dx + dy * dy);
    total += w[i];
    maxCoordinate = Math.max(maxCoordinate, Math.abs(points[2 * i]), Math.abs(points[2 * i + 1]));
    arm = Math.max(arm, Math.abs(dx), Math.abs(dy));
  }
  const length = Math.sqrt(squares / total);
  return length > Math.max(64 * Number.EPSILON * maxCoordinate, RELATIVE_RESOLUTION * arm)
    ? length
    : 0;
}
