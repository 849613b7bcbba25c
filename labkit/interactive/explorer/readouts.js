// What the explorer says in words and numbers about the iteration that is shown and the run.

import { element } from "./controls.js";
import { FATES, fates, inlierCount, inlierRmse } from "./correspondences.js";
import { unobservable } from "./degeneracy.js";
import { TERMINATIONS, failed } from "./icp.js";
import { poseDifference, toXYTheta } from "./se2.js";

const DEGREE = Math.PI / 180;
const PATIENCE = 600; // ms of rest before a screen reader is told

export class Readouts {
  constructor(signal) {
    this.numbers = element("dl", { class: "icp-readouts" });
    this.legend = element("p", { class: "icp-legend" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    signal.addEventListener("abort", () => clearTimeout(this.speaking));
  }

  // `known` is the answer, or null; `reference` says what that answer is.
  write({ result, shown, known, reference, source, target }) {
    const { history } = result, last = history.length - 1;
    const { pairs, cost, T_target_source: T } = history[shown];
    const count = inlierCount(pairs), points = pairs.kept.length;
    const rows = [
      ["shown", shown ? `iteration ${shown} of ${last}` : `the guess, before ${last} iterations`],
      ["inliers", `${count} of ${points} (${Math.round((100 * count) / points)} %)`],
      ["RMSE", count ? `${inlierRmse(pairs).toFixed(4)} m over ${count} inliers` : "none: no inliers"],
      ["cost J", `${cost.toPrecision(4)} m²`],
      ["pose", sayPose(T)],
    ];
    if (known) rows.push([`off the ${reference}`, sayDifference(poseDifference(known, T))]);
    rows.push(["the run", message(result, target)]);
    this.numbers.replaceChildren(
      ...rows.flatMap(([term, text]) => [element("dt", {}, term), element("dd", { "data-readout": term }, text)]),
    );
    this.count(pairs, source.length / 2, target.points.length / 2);
  }

  count(pairs, sourcePoints, targetPoints) {
    const counts = new Array(FATES.length).fill(0);
    for (const fate of fates(pairs)) counts[fate]++;
    const entry = (f) => element("span", { class: `icp-fate-${f}` }, `${FATES[f]}: ${counts[f]}`);
    const shown = [4, 3, 2, 1, 0].filter((f) => counts[f] || FATES[f] !== "no line");
    const target = element("span", { class: "icp-fate-target" }, `target: ${targetPoints}`);
    const passed = sourcePoints - pairs.kept.length; // from afar not all are looked at
    const rest = passed ? [element("span", { class: "icp-fate-passed" }, `not looked at: ${passed}`)] : [];
    this.legend.replaceChildren(target, ...shown.map(entry), ...rest);
  }

  // One sentence about the whole run, once the sliders are at rest.
  speak({ result, known, reference, target }) {
    clearTimeout(this.speaking);
    this.speaking = setTimeout(() => {
      const { T_target_source: T, history } = result;
      const off = T && known ? `; ${sayDifference(poseDifference(known, T))} off the ${reference}` : "";
      const count = inlierCount(history.at(-1).pairs), steps = history.length - 1;
      this.spoken.textContent = `${steps} iterations, ${message(result, target)}; ${count} inliers${off}.`;
    }, PATIENCE);
  }
}

// How a run ended, for Python.
export function outcome({ T_target_source: T, termination, history }) {
  const { pairs, cost } = history.at(-1), count = inlierCount(pairs);
  return {
    termination, iterations: history.length - 1, pose: T && toXYTheta(T),
    inlier_count: count, inlier_rmse: count ? inlierRmse(pairs) : null, cost,
  };
}

// How the run ended, and what it could not see.
function message({ termination, history }, target) {
  const unseen = failed(termination) ? [] : unobservable(history.at(-1).pairs, target);
  return TERMINATIONS[termination] + (unseen.length ? `; unobservable: ${unseen.join(", ")}` : "");
}

function sayPose(T) {
  const [x, y, theta] = toXYTheta(T);
  return `(${x.toFixed(3)}, ${y.toFixed(3)}) m, ${(theta / DEGREE).toFixed(2)}°`;
}

function sayDifference([metres, radians]) {
  const distance = metres < 0.1 ? `${(1000 * metres).toFixed(1)} mm` : `${metres.toFixed(3)} m`;
  return `${distance}, ${(radians / DEGREE).toFixed(2)}°`;
}
