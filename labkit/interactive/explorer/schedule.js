// What an iteration works with, in coarse and in fine iterations; mirrors labkit/schedule.py.

import {
  COARSE_POINTS,
  DELTA_PER_MEDIAN,
  GATE_PER_DELTA,
  LONG_STEP,
  POINT_SHARE,
} from "./constants.js";

// The settings of an iteration for `count` source points, coarse or fine.
export function stageOf(parameters, count, coarse, mayConverge) {
  const gate = parameters.max_correspondence_distance ?? Infinity;
  const huberDelta = parameters.huber_delta ?? Infinity;
  return {
    onLines: parameters.metric === "point_to_line",
    stride: coarse ? Math.max(1, Math.floor(count / COARSE_POINTS)) : 1,
    gate: parameters.approach && !coarse ? Math.min(gate, GATE_PER_DELTA * huberDelta) : gate,
    overlapRatio: parameters.overlap_ratio,
    huberDelta,
    widening: coarse ? DELTA_PER_MEDIAN : 0,
    pointShare: coarse && huberDelta < Infinity ? POINT_SHARE : 0,
    coarse,
    mayConverge,
  };
}

// Delta [m] of this iteration: a coarse one is as wide as the median of the kept residuals asks.
export function adaptDelta(residuals, kept, { huberDelta, widening }) {
  const keptResiduals = residuals.filter((_, i) => kept[i]).sort();
  return widening && keptResiduals.length
    ? Math.max(huberDelta, widening * keptResiduals[keptResiduals.length >> 1])
    : huberDelta;
}

// The next stage, after the step to the last pose. It is coarse if it was, and if the next motion,
// which is expected to shrink as the last one did, is longer than LONG_STEP delta.
export function schedule(stage, poses, source, parameters) {
  let coarse = stage.coarse;
  if (coarse) {
    let motion = displacement(source, ...poses.slice(-2));
    const motionBefore = poses.length > 2 ? displacement(source, ...poses.slice(-3, -1)) : 0;
    if (motion < motionBefore) motion *= motion / motionBefore;
    coarse = motion > LONG_STEP * (parameters.huber_delta ?? Infinity);
  }
  return stageOf(parameters, source.length / 2, coarse, !stage.coarse);
}

// Root mean square distance [m] by which a step moved the points.
export function displacement(points, T_before, T) {
  const c = T.c - T_before.c;
  const s = T.s - T_before.s;
  const x = T.x - T_before.x;
  const y = T.y - T_before.y;
  let total = 0;
  for (let i = 0; i < points.length; i += 2)
    total +=
      (c * points[i] - s * points[i + 1] + x) ** 2 + (s * points[i] + c * points[i + 1] + y) ** 2;
  return Math.sqrt(total / (points.length / 2));
}
