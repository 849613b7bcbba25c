// What an iteration works with, far from the answer and near it; mirrors labkit/schedule.py.

import { CLOSE_GATE, FEW, LONG, POINT_SHARE, WIDTH } from "./constants.js";

// The stage of an iteration for `count` source points, far from the answer or near it.
export function stageOf(parameters, count, far, mayConverge) {
  const gate = parameters.max_correspondence_distance ?? Infinity, huberDelta = parameters.huber_delta ?? Infinity;
  return {
    onLines: parameters.metric === "point_to_line",
    stride: far ? Math.max(1, Math.floor(count / FEW)) : 1,
    gate: parameters.approach && !far ? Math.min(gate, CLOSE_GATE * huberDelta) : gate,
    overlapRatio: parameters.overlap_ratio,
    huberDelta,
    widening: far ? WIDTH : 0,
    pointShare: far && huberDelta < Infinity ? POINT_SHARE : 0,
    far,
    mayConverge,
  };
}

// Delta [m] of this iteration: from afar as wide as the median of the kept residuals asks.
export function widened(residuals, kept, { huberDelta, widening }) {
  const some = residuals.filter((_, i) => kept[i]).sort();
  return widening && some.length ? Math.max(huberDelta, widening * some[some.length >> 1]) : huberDelta;
}

// The next stage, after the step to the last pose. It is far if it was, and if the next motion, which
// is expected to shrink as the last one did, is longer than LONG delta.
export function schedule(before, poses, source, parameters) {
  let far = before.far;
  if (far) {
    let motion = displacement(source, ...poses.slice(-2));
    const motionBefore = poses.length > 2 ? displacement(source, ...poses.slice(-3, -1)) : 0;
    if (motion < motionBefore) motion *= motion / motionBefore;
    far = motion > LONG * (parameters.huber_delta ?? Infinity);
  }
  return stageOf(parameters, source.length / 2, far, !before.far);
}

// Root mean square distance [m] by which a step moved the points.
export function displacement(points, T_before, T) {
  const c = T.c - T_before.c, s = T.s - T_before.s, x = T.x - T_before.x, y = T.y - T_before.y;
  let total = 0;
  for (let i = 0; i < points.length; i += 2)
    total += (c * points[i] - s * points[i + 1] + x) ** 2 + (s * points[i] + c * points[i + 1] + y) ** 2;
  return Math.sqrt(total / (points.length / 2));
}
