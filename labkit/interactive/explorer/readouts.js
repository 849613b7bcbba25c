// What the explorer says in words and numbers about the iteration that is shown and the run.

import { element } from "./controls.js";
import { FATES, fates, inlierCount, inlierRmse } from "./correspondences.js";
import { TERMINATIONS, failed } from "./icp.js";
import { unobservable } from "./line_alignment.js";
import { DEGREE, poseDifference, toXYTheta } from "./se2.js";

export const PATIENCE = 600; // ms of rest before a screen reader is told

export class Readouts {
  constructor(signal) {
    this.numbers = element("dl", { class: "icp-readouts" });
    this.legend = element("p", { class: "icp-legend" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    signal.addEventListener("abort", () => clearTimeout(this.speaking));
  }

  // Above, what is shown; below, how the run ends. `known` is the answer, or null; `reference`
  // says what that answer is; `bet` is a place [x, y] or null.
  write({ result, shown, known, reference, source, target, bet }) {
    const { history } = result, last = history.length - 1;
    const { pairs, cost, T_target_source: T } = history[shown];
    const count = inlierCount(pairs), points = pairs.kept.length;
    const name = !result.termination ? "these pairs" : shown === 0 ? "the guess" : shown === last ? "the result" : "on the way";
    const rows = [
      ["shown", `${name}${result.termination ? `, iteration ${shown} of ${last}` : ""}`],
      ["inliers", `${count} of ${points} (${Math.round((100 * count) / points)} %)`],
      ["RMSE", count ? `${inlierRmse(pairs).toFixed(4)} m over ${count} inliers` : "none: no inliers"],
      ["cost J", `${cost.toPrecision(4)} m²`],
      ["pose", sayPose(T)],
    ];
    if (known) rows.push([`off the ${reference}`, sayDifference(poseDifference(known, T))]);
    if (result.termination) rows.push(["the run", ending({ result, known, reference, target })]);
    if (bet && shown === last && result.T_target_source)
      rows.push(["your bet", `${Math.hypot(bet[0] - T.x, bet[1] - T.y).toFixed(2)} m from the end`]);
    writeRows(this.numbers, rows);
    this.explain({ pairs, known, reference, bet, sourcePoints: source.length / 2, targetPoints: target.points.length / 2 });
  }

  // Every mark of the map, with its count.
  explain({ pairs, known, reference, bet, sourcePoints, targetPoints }) {
    const counts = new Array(FATES.length).fill(0);
    for (const fate of fates(pairs)) counts[fate]++;
    const entry = (kind, text) => element("span", { class: `icp-mark-${kind}` }, text);
    const shown = [4, 3, 2, 1, 0].filter((f) => counts[f] || FATES[f] !== "no line");
    const passed = sourcePoints - pairs.kept.length; // from afar not all are looked at
    const marks = [entry("target", `target: ${targetPoints}`), ...shown.map((f) => entry(f, `${FATES[f]}: ${counts[f]}`))];
    if (passed) marks.push(entry("passed", `not looked at: ${passed}`));
    marks.push(entry("older", "older scanner"), entry("guess", "guess"), entry("now", "newer scanner, its way and knob"));
    if (known) marks.push(entry("answer", reference));
    if (bet) marks.push(entry("bet", "your bet"));
    this.legend.replaceChildren(...marks);
  }

  // One sentence about the whole run, once the sliders are at rest.
  speak({ result, known, reference, target }) {
    clearTimeout(this.speaking);
    this.speaking = setTimeout(() => {
      const count = inlierCount(result.history.at(-1).pairs);
      const end = result.termination ? `${ending({ result, known, reference, target })}; ` : "";
      this.spoken.textContent = `${end}${count} inliers.`;
    }, PATIENCE);
  }
}

// Put terms and what they stand for into a list.
export function writeRows(list, rows) {
  const parts = rows.flatMap(([term, text]) => [element("dt", {}, term), element("dd", { "data-readout": term }, text)]);
  list.replaceChildren(...parts);
}

// How a run ended, for Python.
export function outcome({ T_target_source: T, termination, history }) {
  const { pairs, cost } = history.at(-1), count = inlierCount(pairs);
  return {
    termination, iterations: history.length - 1, pose: T && toXYTheta(T),
    inlier_count: count, inlier_rmse: count ? inlierRmse(pairs) : null, cost,
  };
}

// How the run ended, where, and what it could not see.
function ending({ result: { T_target_source: T, termination, history }, known, reference, target }) {
  const unseen = failed(termination) ? [] : unobservable(history.at(-1).pairs, target);
  const blind = unseen.length ? `; unobservable: ${unseen.join(", ")}` : "";
  const off = T && known ? `; ends ${sayDifference(poseDifference(known, T))} off the ${reference}` : "";
  return `${history.length - 1} iterations, ${TERMINATIONS[termination]}${blind}${off}`;
}

function sayPose(T) {
  const [x, y, theta] = toXYTheta(T);
  return `(${x.toFixed(3)}, ${y.toFixed(3)}) m, ${(theta / DEGREE).toFixed(2)}°`;
}

export function sayDifference([metres, radians]) {
  const distance = metres < 0.1 ? `${(1000 * metres).toFixed(1)} mm` : `${metres.toFixed(3)} m`;
  return `${distance}, ${(radians / DEGREE).toFixed(2)}°`;
}
