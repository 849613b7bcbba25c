// Pairs of points, and which of them to believe; mirrors labkit/correspondences.py.
// Residuals, gate and delta are distances in metres, never squares.

import { MIN_PAIRS } from "./constants.js";
import { stageOf, adaptDelta } from "./schedule.js";
import { apply } from "./se2.js";

// (D) Pair each source point, moved by T, with its nearest target point.
export function associate(source, target, T, { stride, onLines }) {
  const moved = apply(T, stride === 1 ? source : source.filter((_, i) => (i >> 1) % stride === 0));
  const count = moved.length / 2;
  const targetIndex = new Int32Array(count);
  const partners = new Float64Array(2 * count);
  const distances = new Float64Array(count);
  const residuals = onLines ? new Float64Array(count) : distances;
  const normals = onLines ? new Float64Array(2 * count) : null;
  for (let i = 0; i < count; i++) {
    const j = target.search.nearest(moved[2 * i], moved[2 * i + 1]);
    targetIndex[i] = j;
    partners[2 * i] = target.points[2 * j];
    partners[2 * i + 1] = target.points[2 * j + 1];
    const dx = moved[2 * i] - partners[2 * i];
    const dy = moved[2 * i + 1] - partners[2 * i + 1];
    distances[i] = Math.sqrt(dx * dx + dy * dy);
    if (!onLines) continue;
    normals[2 * i] = target.normals[2 * j];
    normals[2 * i + 1] = target.normals[2 * j + 1];
    residuals[i] = Math.abs(normals[2 * i] * dx + normals[2 * i + 1] * dy); // |n·(p − q)|
  }
  return { source: moved, target: partners, targetIndex, normals, distances, residuals, stride };
}

// (E) The same pairs, weighted: 0 beyond the gate or the overlap, else Huber's weight.
export function rejectAndWeigh(pairs, stage) {
  const { distances, residuals } = pairs;
  const { gate } = stage;
  const withinGate = distanceGate(distances, gate);
  const withinOverlap = overlap(distances, stage.overlapRatio);
  const kept = Uint8Array.from(
    residuals,
    (r, i) => withinGate[i] && withinOverlap[i] && Number.isFinite(r),
  );
  const huberDelta = adaptDelta(residuals, kept, stage);
  const pointShare =
    stage.pointShare && Math.min(1, stage.pointShare * (huberDelta / stage.huberDelta) ** 2);
  const weights = huberWeights(residuals, huberDelta).map((w, i) => (kept[i] ? w : 0));
  return { ...pairs, withinGate, withinOverlap, kept, weights, gate, huberDelta, pointShare };
}

// (A) Which pairs lie within the gate.
export function distanceGate(distances, gate) {
  return Uint8Array.from(distances, (d) => d <= gate);
}

// (B) Which pairs are among the ⌊ρN⌋ closest; of equal ones the first.
export function overlap(distances, ratio) {
  const count = overlapCount(distances.length, ratio);
  const largest = Float64Array.from(distances).sort()[count - 1];
  const kept = Uint8Array.from(distances, (d) => d < largest);
  let openCount = count - total(kept);
  for (let i = 0; openCount > 0; i++)
    if (distances[i] === largest) {
      kept[i] = 1;
      openCount--;
    }
  return kept;
}

export function overlapCount(sourcePoints, ratio) {
  return Math.min(sourcePoints, Math.max(MIN_PAIRS, Math.floor(ratio * sourcePoints)));
}

// (C) Huber's weight of each residual: 1 up to delta, delta / r beyond.
export function huberWeights(residuals, huberDelta) {
  return residuals.map((r) => (r <= huberDelta ? 1 : huberDelta / r));
}

// The truncated Huber cost J [m²]: of the ⌊ρN⌋ closest pairs, over N; (4.1).
export function cost({ distances, residuals, withinOverlap, huberDelta }, { gate }) {
  let loss = 0;
  for (let i = 0; i < distances.length; i++) {
    const usable = distances[i] <= gate && Number.isFinite(residuals[i]);
    if (withinOverlap[i])
      loss += huberLoss(usable ? residuals[i] : Math.min(distances[i], gate), huberDelta);
  }
  return loss / distances.length;
}

// Huber's loss [m²] of a residual: r² up to delta, 2 delta r − delta² beyond.
export function huberLoss(residual, huberDelta) {
  const capped = Math.min(residual, huberDelta);
  return capped * (2 * residual - capped);
}

// Boxes D and E together, at a pose near the answer, and the cost there.
export function pairsAt(source, target, T, parameters) {
  const stage = stageOf(parameters, source.length / 2, false, true);
  const pairs = rejectAndWeigh(associate(source, target, T, stage), stage);
  return { T_target_source: T, pairs, cost: cost(pairs, stage), coarse: false };
}

export function inlierCount(pairs) {
  return total(pairs.kept);
}

export const PAIR_FATES = ["gated", "trimmed", "no line", "down-weighted", "kept"];

// The fate of each pair, an index into PAIR_FATES: the first stage that rejected it.
export const fates = (pairs) =>
  pairs.distances.map((_, i) => {
    if (!pairs.withinGate[i]) return 0;
    if (!pairs.withinOverlap[i]) return 1;
    if (!pairs.kept[i]) return 2;
    return pairs.weights[i] < 1 ? 3 : 4;
  });

const total = (flags) => flags.reduce((sum, flag) => sum + flag, 0);
