// The lines through a sweep's points; mirrors labkit/normals.py.

import {
  CORE_PER_NOISE,
  FILLED,
  GAP_FLOOR,
  GAP_RATIO,
  HALF_BEAMS,
  HALF_WIDTH,
  LINEARITY,
  MAX_NEIGHBOR_DISTANCE,
  MAX_WIDTH,
  MIN_ON_LINE,
  MIN_SPACING,
  NEIGHBORS,
  SAMPLE_SIZE,
  SHRINKAGE,
  SPARSE_WIDTH_PER_NOISE,
  STEADY,
  WIDE_LINEARITY,
  WIDTH_PER_NOISE,
} from "./constants.js";

const NO_LINE = { nx: NaN, ny: NaN, offset: 0, across: 0, along: 0 };

// Unit normals towards the scanner, NaN where the points about one lie on no line; and the points,
// dense ones moved onto their lines.
export function fitLines(points) {
  const { width, linearity, dense } = lineWidth(points);
  const { start, stop } = windowsAlongSweep(points, width);
  const normals = new Float64Array(points.length);
  const onLines = Float64Array.from(points);
  for (let i = 0; i < points.length / 2; i++) {
    let line = lineOf(sumsBetween(points, i, start[i], stop[i]));
    const isCloud = dense && Math.sqrt(3) * line.along < width;
    if (isCloud) line = wideLine(points, i, width);
    const { nx, ny, offset, across, along } = line;
    const isLine = across < (isCloud ? linearity : LINEARITY) * along;
    const sign = nx * points[2 * i] + ny * points[2 * i + 1] > 0 ? -1 : 1; // to the scanner
    normals[2 * i] = isLine ? sign * nx : NaN;
    normals[2 * i + 1] = isLine ? sign * ny : NaN;
    if (isCloud && isLine) {
      onLines[2 * i] += offset * nx;
      onLines[2 * i + 1] += offset * ny;
    }
  }
  return { normals, points: onLines };
}

// The line through all points within the width of point i, or in a wider circle that they fill.
export function wideLine(points, i, width) {
  for (let radius = width; radius <= Math.max(width, MAX_NEIGHBOR_DISTANCE); radius *= 2) {
    const sums = sumsWithin(points, i, radius);
    const line = lineOf(sums);
    if (sums.count >= NEIGHBORS && line.along >= FILLED * radius) return line;
  }
  return NO_LINE;
}

// The radius of neighbourhoods in which points show their lines, their linearity, if dense.
export function lineWidth(points) {
  const sample = spreadOut(points.length / 2);
  let radius = MAX_NEIGHBOR_DISTANCE;
  let spreads = medianSpreads(points, sample, radius);
  const half = medianSpreads(points, sample, 0.5 * radius);
  const factor = half.across >= STEADY * spreads.across ? 1 / SHRINKAGE : SHRINKAGE;
  const sparse = { width: HALF_WIDTH, linearity: LINEARITY, dense: false };
  let short = null;
  while (!showsLine(spreads, radius, WIDTH_PER_NOISE)) {
    const isShort = radius <= MAX_NEIGHBOR_DISTANCE;
    if (isShort && showsLine(spreads, radius, CORE_PER_NOISE)) short = { radius, spreads };
    if (spreads.count < NEIGHBORS || factor * radius > MAX_WIDTH) break;
    radius *= factor;
    spreads = medianSpreads(points, sample, radius);
  }

  let perNoise = WIDTH_PER_NOISE;
  let linearity = WIDE_LINEARITY;
  if (!showsLine(spreads, radius, WIDTH_PER_NOISE)) {
    if (!short) return sparse;
    ({ radius, spreads } = short);
    perNoise = CORE_PER_NOISE;
    linearity = LINEARITY;
  }

  let noise, coreRadius, core;
  while (true) {
    noise = spreads.across;
    coreRadius = Math.min(CORE_PER_NOISE * noise, 0.5 * radius);
    core = medianSpreads(points, sample, coreRadius);
    if (core.count < NEIGHBORS)
      return { ...sparse, width: Math.min(HALF_WIDTH, SPARSE_WIDTH_PER_NOISE * noise) };
    spreads = medianSpreads(points, sample, SHRINKAGE * radius);
    if (!showsLine(spreads, SHRINKAGE * radius, perNoise)) break;
    radius *= SHRINKAGE;
  }
  const isSteady = core.across >= STEADY * noise || core.along < FILLED * coreRadius;
  return isSteady ? { width: radius, linearity, dense: true } : sparse;
}

// Whether neighbourhoods fill this radius along a line, and it is so many times as wide as they.
const showsLine = ({ across, along, count }, radius, perNoise) =>
  count >= NEIGHBORS && along >= FILLED * radius && perNoise * across <= radius;

// Points of a sample from the first to the last one, alike in either order.
function spreadOut(count) {
  const size = Math.min(SAMPLE_SIZE, count);
  const steps = Math.max(1, size - 1);
  const nearestRow = (i) => Math.floor((i * (count - 1) + Math.floor(steps / 2)) / steps);
  return Array.from({ length: size }, (_, i) => nearestRow(i));
}

// Medians over a sample: spreads across and along its neighbourhoods, and their points.
function medianSpreads(points, sample, radius) {
  const sums = sample.map((i) => sumsWithin(points, i, radius));
  const lines = sums.map(lineOf);
  return {
    across: median(lines.map((line) => line.across)),
    along: median(lines.map((line) => line.along)),
    count: median(sums.map(({ count }) => count)),
  };
}

const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

// Sums over the points within a radius of point i, the nearer ones with more weight.
export function sumsWithin(points, i, radius) {
  const sums = { count: 0, w: 0, x: 0, y: 0, xx: 0, xy: 0, yy: 0 };
  for (let k = 0; k < points.length / 2; k++) {
    const dx = points[2 * k] - points[2 * i];
    const dy = points[2 * k + 1] - points[2 * i + 1];
    const weight = radius * radius - (dx * dx + dy * dy);
    if (weight > 0) addPoint(sums, dx, dy, weight);
  }
  return sums;
}

export function addPoint(sums, x, y, w) {
  sums.count += 1;
  sums.w += w;
  sums.x += w * x;
  sums.y += w * y;
  sums.xx += w * x * x;
  sums.xy += w * x * y;
  sums.yy += w * y * y;
}

// The line fitted to summed points: its unit normal, how far it lies along it, and their spreads.
export function lineOf(sums) {
  if (sums.count < MIN_ON_LINE) return NO_LINE;
  const x = sums.x / sums.w;
  const y = sums.y / sums.w;
  const xx = sums.xx / sums.w - x * x; // the entries of M
  const xy = sums.xy / sums.w - x * y;
  const yy = sums.yy / sums.w - y * y;
  const half = 0.5 * (xx - yy);
  const root = Math.sqrt(half * half + xy * xy);
  const smallEigenvalue = Math.max(0, 0.5 * (xx + yy) - root);
  const largeEigenvalue = 0.5 * (xx + yy) + root;
  const [u, v] = half > 0 ? [-xy, root + half] : [half - root, xy]; // of the small eigenvalue
  const length = Math.sqrt(u * u + v * v);
  if (!(length > 0)) return NO_LINE;
  const [nx, ny] = [u / length, v / length];
  const [across, along] = [Math.sqrt(smallEigenvalue), Math.sqrt(largeEigenvalue)];
  return { nx, ny, offset: nx * x + ny * y, across, along };
}

// Sums over the points from `start` to `stop`, relative to point i.
function sumsBetween(points, i, start, stop) {
  const sums = { count: 0, w: 0, x: 0, y: 0, xx: 0, xy: 0, yy: 0 };
  for (let k = start; k < stop; k++)
    addPoint(sums, points[2 * k] - points[2 * i], points[2 * k + 1] - points[2 * i + 1], 1);
  return sums;
}

// The first point of each point's window, and the one after its last: it ends with the surface.
export function windowsAlongSweep(points, width) {
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
    const spacing = Math.max(Math.min(step[i], step[i + 1]), MIN_SPACING);
    const beams = Math.max(Math.floor(width / spacing), HALF_BEAMS);
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
