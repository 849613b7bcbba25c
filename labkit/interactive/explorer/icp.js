// The robust ICP loop, its stages in the flow chart's order; mirrors labkit/icp.py
// and, for what the loop does while its steps are long, labkit/approach.py.
//
// The tests hold it to labkit: the same poses to 1e-9, the same inliers, iterations and
// terminations. Parameters carry the names of labkit's IcpParameters; null turns a gate or
// a delta off.

import { align, keptRows } from "./alignment.js";
import { MIN_PAIRS, cost, distanceGate, huberWeight, inlierCount, overlap } from "./correspondences.js";
import { alignToLines } from "./line_alignment.js";
import { NearestNeighbors } from "./neighbors.js";
import { apply, compose, toXYTheta, transform } from "./se2.js";

const LONG = 0.5;
const WIDTH = 5;
const CLOSE_GATE = 8;
const POINT_SHARE = 1 / 4000;
const FEW = 120;

// How a run ended: the names of labkit's Termination, with its messages.
export const TERMINATIONS = {
  CONVERGED_POSE: "converged: the last step was below both pose tolerances",
  CONVERGED_COST: "converged: the cost stopped changing",
  BUDGET_SPENT: "not converged: the iteration budget is spent",
  TOO_FEW_CORRESPONDENCES:
    "failed: fewer than 3 correspondences are left; widen the gate or improve the guess",
  DEGENERATE: "failed: the correspondences leave the motion undetermined",
};

export function failed(termination) {
  return TERMINATIONS[termination].startsWith("failed");
}

// A target prepared once and matched against as often as one likes. Its normals, NaN where
// a point lies on no line, come from labkit.
export function prepareTarget(points, normals) {
  return { points, normals, search: new NearestNeighbors(points) };
}

// Estimate the transform that maps the newer scan onto the older one.
export function icp(source, target, T_init, parameters) {
  let T = T_init, far = parameters.approach ?? false, motion = 0;
  let pairs = associate(source, target, T, parameters, far); // D, E
  const history = [record(T, T, pairs, far)];
  let termination = checkPairs(pairs);
  while (termination === null) {
    const dT = minimise(pairs, parameters); // F
    if (dT === null) {
      termination = "DEGENERATE";
      break;
    }
    const T_before = T;
    T = compose(dT, T); // G: the update composes on the left
    if (far) {
      const motionBefore = motion;
      motion = motionOf(apply(T_before, source), apply(T, source));
      far = isFar(motion, motionBefore, parameters.huber_delta ?? Infinity);
    }
    pairs = associate(source, target, T, parameters, far); // D, E
    history.push(record(T, T_before, pairs, far));
    termination = checkConvergence(history, parameters); // H
    if (termination !== "CONVERGED_POSE") termination = checkPairs(pairs) ?? termination;
  }
  return { T_target_source: failed(termination) ? null : T, termination, history }; // I
}

// The pairs at a guess, from which no step is taken.
export function pairsOnly(source, target, T, parameters) {
  const pairs = associate(source, target, T, parameters);
  return { T_target_source: T, termination: null, history: [record(T, T, pairs, false)] };
}

// Match, reject and weight at the pose T, far from the answer or near it.
export function associate(source, target, T, parameters, far = false) {
  const every = far ? thinning(source.length / 2) : 1;
  const moved = apply(T, every === 1 ? source : source.filter((_, i) => (i >> 1) % every === 0));
  const count = moved.length / 2;
  const index = new Int32Array(count);
  const nearest = new Float64Array(2 * count);
  const distances = new Float64Array(count);
  const toLine = parameters.metric === "point_to_line";
  const normals = toLine ? new Float64Array(2 * count) : null;
  const residuals = toLine ? new Float64Array(count) : distances;
  for (let i = 0; i < count; i++) {
    const j = target.search.nearest(moved[2 * i], moved[2 * i + 1]);
    index[i] = j;
    nearest[2 * i] = target.points[2 * j];
    nearest[2 * i + 1] = target.points[2 * j + 1];
    const dx = moved[2 * i] - nearest[2 * i], dy = moved[2 * i + 1] - nearest[2 * i + 1];
    distances[i] = Math.sqrt(dx * dx + dy * dy);
    if (toLine) {
      normals[2 * i] = target.normals[2 * j];
      normals[2 * i + 1] = target.normals[2 * j + 1];
      residuals[i] = Math.abs(normals[2 * i] * dx + normals[2 * i + 1] * dy);
    }
  }

  const narrow = parameters.huber_delta ?? Infinity;
  let gate = parameters.max_correspondence_distance ?? Infinity, huberDelta = narrow, share = 0;
  if (parameters.approach && !far) gate = closeGate(gate, narrow);
  const withinGate = distanceGate(distances, gate);
  const withinOverlap = overlap(distances, parameters.overlap_ratio);
  const kept = Uint8Array.from(residuals, (r, i) => withinGate[i] && withinOverlap[i] && Number.isFinite(r));
  if (far) {
    huberDelta = wideDelta(residuals.filter((_, i) => kept[i]), narrow);
    share = pointShare(huberDelta, narrow);
  }
  const weights = residuals.map((r, i) => (kept[i] ? huberWeight(r, huberDelta) : 0));
  return {
    every, source: moved, target: nearest, targetIndex: index, normals, distances, residuals,
    withinGate, withinOverlap, kept, weights, gate, huberDelta, pointShare: share,
  };
}

// The step dT that best moves the kept pairs together under the metric.
export function minimise(pairs, parameters) {
  const dT = pairs.normals === null ? align(pairs) : alignToLines(pairs);
  const fraction = parameters.step_fraction ?? 1;
  return dT === null || fraction === 1 ? dT : shorten(dT, pairs, fraction);
}

// The same motion, seen from the kept points' centroid, but less far.
function shorten(dT, pairs, fraction) {
  const kept = keptRows(pairs);
  const mean = [0, 1].map((k) => kept.reduce((sum, i) => sum + pairs.source[2 * i + k], 0) / kept.length);
  const back = transform(mean[0], mean[1], 0);
  const toCenter = transform(-mean[0], -mean[1], 0);
  const motion = toXYTheta(compose(compose(toCenter, dT), back)).map((part) => fraction * part);
  return compose(compose(back, transform(...motion)), toCenter);
}

// Why no step can come from the pairs; null where one can.
export function checkPairs(pairs) {
  if (inlierCount(pairs) >= MIN_PAIRS) return null;
  let matched = 0;
  pairs.withinGate.forEach((inside, i) => (matched += inside && pairs.withinOverlap[i]));
  return matched >= MIN_PAIRS ? "DEGENERATE" : "TOO_FEW_CORRESPONDENCES";
}

// Whether to stop after the last record, and why; null to go on.
export function checkConvergence(history, parameters) {
  const [before, now] = history.slice(-2);
  const spent = history.length > parameters.max_iterations ? "BUDGET_SPENT" : null;
  if (before.far) return spent; // however short, such a step is none to stop after
  if (
    now.translationStep < parameters.translation_tolerance &&
    now.rotationStep < parameters.rotation_tolerance
  )
    return "CONVERGED_POSE";
  const tolerance = parameters.cost_tolerance;
  if (tolerance > 0 && Math.abs(now.cost - before.cost) < tolerance) return "CONVERGED_COST";
  return spent;
}

function record(T, T_before, pairs, far) {
  const first = T === T_before;
  const turned = Math.atan2(T_before.c * T.s - T_before.s * T.c, T_before.c * T.c + T_before.s * T.s);
  return {
    T_target_source: T,
    pairs,
    cost: cost(pairs),
    far,
    translationStep: first ? NaN : Math.hypot(T.x - T_before.x, T.y - T_before.y),
    rotationStep: first ? NaN : Math.abs(turned),
  };
}

// ---- far from the answer

// The delta [m] far from the answer, for the residuals of the pairs that were kept.
function wideDelta(residuals, delta) {
  if (residuals.length === 0) return delta;
  return Math.max(delta, WIDTH * Float64Array.from(residuals).sort()[residuals.length >> 1]);
}

// The share of point-to-point where delta was widened.
function pointShare(wide, delta) {
  return delta === Infinity ? 0 : Math.min(1, POINT_SHARE * (wide / delta) ** 2);
}

// The gate [m] near the answer.
function closeGate(gate, delta) {
  return Math.min(gate, CLOSE_GATE * delta);
}

// Of how many among `count` points one is looked at from afar.
function thinning(count) {
  return Math.max(1, Math.floor(count / FEW));
}

// How far a step moved the source [m], root mean square.
function motionOf(before, after) {
  let squares = 0;
  for (let i = 0; i < before.length; i++) squares += (after[i] - before[i]) ** 2;
  return Math.sqrt(squares / (before.length / 2));
}

// Whether the next motion will exceed LONG delta, if it shrinks as this one did.
function isFar(motion, motionBefore, delta) {
  const shrinks = motion < motionBefore ? motion / motionBefore : 1;
  return shrinks * motion > LONG * delta;
}
