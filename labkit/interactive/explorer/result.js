// How a run ended; mirrors labkit/result.py.

import { TERMINATIONS } from "./constants.js";
import { inlierCount } from "./correspondences.js";

export function failed(termination) {
  return TERMINATIONS[termination].startsWith("failed");
}

// Root mean square distance [m] of the kept pairs; NaN where none was kept.
export function inlierRmse(pairs) {
  const squares = pairs.distances.reduce((sum, d, i) => sum + (pairs.kept[i] ? d * d : 0), 0);
  return Math.sqrt(squares / inlierCount(pairs));
}

// Length [m] and turn [rad] of the step between two poses.
export function stepLength(T_before, T) {
  const c = T_before.c * T.c + T_before.s * T.s;
  const s = T_before.c * T.s - T_before.s * T.c;
  return [Math.hypot(T.x - T_before.x, T.y - T_before.y), Math.abs(Math.atan2(s, c))];
}
