// Two scans and one number: the reader does by hand what ICP does, then lets ICP go on.

import { palette, watchTheme } from "./canvas.js";
import { button, element, keepToItself } from "./controls.js";
import { drawCost } from "./cost.js";
import { associate, icp } from "./icp.js";
import { Plane } from "./plane.js";
import { unpacked } from "./scene.js";
import { apply, toXYTheta, transform } from "./se2.js";

const BEAT = 90; // ms that an iteration stands
const TRAIL = 150; // numbers that the curve remembers
const EVERY_PAIR = { metric: "point_to_point", max_correspondence_distance: null, overlap_ratio: 1, huber_delta: null };
const TASK = "Drag the blue scan onto the black one; turn it by its knob.";
const KEYS_BY_HAND = "Arrow keys move it by 5 cm, Page Up and Page Down turn it by 1°; with Shift finer.";

export class HandView {
  constructor(model, signal) {
    Object.assign(this, { model, signal });
    this.build();
    const changed = () => this.request();
    const moved = () => { // by the reader's hand, or by a loop in Python
      this.stop();
      this.path = null;
      changed();
    };
    model.on("change:guess", moved);
    signal.addEventListener("abort", () => {
      model.off("change:guess", moved);
      clearInterval(this.playing);
      clearTimeout(this.syncing);
    });
    watchTheme(changed, signal);
    const resized = new ResizeObserver(changed);
    resized.observe(this.root);
    signal.addEventListener("abort", () => resized.disconnect());
    this.start();
  }

  build() {
    this.plane = new Plane({
      label: `Map of both scans. ${KEYS_BY_HAND}`, signal: this.signal, pose: () => this.pose(),
      onPose: ({ x, y, theta }) => this.move([...this.plane.onMap(x, y), theta]), onView: () => this.request(),
    });
    this.distance = element("output", { class: "icp-distance" });
    this.best = element("dd", { "data-readout": "best" });
    this.found = element("dd", { "data-readout": "ICP" });
    this.curve = element("canvas", { class: "icp-cost", role: "img" });
    this.go = button("Let ICP go on", "Run the loop from where the scan lies", () => this.run());
    const again = button("Start again", "Put the scan back", () => this.start());
    const numbers = element(
      "dl", { class: "icp-readouts" }, element("dt", {}, "your best"), this.best, element("dt", {}, "ICP"), this.found,
    );
    const mean = element("p", {}, this.distance, " from a point to the nearest of the older scan, on average");
    const part = (name, ...children) => element("div", { class: `icp-${name}` }, ...children);
    const side = part("right", element("p", {}, TASK), mean, part("row", this.go, again), numbers, this.curve);
    side.append(element("p", { class: "icp-status" }, KEYS_BY_HAND));
    this.root = element(
      "div", { class: "icp-explorer icp-by-hand", role: "group", "aria-label": this.model.get("label") },
      part("frame", part("left", this.plane.canvas), side),
    );
    keepToItself(this.root, this.signal);
  }

  start() {
    const [scene] = this.model.get("scene_data");
    Object.assign(this, unpacked(scene));
    this.lowest = Infinity;
    this.trail = [];
    this.found.textContent = "not asked yet";
    this.plane.frame(Float64Array.of(0, 0, ...this.target.points, ...apply(transform(...scene.guess), this.source)));
    this.move(scene.guess);
  }

  pose() {
    const [x, y, theta] = this.path ? toXYTheta(this.path[this.shown]) : this.model.get("guess");
    return { x, y, theta };
  }

  move([x, y, theta]) {
    this.stop();
    this.path = null;
    this.model.set("guess", [x, y, Math.atan2(Math.sin(theta), Math.cos(theta))]);
    clearTimeout(this.syncing);
    this.syncing = setTimeout(() => this.model.save_changes(), 120);
    this.request();
  }

  // ICP from here, one iteration after the other; the next drag goes on from its end.
  run() {
    this.stop();
    const { x, y, theta } = this.pose(), start = transform(x, y, theta);
    const parameters = { ...this.model.get("fixed_parameters"), ...this.model.get("first_parameters") };
    const { history, T_target_source: T } = icp(this.source, this.target, start, parameters);
    this.path = history.map((each) => each.T_target_source);
    this.shown = 0;
    const mean = T && meanDistance(this.pairsAt(T));
    this.found.textContent = T ? `${mean.toFixed(3)} m after ${history.length - 1} iterations` : "too far off: it gives up";
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (still) this.shown = this.path.length - 1;
    else
      this.playing = setInterval(() => {
        if (++this.shown >= this.path.length - 1) this.stop();
        this.request();
      }, BEAT);
    this.request();
  }

  stop() {
    clearInterval(this.playing);
    if (this.path) this.shown = this.path.length - 1;
  }

  request() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (!this.signal.aborted) this.draw();
    });
  }

  pairsAt(T) {
    return associate(this.source, this.target, T, EVERY_PAIR);
  }

  draw() {
    const pose = this.pose(), T = transform(pose.x, pose.y, pose.theta), pairs = this.pairsAt(T);
    const mean = meanDistance(pairs), byHand = this.path === null;
    if (byHand) this.lowest = Math.min(this.lowest, mean);
    if (mean !== this.trail.at(-1)) this.trail = [...this.trail, mean].slice(-TRAIL);
    this.distance.textContent = `${mean.toFixed(3)} m`;
    this.best.textContent = `${this.lowest.toFixed(3)} m`;
    const colors = palette(this.root), path = byHand ? [T] : this.path.slice(0, this.shown + 1);
    this.plane.draw({ target: this.target.points, source: apply(T, this.source), pairs, path, answer: null, pose, colors });
    const title = "that distance [m], as you move";
    drawCost(this.curve, { costs: this.trail, shown: this.trail.length - 1, colors, title });
    this.curve.setAttribute("aria-label", `${title}: now ${mean.toFixed(3)} m, at best ${this.lowest.toFixed(3)} m`);
  }
}

function meanDistance({ distances }) {
  return distances.reduce((sum, each) => sum + each, 0) / distances.length;
}
