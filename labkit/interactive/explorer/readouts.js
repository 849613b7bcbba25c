// What the explorer says in words and numbers about the iteration that is shown and the run.

import { legendOf } from "../marks.js";
import { TERMINATIONS } from "./constants.js";
import { digits, element, fixed } from "./controls.js";
import { PAIR_FATES, fates, inlierCount } from "./correspondences.js";
import { freeMotions, observability } from "./degeneracy.js";
import { failed, inlierRmse } from "./result.js";
import { DEGREE, poseDifference, toXYTheta } from "./se2.js";

export const SPEAK_DELAY_MS = 600; // ms of rest before a screen reader is told

export class Readouts {
  constructor(signal) {
    this.sentence = element("p", { class: "icp-sentence" });
    this.numbers = element("dl", { class: "icp-readouts" });
    this.legend = element("p", { class: "icp-legend" });
    this.ending = element("p", { class: "icp-ending", "data-readout": "the run" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    signal.addEventListener("abort", () => clearTimeout(this.speaking));
  }

  // What is shown; how the run ends is `told` once the reader has seen it. `known` is the answer,
  // or null; `reference` says what that answer is; `bet` is a place [x, y] or null.
  write({ result, shown, told, parameters, known, reference, source, target, bet }) {
    const { history } = result;
    const lastIteration = history.length - 1;
    const { pairs, cost, T_target_source: T } = history[shown];
    const count = inlierCount(pairs);
    const rows = [];
    if (result.termination)
      rows.push([
        "shown",
        `${shown === 0 ? "the guess, " : ""}iteration ${shown} of ${lastIteration}`,
      ]);
    rows.push([
      "RMSE",
      count ? `${inlierRmse(pairs).toFixed(4)} m over ${count} inliers` : "none: no inliers",
    ]);
    rows.push(["cost J", `${cost.toPrecision(4)} m²`], ["pose", sayPose(T)]);
    if (known && told) rows.push(["error", sayDifference(poseDifference(known, T))]);
    this.ending.textContent =
      result.termination && told ? `The run: ${ending({ result, target })}.` : "";
    if (bet && shown === lastIteration && result.T_target_source)
      rows.push([
        "your bet",
        `${Math.hypot(bet[0] - T.x, bet[1] - T.y).toFixed(2)} m from the end`,
      ]);
    writeRows(this.numbers, rows);
    this.judge(pairs, parameters);
    this.explain({
      pairs,
      known: told && known,
      reference,
      bet,
      sourcePoints: source.length / 2,
      targetPoints: target.points.length / 2,
    });
  }

  // One sentence on what the stages keep, its words in their colours.
  judge(pairs, { max_correspondence_distance: gate, overlap_ratio: overlap, huber_delta: delta }) {
    const word = (name, text) => element("b", { class: `icp-word-${name}` }, text);
    const down = fates(pairs).filter((fate) => fate === 3).length;
    const gated =
      gate === null
        ? [word("max_correspondence_distance", "No gate")]
        : ["A ", word("max_correspondence_distance", `gate of ${digits(gate)} m`)];
    const softened =
      delta === null ? word("huber_delta", "no δ") : word("huber_delta", `δ = ${digits(delta)} m`);
    const weighed =
      delta === null
        ? " weighs any down."
        : down
          ? ` weighs ${down} of them down.`
          : " weighs none down.";
    const parts = [
      ...gated,
      " and an ",
      word("overlap_ratio", `overlap of ${digits(overlap)}`),
      ` keep ${inlierCount(pairs)} of ${pairs.kept.length} pairs; `,
      softened,
      weighed,
    ];
    renew(this.sentence, parts);
  }

  // The marks of the map that occur, with their counts.
  explain({ pairs, known, reference, bet, sourcePoints, targetPoints }) {
    const counts = new Array(PAIR_FATES.length).fill(0);
    for (const fate of fates(pairs)) counts[fate]++;
    const passed = sourcePoints - pairs.kept.length; // from afar not all are looked at
    const marks = [["older", `target: ${targetPoints}`]];
    for (const f of [4, 3, 2, 1, 0])
      if (counts[f]) marks.push([PAIR_FATES[f], `${PAIR_FATES[f]}: ${counts[f]}`]);
    if (passed) marks.push(["passed", `not looked at: ${passed}`]);
    marks.push(["scanner", "older scanner"], ["now", "newer scanner, its way and knob"]);
    if (known) marks.push(["answer", reference]);
    if (bet) marks.push(["bet", "your bet"]);
    renew(this.legend, legendOf(marks).childNodes);
  }

  // One sentence about the whole run, once the sliders are at rest.
  speak({ result, told, known, reference, target }) {
    clearTimeout(this.speaking);
    this.speaking = setTimeout(() => {
      const { T_target_source: T, termination, history } = result;
      const errorText =
        T && known ? `; ends ${sayDifference(poseDifference(known, T))} off the ${reference}` : "";
      const endText = termination && told ? `${ending({ result, target })}${errorText}. ` : "";
      this.spoken.textContent = `${endText}${this.sentence.textContent}`;
    }, SPEAK_DELAY_MS);
  }
}

// Put terms and what they stand for into a list.
export function writeRows(list, rows) {
  renew(
    list,
    rows.flatMap(([term, text]) => [
      element("dt", {}, term),
      element("dd", { "data-readout": term }, text),
    ]),
  );
}

// Put these parts into a node, unless it says the same.
function renew(node, parts) {
  const fresh = element("div", {}, ...parts);
  if (fresh.textContent !== node.textContent) node.replaceChildren(...fresh.childNodes);
}

// How a run ended, for Python.
export function outcome({ T_target_source: T, termination, history }) {
  const { pairs, cost } = history.at(-1);
  const count = inlierCount(pairs);
  return {
    termination,
    iterations: history.length - 1,
    pose: T && toXYTheta(T),
    inlier_count: count,
    inlier_rmse: count ? inlierRmse(pairs) : null,
    cost,
  };
}

// How the run ended, and what it could not see.
function ending({ result: { termination, history }, target }) {
  const information = failed(termination) ? null : observability(history.at(-1).pairs, target);
  const unseen = information ? freeMotions(information) : [];
  const blind = unseen.length ? `; unobservable: ${unseen.join(", ")}` : "";
  return `${history.length - 1} iterations, ${TERMINATIONS[termination]}${blind}`;
}

function sayPose(T) {
  const [x, y, theta] = toXYTheta(T);
  return `(${fixed(x, 3)}, ${fixed(y, 3)}) m, ${fixed(theta / DEGREE, 2)}°`;
}

export function sayDifference([metres, radians]) {
  const distance = metres < 0.1 ? `${(1000 * metres).toFixed(1)} mm` : `${metres.toFixed(3)} m`;
  return `${distance}, ${(radians / DEGREE).toFixed(2)}°`;
}
