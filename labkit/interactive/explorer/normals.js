// Normals of a sweep's surface; mirrors labkit/normals.py, for points in beam order.

import {
  GAP_FLOOR,
  GAP_RATIO,
  HALF_BEAMS,
  HALF_WIDTH,
  LINEARITY,
  MIN_ON_LINE,
  MAX_NEIGHBOR_DISTANCE,
} from "./constants.js";

// Unit normals towards the scanner; NaN where the points about one lie on no line.
export function normalsAlongSweep(points) {
  const count = points.length / 2;
  const normals = new Float64Array(2 * count);
  const { start, stop } = windowsAlongSweep(points);
  for (let i = 0; i < count; i++)
    [normals[2 * i], normals[2 * i + 1]] = normalOf(points, i, start[i], stop[i]);
  return normals;
}

// The normal at a point of the line through those from `start` to `stop`.
export function normalOf(points, i, start, stop) {
  const count = stop - start;
  const [px, py] = [points[2 * i], points[2 * i + 1]];
  let x = 0;
  let y = 0;
  let xx = 0;
  let xy = 0;
  let yy = 0;
  for (let k = start; k < stop; k++) {
    const dx = points[2 * k] - px;
    const dy = points[2 * k + 1] - py;
    x += dx / count;
    y += dy / count;
    xx += (dx * dx) / count;
    xy += (dx * dy) / count;
    yy += (dy * dy) / count;
  }
  xx -= x * x;
  xy -= x * y;
  yy -= y * y;
  const half = 0.5 * (xx - yy);
  const root = Math.sqrt(half * half + xy * xy);
  const smallEigenvalue = 0.5 * (xx + yy) - root;
  const largeEigenvalue = 0.5 * (xx + yy) + root; // eigenvalues of M
  if (count < MIN_ON_LINE || !(smallEigenvalue < LINEARITY ** 2 * largeEigenvalue))
    return [NaN, NaN];
  const [u, v] = half > 0 ? [-xy, root + half] : [half - root, xy]; // eigenvector to the least
  const length = Math.sqrt(u * u + v * v) * (u * px + v * py > 0 ? -1 : 1); // to the scanner
  return [u / length, v / length];
}

// The first point of each point's window, and the one after its last: it ends with the surface.
export function windowsAlongSweep(points) {
  const count = points.length / 2;
  const step = new Float64Array(count + 1);
  for (let i = 1; i < count; i++)
    step[i] = Math.hypot(points[2 * i] - points[2 * i - 2], points[2 * i + 1] - points[2 * i - 1]);
  step[0] = step[1];
  step[count] = step[count - 1];
  const start = new Int32Array(count);
  const stop = new Int32Array(count);
  for (let i = 0, edge = 0; i < count; i++) {
    if (leavesSurface(step, i)) edge = i;
    const beams = Math.floor(
      Math.max(
        HALF_WIDTH / Math.max(Math.min(step[i], step[i + 1]), 1e-3 * HALF_WIDTH),
        HALF_BEAMS,
      ),
    );
    start[i] = Math.max(i - beams, edge);
    stop[i] = i + beams + 1;
  }
  for (let i = count - 1, edge = count; i >= 0; i--) {
    stop[i] = Math.min(stop[i], edge);
    if (leavesSurface(step, i)) edge = i;
  }
  return { start, stop };
}

// Whether the step before point i is a gap between two surfaces.
export function leavesSurface(step, i) {
  return (
    i > 0 &&
    step[i] >
      Math.min(
        Math.max(GAP_RATIO * Math.min(step[i - 1], step[i + 1]), GAP_FLOOR),
        MAX_NEIGHBOR_DISTANCE,
      )
  );
}
