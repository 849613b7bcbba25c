// What the loop does while its steps are long; mirrors labkit/approach.py.

const LONG = 0.7;
const WIDTH = 4;
const CLOSE_GATE = 8;
const POINT_SHARE = 1 / 250;

// The delta [m] far from the answer, for the residuals of the pairs that were kept.
export function wideDelta(residuals, delta) {
  if (residuals.length === 0) return delta;
  return Math.max(delta, WIDTH * Float64Array.from(residuals).sort()[residuals.length >> 1]);
}

// The share of point-to-point where delta was widened.
export function pointShare(wide, delta) {
  return delta === Infinity ? 0 : Math.min(1, (POINT_SHARE * wide) / delta);
}

// The gate [m] near the answer.
export function closeGate(gate, delta) {
  return Math.min(gate, CLOSE_GATE * delta);
}

// Whether a step moved the source by more than LONG delta in the root mean square.
export function isLong(before, after, delta) {
  let squares = 0;
  for (let i = 0; i < before.length; i++) squares += (after[i] - before[i]) ** 2;
  return Math.sqrt(squares / (before.length / 2)) > LONG * delta;
}
