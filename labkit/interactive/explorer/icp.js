// The robust ICP loop, its stages in the flow chart's order; mirrors labkit/icp.py.
//
// The tests hold it to labkit: the same poses to 1e-9, the same inliers, iterations and
// terminations. Parameters carry the names of labkit's IcpParameters; null turns a gate or
// a delta off. Constants come from labkit itself, as constants.js.

import { align, turnAbout } from "./alignment.js";
import { MIN_PAIRS } from "./constants.js";
import { associate, cost, inlierCount, rejectAndWeigh } from "./correspondences.js";
import { alignToLines } from "./line_alignment.js";
import { failed, stepLength } from "./result.js";
import { schedule, stageOf } from "./schedule.js";
import { compose } from "./se2.js";

// Estimate the transform that maps the newer scan onto the older one.
export function icp(source, target, T_init, parameters) {
  const { poses, history, termination } = run(source, target, T_init, parameters);
  return { T_target_source: failed(termination) ? null : poses.at(-1), termination, history };
}

// The loop; the letters are the boxes of the flow chart.
export function run(source, target, T_init, parameters) {
  const poses = [T_init];
  const history = [];
  let stage = stageOf(parameters, source.length / 2, parameters.approach ?? false, false);
  while (true) {
    let pairs = associate(source, target, poses.at(-1), stage); // D
    pairs = rejectAndWeigh(pairs, stage); // E
    history.push({
      T_target_source: poses.at(-1),
      pairs,
      cost: cost(pairs, stage),
      coarse: stage.coarse,
    });
    const termination = check(poses, history, pairs, stage, parameters); // H
    const dT = termination === null ? minimise(pairs, parameters.step_fraction ?? 1) : null; // F
    if (dT === null) return { poses, history, termination: termination ?? "DEGENERATE" }; // I
    poses.push(compose(dT, poses.at(-1))); // G: the update composes on the left
    stage = schedule(stage, poses, source, parameters);
  }
}

// (F) The step dT that best moves the kept pairs together; null where they leave it undetermined.
export function minimise(pairs, stepFraction) {
  const { source, target, normals, weights, pointShare } = pairs;
  const dT = normals
    ? alignToLines(source, target, normals, weights, pointShare)
    : align(source, target, weights);
  return dT && stepFraction < 1 ? shorten(dT, pairs, stepFraction) : dT;
}

// The same motion, seen from the kept points' centroid, but less far.
export function shorten(dT, { source, weights }, fraction) {
  let x = 0;
  let y = 0;
  let count = 0;
  for (let i = 0; i < weights.length; i++)
    if (weights[i] > 0) {
      x += source[2 * i];
      y += source[2 * i + 1];
      count++;
    }
  x /= count;
  y /= count;
  const dx = dT.c * x - dT.s * y + dT.x - x;
  const dy = dT.s * x + dT.c * y + dT.y - y;
  return turnAbout([x, y], fraction * Math.atan2(dT.s, dT.c), fraction * dx, fraction * dy);
}

// (H) Why to stop, by the last step, the pairs, the cost and the budget; null to go on.
export function check(poses, history, pairs, stage, parameters) {
  const [previous, current] = history.slice(-2);
  if (stage.mayConverge) {
    // both parts: a scan that turns about its own center has Δt ≈ 0
    const [moved, turned] = stepLength(...poses.slice(-2));
    if (moved < parameters.translation_tolerance && turned < parameters.rotation_tolerance)
      return "CONVERGED_POSE";
  }
  if (inlierCount(pairs) < MIN_PAIRS) {
    const matched = pairs.withinGate.filter((inside, i) => inside && pairs.withinOverlap[i]).length;
    return matched >= MIN_PAIRS ? "DEGENERATE" : "TOO_FEW_CORRESPONDENCES"; // on no surface
  }
  if (stage.mayConverge && Math.abs(current.cost - previous.cost) < parameters.cost_tolerance)
    return "CONVERGED_COST";
  return poses.length > parameters.max_iterations ? "BUDGET_SPENT" : null;
}
