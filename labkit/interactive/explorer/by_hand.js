// Two scans and one number: the reader does by hand what ICP does, then lets ICP finish.

import { legendOf } from "../marks.js";
import { outcomeOf } from "./basin.js";
import { palette, tween } from "./canvas.js";
import { button, element, part } from "./controls.js";
import { MAX_TRAIL_COUNT, drawCost } from "./cost.js";
import { pairsAt } from "./correspondences.js";
import { icp } from "./icp.js";
import { Plane } from "./plane.js";
import { sayDifference } from "./readouts.js";
import { unpacked } from "./scene.js";
import { DEGREE, apply, between, poseDifference, toXYTheta, transform } from "./se2.js";
import { View } from "./view.js";

const NEAR_ANSWER_M_RAD = [0.35, 6 * DEGREE]; // from which the answer is close: m, rad
const TOUCH_HINT = "Drag the newer scan, blue, onto the older one; turn it by its knob.";
// What the marks mean, for stages that are on.
const legendEntries = ({ huber_delta, overlap_ratio, max_correspondence_distance }) => {
  const percent = Math.round(100 * (1 - overlap_ratio));
  const entries = [
    ["older", "older scan", true],
    ["kept", "newer scan, and its nearest points", true],
    ["down-weighted", "farther off, weighs less", huber_delta !== null],
    ["trimmed", `left out: the farthest ${percent} %`, percent > 0],
    ["gated", "left out: beyond the gate", max_correspondence_distance !== null],
  ];
  return entries.filter(([, , isOn]) => isOn);
};
const MIN_CHANGE_SHARE = 0.004; // share of the number from which it is warmer or colder
const HAND_KEYS_HINT =
  "Arrow keys move it by 5 cm, Page Up and Page Down turn it by 1°; with Shift finer.";

export class HandView extends View {
  constructor(model, signal) {
    super(model, signal);
    this.build();
    this.live();
    this.follow(["guess"], () => {
      // moved by the reader's hand, or by a loop in Python
      this.stop();
      this.path = null;
      this.request();
    });
    this.start();
    this.beckon();
  }

  leave() {
    this.playing?.stop();
    this.seen.disconnect();
  }

  // Once, when it is first seen: the scan is drawn a little towards the other, and back.
  beckon() {
    this.seen = new IntersectionObserver(
      ([{ isIntersecting }]) => {
        if (!isIntersecting) return;
        this.seen.disconnect();
        if (
          this.path ||
          this.trail.length > 1 ||
          !this.known ||
          matchMedia("(prefers-reduced-motion: reduce)").matches
        )
          return;
        const from = transform(...this.model.get("guess"));
        this.playing = tween(
          1,
          (at) => {
            this.ghost = at < 1 ? between(from, this.known, 0.4 * Math.sin(Math.PI * at)) : null;
            this.request();
          },
          { pace: 1200 },
        );
      },
      { threshold: 0.6 },
    );
    this.seen.observe(this.root);
  }

  build() {
    this.plane = new Plane({
      label: `Map of both scans. ${HAND_KEYS_HINT}`,
      signal: this.signal,
      pose: () => this.pose(),
      onPose: ({ x, y, theta }) => this.move([...this.plane.onMap(x, y), theta]),
      onView: () => this.request(),
    });
    this.distance = element("span", { class: "icp-distance" });
    this.verdict = element("p", { class: "icp-verdict" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    this.curve = element("canvas", { class: "icp-cost", role: "img" });
    const run = button("Let ICP finish", "Run the loop from where the scan lies", () => this.run());
    const again = button("Start again", "Put the scan back", () => this.start());
    this.worse = button("Try a worse start", "Put the scan where ICP gets stuck", () =>
      this.start("worse"),
    );
    const misfit = element(
      "p",
      { class: "icp-misfit" },
      this.distance,
      " is a typical distance from a point to the nearest one",
    );
    const help = element("p", { class: "icp-status icp-keys" }, HAND_KEYS_HINT);
    const legend = legendOf(legendEntries(this.model.get("first_parameters")));
    const side = part(
      "right",
      misfit,
      this.verdict,
      part("row", run, again, this.worse),
      this.curve,
      help,
      this.spoken,
    );
    this.root = element(
      "div",
      { class: "icp-explorer icp-by-hand", role: "group", "aria-label": this.model.get("label") },
      part("frame", part("left", this.plane.canvas, legend), side),
    );
    const take = ({ detail }) => {
      this.model.set("scene_data", [detail]);
      return this.start();
    }; // from the first page's map
    this.root.addEventListener("icp-scene", take, { signal: this.signal });
  }

  // Lay the scan at the scene's first guess, or at its worse one.
  start(guess = "guess") {
    const [scene] = this.model.get("scene_data");
    this.worse.hidden = !scene.worse;
    Object.assign(this, unpacked(scene));
    this.parameters = this.model.get("first_parameters");
    this.trail = [];
    this.hint = scene.hint ?? TOUCH_HINT;
    this.plane.frame(
      Float64Array.of(
        0,
        0,
        ...this.target.points,
        ...apply(transform(...scene[guess]), this.source),
      ),
    );
    this.move(scene[guess]);
  }

  pose() {
    const [x, y, theta] = this.path ? toXYTheta(this.path[this.shown]) : this.model.get("guess");
    return { x, y, theta };
  }

  move([x, y, theta]) {
    this.stop();
    this.path = this.ended = null;
    this.model.set("guess", [x, y, Math.atan2(Math.sin(theta), Math.cos(theta))]);
    this.sync();
    this.request();
  }

  // ICP from here, one iteration after the other; the next drag goes on from its end.
  run() {
    this.stop();
    const { x, y, theta } = this.pose();
    this.ended = icp(this.source, this.target, transform(x, y, theta), this.parameters);
    this.path = this.ended.history.map((iteration) => iteration.T_target_source);
    this.shown = 0;
    this.request();
    this.playing = tween(this.path.length - 1, (at) => {
      this.shown = Math.floor(at);
      this.part = at - this.shown;
      this.request();
    });
  }

  stop() {
    this.playing?.stop();
    this.playing = this.ghost = null;
    this.part = 0;
    if (this.path) this.shown = this.path.length - 1;
  }

  update() {
    const at = this.pose();
    const path = this.path?.slice(0, this.shown + 1) ?? [transform(at.x, at.y, at.theta)];
    const T =
      (this.ghost ?? this.part)
        ? (this.ghost ?? between(path.at(-1), this.path[this.shown + 1], this.part))
        : path.at(-1);
    const [x, y, theta] = toXYTheta(T);
    const pose = { x, y, theta };
    const { pairs, cost } = pairsAt(this.source, this.target, T, this.parameters);
    const misfit = Math.sqrt(
      (cost * pairs.kept.length) /
        Math.max(
          1,
          pairs.kept.reduce((sum, isKept) => sum + isKept, 0),
        ),
    );
    if (misfit !== this.trail.at(-1) && !this.ghost)
      this.trail = [...this.trail, misfit].slice(-MAX_TRAIL_COUNT);
    this.distance.textContent = `${misfit.toFixed(3)} m`;
    this.judge(T);
    const colors = palette(this.root);
    const names = [
      "before",
      this.ghost ? "drag me" : "now",
      ...(this.trail.length > 1 ? [] : ["turn"]),
    ];
    this.plane.draw({
      target: this.target.points,
      source: apply(T, this.source),
      pairs,
      path,
      answer: null,
      pose,
      colors,
      names,
    });
    const title = "that distance [m], as you move";
    drawCost(this.curve, { series: [this.trail], shown: this.trail.length - 1, colors, title });
    this.curve.setAttribute("aria-label", `${title}: now ${misfit.toFixed(3)} m`);
  }

  // Found, or stuck, and how far from the answer; on the way, whether the number falls.
  judge(T) {
    const running = this.path && this.shown < this.path.length - 1;
    const by = this.ended ? "ICP" : "you";
    const outcome = outcomeOf(
      this.ended ?? { T_target_source: T, termination: "CONVERGED_POSE" },
      this.known,
    );
    const error = poseDifference(this.known, T);
    const errorText = error[0] < 0.1 ? sayDifference(error) : `${error[0].toFixed(2)} m`;
    const [x, y, theta] = toXYTheta(T);
    const turn = (Math.abs(theta) / DEGREE).toFixed(1);
    const [misfitBefore, misfitNow] = [this.trail.at(-4) ?? this.trail[0], this.trail.at(-1)];
    const change = misfitNow / misfitBefore - 1;
    let verdict = this.ended ? "" : this.trail.length < 2 ? this.hint : this.verdict.textContent;
    if (!this.ended && this.trail.length > 1 && Math.abs(change) > MIN_CHANGE_SHARE)
      verdict = change < 0 ? "Warmer." : "Colder.";
    if (!this.ended && error[0] < NEAR_ANSWER_M_RAD[0] && error[1] < NEAR_ANSWER_M_RAD[1])
      verdict = `Near: ${errorText} to go. ICP can finish.`;
    const moved = Math.hypot(x, y).toFixed(2);
    const foundWords = by === "you" ? "Found by hand" : "Found";
    const ended = outcome === 2 ? "ICP gives up" : "Stuck";
    if (!running && outcome === 0)
      verdict = `${foundWords}: the robot moved ${moved} m and turned ${turn}°.`;
    else if (!running && this.ended)
      verdict = `${ended}: ${errorText} from where the robot was. Drag it nearer, and try again.`;
    const isFound = !running && outcome === 0;
    if (isFound && !this.root.matches(".icp-found"))
      this.root.dispatchEvent(new Event("icp-found", { bubbles: true }));
    this.root.classList.toggle("icp-found", isFound);
    if (verdict === this.verdict.textContent) return;
    this.verdict.textContent = verdict;
    if (verdict && verdict !== this.hint) this.spoken.textContent = verdict;
  }
}
