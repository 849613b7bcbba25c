// What the loop does while its steps are long; mirrors labkit/approach.py.

const LONG = 0.5;
const WIDTH = 5;
const CLOSE_GATE = 8;
const POINT_SHARE = 1 / 4000;
const FEW = 120;

// The delta [m] far from the answer, for the residuals of the pairs that were kept.
export function wideDelta(residuals, delta) {
  if (residuals.length === 0) return delta;
  return Math.max(delta, WIDTH * Float64Array.from(residuals).sort()[residuals.length >> 1]);
}

// The share of point-to-point where delta was widened.
export function pointShare(wide, delta) {
  return delta === Infinity ? 0 : Math.min(1, POINT_SHARE * (wide / delta) ** 2);
}

// The gate [m] near the answer.
export function closeGate(gate, delta) {
  return Math.min(gate, CLOSE_GATE * delta);
}

// Of how many among `count` points one is looked at from afar.
export function thinning(count) {
  return Math.max(1, Math.floor(count / FEW));
}

// How far a step moved the source [m], root mean square.
export function motionOf(before, after) {
  let squares = 0;
  for (let i = 0; i < before.length; i++) squares += (after[i] - before[i]) ** 2;
  return Math.sqrt(squares / (before.length / 2));
}

// Whether the next motion will exceed LONG delta, if it shrinks as this one did.
export function isFar(motion, motionBefore, delta) {
  const shrinks = motion < motionBefore ? motion / motionBefore : 1;
  return shrinks * motion > LONG * delta;
}
