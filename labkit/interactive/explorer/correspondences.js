// The stages that judge pairs, and what they leave; mirrors labkit/correspondences.py.
// Residuals, gate and delta are distances in metres, never squares.

export const MIN_PAIRS = 3;

// (A) Which pairs lie within the gate.
export function distanceGate(distances, gate) {
  return distances.map((d) => (d <= gate ? 1 : 0));
}

// (B) Which pairs are among the floor(ratio N) closest; of equal ones the first.
export function overlap(distances, ratio) {
  const count = overlapCount(distances.length, ratio);
  const largest = Float64Array.from(distances).sort()[count - 1];
  const kept = distances.map((d) => (d <= largest ? 1 : 0));
  let surplus = total(kept) - count;
  for (let i = kept.length - 1; surplus > 0; i--) {
    if (distances[i] === largest) {
      kept[i] = 0;
      surplus--;
    }
  }
  return kept;
}

export function overlapCount(sourcePoints, ratio) {
  return Math.min(sourcePoints, Math.max(MIN_PAIRS, Math.floor(ratio * sourcePoints)));
}

// (C) Huber's weight of a residual: 1 up to delta, delta / r beyond.
export function huberWeight(residual, delta) {
  return residual <= delta ? 1 : delta / residual;
}

// Huber's loss [m²]: r² up to delta, 2 delta r - delta² beyond.
export function huberLoss(residual, delta) {
  const capped = Math.min(residual, delta);
  return capped * (2 * residual - capped);
}

export function inlierCount(pairs) {
  return total(pairs.kept);
}

// Root mean square distance [m] of the kept pairs; NaN where none was kept.
export function inlierRmse(pairs) {
  let squares = 0;
  for (let i = 0; i < pairs.kept.length; i++)
    if (pairs.kept[i]) squares += pairs.distances[i] ** 2;
  return Math.sqrt(squares / inlierCount(pairs));
}

// The truncated Huber cost J [m²]: of the ⌊ρN⌋ closest pairs, over N; (4.1).
export function cost(pairs) {
  const { distances, residuals, withinGate, withinOverlap, gate, huberDelta } = pairs;
  let loss = 0;
  for (let i = 0; i < distances.length; i++) {
    if (!withinOverlap[i]) continue;
    const usable = withinGate[i] && Number.isFinite(residuals[i]);
    loss += huberLoss(usable ? residuals[i] : Math.min(distances[i], gate), huberDelta);
  }
  return loss / distances.length;
}

export const FATES = ["gated", "trimmed", "no line", "down-weighted", "kept"];

// The fate of each pair, an index into FATES: the first stage that rejected it.
export function fates(pairs) {
  return pairs.distances.map((_, i) => {
    if (!pairs.withinGate[i]) return 0;
    if (!pairs.withinOverlap[i]) return 1;
    if (!pairs.kept[i]) return 2;
    return pairs.weights[i] < 1 ? 3 : 4;
  });
}

function total(flags) {
  return flags.reduce((sum, flag) => sum + flag, 0);
}
