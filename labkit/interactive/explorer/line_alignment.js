// One Gauss-Newton step of the point-to-line metric, and which motions a set of pairs cannot
// see; mirrors labkit/line_alignment.py and labkit/degeneracy.py.

import { keptRows } from "./alignment.js";

const MIN_INFORMATION = 0.02;
const STEADY_SHARE = 0.03, STEADY_INFORMATION = 0.25 * MIN_INFORMATION;
const SHIFT = 0.1;

// The step that moves the kept pairs onto their lines; null where degenerate. In a
// direction that the lines leave free it does not move at all. A share of the
// point-to-point metric, far from the answer, keeps it calm.
export function alignToLines(pairs) {
  const kept = keptRows(pairs);
  const equations = normalEquations(pairs, kept);
  if (equations === null) return null;
  const { A, g, cx, cy, length } = equations, share = pairs.pointShare;
  let minimum = share < STEADY_SHARE ? MIN_INFORMATION : STEADY_INFORMATION;
  if (share > 0) {
    const pull = pointGradient(pairs, kept, equations);
    for (let j = 0; j < 3; j++) {
      for (let k = 0; k < 3; k++) A[j][k] = (1 - share) * A[j][k] + (j === k ? share : 0);
      g[j] = (1 - share) * g[j] + share * pull[j];
    }
    minimum = (1 - share) * minimum + share;
  }
  const [dx, dy, turn] = solveConstrained(A, g, minimum);
  const c = Math.cos(turn / length), s = Math.sin(turn / length);
  return { c, s, x: cx + dx - c * cx + s * cy, y: cy + dy - s * cx - c * cy };
}

// A and g of the motion (dx, dy, length dpsi) about the centre, per unit of weight.
function normalEquations(pairs, kept) {
  const { source: p, target: q, normals, weights: w } = pairs;
  let W = 0, cx = 0, cy = 0, squares = 0;
  for (const i of kept) {
    W += w[i];
    cx += w[i] * p[2 * i];
    cy += w[i] * p[2 * i + 1];
  }
  if (!(W > 0)) return null;
  cx /= W, cy /= W;
  for (const i of kept) squares += w[i] * ((p[2 * i] - cx) ** 2 + (p[2 * i + 1] - cy) ** 2);
  const length = Math.sqrt(squares / W);
  if (length <= 64 * Number.EPSILON * Math.max(Math.abs(cx), Math.abs(cy))) return null;

  const A = [[0, 0, 0], [0, 0, 0], [0, 0, 0]], g = [0, 0, 0];
  for (const i of kept) {
    const nx = normals[2 * i], ny = normals[2 * i + 1];
    const x = p[2 * i] - cx, y = p[2 * i + 1] - cy;
    const row = [nx, ny, (ny * x - nx * y) / length]; // (5.1)
    const residual = nx * (p[2 * i] - q[2 * i]) + ny * (p[2 * i + 1] - q[2 * i + 1]);
    for (let j = 0; j < 3; j++) {
      const scaled = (w[i] / W) * row[j];
      for (let k = 0; k < 3; k++) A[j][k] += scaled * row[k];
      g[j] += scaled * residual;
    }
  }
  return { A, g, cx, cy, length, W };
}

// The gradient of the point-to-point metric in the same units, in which its A is the identity.
function pointGradient({ source: p, target: q, weights: w }, kept, { cx, cy, length, W }) {
  const pull = [0, 0, 0];
  for (const i of kept) {
    const x = p[2 * i] - cx, y = p[2 * i + 1] - cy;
    const dx = p[2 * i] - q[2 * i], dy = p[2 * i + 1] - q[2 * i + 1];
    pull[0] += w[i] * dx;
    pull[1] += w[i] * dy;
    pull[2] += (w[i] * (x * dy - y * dx)) / length;
  }
  return pull.map((each) => each / W);
}

// Eigen-structure of what some rows of the pairs say about a motion; null for nothing.
function lineInformation(pairs, rows) {
  const equations = normalEquations(pairs, rows);
  if (equations === null) return null;
  const { A, cx, cy, length } = equations;
  return { ...symmetricEigen(A), center: [cx, cy], length };
}

// Solve A x = -g, in the directions alone whose eigenvalue reaches the minimum.
function solveConstrained(A, g, minimum) {
  const { values, vectors } = symmetricEigen(A);
  const x = [0, 0, 0];
  values.forEach((value, k) => {
    if (value < minimum) return;
    const v = vectors.map((row) => row[k]);
    const along = (v[0] * g[0] + v[1] * g[1] + v[2] * g[2]) / value;
    for (let j = 0; j < 3; j++) x[j] -= v[j] * along;
  });
  return x;
}

// Eigenvalues, and eigenvectors as columns, of a symmetric 3x3 matrix by Jacobi rotations.
function symmetricEigen(matrix) {
  const a = matrix.map((row) => [...row]);
  const vectors = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (a[p][q] === 0) continue;
      const half = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = (half < 0 ? -1 : 1) / (Math.abs(half) + Math.hypot(1, half));
      const c = 1 / Math.hypot(1, t), s = t * c;
      const turn = (u, v) => [c * u - s * v, s * u + c * v];
      for (const row of [...a, ...vectors]) [row[p], row[q]] = turn(row[p], row[q]);
      for (let k = 0; k < 3; k++) [a[p][k], a[q][k]] = turn(a[p][k], a[q][k]);
      a[p][q] = a[q][p] = 0;
    }
  }
  return { values: [a[0][0], a[1][1], a[2][2]], vectors };
}

// ---- what the pairs leave open

// The motions that a set of pairs cannot see, in words; none where all are seen, or nothing can be said.
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
