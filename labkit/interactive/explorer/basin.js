// The basin of convergence: from which guesses the loop ends at the answer.

import { failed, icp } from "./icp.js";
import { poseDifference, toXYTheta, transform } from "./se2.js";

export const OUTCOMES = ["the answer", "somewhere else", "no estimate"];

// Guesses on a square grid around the answer, all with the heading of `guess`: rows from
// -reach to reach along y, columns along x.
export function startGrid(answer, guess, reach, size) {
  const offset = (k) => (reach * (2 * k)) / (size - 1) - reach;
  const theta = toXYTheta(guess)[2];
  const starts = [];
  for (let row = 0; row < size; row++)
    for (let column = 0; column < size; column++)
      starts.push(transform(answer.x + offset(column), answer.y + offset(row), theta));
  return starts;
}

// What becomes of one guess, an index into OUTCOMES.
export function outcomeOf(result, answer, [metres, radians]) {
  if (failed(result.termination)) return 2;
  const [distance, angle] = poseDifference(answer, result.T_target_source);
  return distance <= metres && angle <= radians ? 0 : 1;
}

// Run the loop from every start, `slice` milliseconds at a time, and report in between, so
// that the page stays awake. Resolves to whether it came to the end.
export async function exploreBasin(job, { slice = 12, stopped, report }) {
  const outcomes = new Uint8Array(job.starts.length);
  let done = 0;
  while (done < outcomes.length) {
    const until = performance.now() + slice;
    do {
      const result = icp(job.source, job.target, job.starts[done], job.parameters);
      outcomes[done++] = outcomeOf(result, job.answer, job.within);
    } while (done < outcomes.length && performance.now() < until);
    report(outcomes, done);
    await new Promise((resolve) => setTimeout(resolve));
    if (stopped()) return false;
  }
  return true;
}
