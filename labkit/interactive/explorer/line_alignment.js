// One Gauss-Newton step of the point-to-line metric; mirrors labkit/line_alignment.py.

import { centroid, turnAbout } from "./alignment.js";
import {
  BUT_FOR_ROUNDING,
  MIN_INFORMATION,
  STEADY_INFORMATION,
  STEADY_SHARE,
} from "./constants.js";

// The step that moves points p onto the lines through q with normals n, a share of it point to
// point; null where it is undetermined. In a direction that the lines leave free it does not move.
export function alignToLines(p, q, n, w, share) {
  const { center: c, length } = centerAndLength(p, w);
  const A = [
    [0, 0, 0],
    [0, 0, 0],
    [0, 0, 0],
  ];
  const g = [0, 0, 0];
  if (!(length > 0)) return null;
  let total = 0;
  for (let i = 0; i < w.length; i++) {
    if (!(w[i] > 0)) continue;
    const ax = (p[2 * i] - c[0]) / length;
    const ay = (p[2 * i + 1] - c[1]) / length;
    const nx = n[2 * i];
    const ny = n[2 * i + 1];
    const dx = p[2 * i] - q[2 * i];
    const dy = p[2 * i + 1] - q[2 * i + 1];
    const J = [nx, ny, ny * ax - nx * ay];
    const e = nx * dx + ny * dy; // (6.1)
    const pull = [dx, dy, ax * dy - ay * dx]; // of the point-to-point metric
    for (let j = 0; j < 3; j++) {
      g[j] += w[i] * ((1 - share) * J[j] * e + share * pull[j]);
      for (let k = 0; k < 3; k++) A[j][k] += w[i] * (1 - share) * J[j] * J[k];
    }
    total += w[i];
  }
  for (let k = 0; k < 3; k++) A[k][k] += share * total;
  const [dx, dy, turn] = solveConstrained(A, g, total * leastInformation(share));
  return turnAbout(c, turn / length, dx, dy);
}

// Solve A x = −g, in the directions alone whose eigenvalue reaches the minimum.
export function solveConstrained(A, g, minimum) {
  const { values, vectors } = eigh(A);
  const x = [0, 0, 0];
  values.forEach((value, k) => {
    if (value < minimum) return;
    const v = vectors.map((row) => row[k]);
    const along = (v[0] * g[0] + v[1] * g[1] + v[2] * g[2]) / value;
    for (let j = 0; j < 3; j++) x[j] -= v[j] * along;
  });
  return x;
}

// The eigenvalue, per unit of weight, from which on a direction is solved for.
export function leastInformation(share) {
  const minInformation = share < STEADY_SHARE ? MIN_INFORMATION : STEADY_INFORMATION;
  return ((1 - share) * minInformation + share) * BUT_FOR_ROUNDING;
}

// What surface points say about a small motion, by eigenvalues and vectors; null for nothing.
export function lineInformation(p, n, w) {
  const { center, length } = centerAndLength(p, w);
  const A = [
    [0, 0, 0],
    [0, 0, 0],
    [0, 0, 0],
  ];
  if (!(length > 0)) return null;
  const total = w.reduce((sum, weight) => sum + weight, 0);
  for (let i = 0; i < w.length; i++) {
    const ax = (p[2 * i] - center[0]) / length;
    const ay = (p[2 * i + 1] - center[1]) / length;
    const J = [n[2 * i], n[2 * i + 1], n[2 * i + 1] * ax - n[2 * i] * ay]; // (6.1)
    for (let j = 0; j < 3; j++) for (let k = 0; k < 3; k++) A[j][k] += (w[i] * J[j] * J[k]) / total;
  }
  return { ...eigh(A), center, length };
}

// The weighted centroid and the root mean square distance from it: 0 where points coincide or have
// no weight.
export function centerAndLength(points, w) {
  const center = centroid(points, w);
  let squares = 0;
  let total = 0;
  let maxCoordinate = 0;
  for (let i = 0; i < w.length; i++) {
    if (!(w[i] > 0)) continue;
    squares += w[i] * ((points[2 * i] - center[0]) ** 2 + (points[2 * i + 1] - center[1]) ** 2);
    total += w[i];
    maxCoordinate = Math.max(maxCoordinate, Math.abs(points[2 * i]), Math.abs(points[2 * i + 1]));
  }
  const length = total > 0 ? Math.sqrt(squares / total) : 0;
  return { center, length: length > 64 * Number.EPSILON * maxCoordinate ? length : 0 };
}

// Eigenvalues, and eigenvectors as columns, of a symmetric 3x3 matrix by Jacobi rotations.
function eigh(matrix) {
  const a = matrix.map((row) => [...row]);
  const vectors = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (a[p][q] === 0) continue;
      const half = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = (half < 0 ? -1 : 1) / (Math.abs(half) + Math.hypot(1, half));
      const c = 1 / Math.hypot(1, t);
      const s = t * c;
      const turn = (u, v) => [c * u - s * v, s * u + c * v];
      for (const row of [...a, ...vectors]) [row[p], row[q]] = turn(row[p], row[q]);
      for (let k = 0; k < 3; k++) [a[p][k], a[q][k]] = turn(a[p][k], a[q][k]);
      a[p][q] = a[q][p] = 0;
    }
  }
  return { values: [a[0][0], a[1][1], a[2][2]], vectors };
}
