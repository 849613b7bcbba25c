// How a run ended; mirrors labkit/result.py.

import { TERMINATIONS } from "./constants.js";

export function failed(termination) {
  return TERMINATIONS[termination].startsWith("failed");
}

// Length [m] and turn [rad] of the step between two poses.
export function stepLength(T_before, T) {
  const c = T_before.c * T.c + T_before.s * T.s, s = T_before.c * T.s - T_before.s * T.c;
  return [Math.hypot(T.x - T_before.x, T.y - T_before.y), Math.abs(Math.atan2(s, c))];
}
