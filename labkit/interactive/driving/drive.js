// A robot to drive: the truth is a grey ghost, what the scans say is blue, and the map grows
// behind.

import { freshContext, palette, tween } from "../explorer/canvas.js";
import { button, choice, element, parameterControls, part } from "../explorer/controls.js";
import { Frame } from "../explorer/frame.js";
import { floats } from "../explorer/scene.js";
import { apply, between, compose, invert, toXYTheta, transform } from "../explorer/se2.js";
import { isPage, toClipboard } from "../explorer/state.js";
import { View, widgetOf } from "../explorer/view.js";
import { drawMark, legendOf } from "../marks.js";
import { Odometry } from "./odometry.js";
import { Robot, cast, generator, wheelStep } from "./world.js";

const TICK = 1 / 60;
const SCAN = 12; // s, and ticks from one scan to the next
const LONGEST = 900; // scans that a link holds: three minutes
const ACROSS = 12; // m that are seen of a longer world
const INK = 40;
const MARGIN = 3; // px of the map for a metre, and m about the walls
const LOST = 0.1; // m off, from which the lesson is told
const RACE = "#drive?";
const DIALS = ["max_correspondence_distance", "overlap_ratio", "huber_delta"];
const KEYS = {
  ArrowUp: [1, 0],
  w: [1, 0],
  ArrowDown: [-1, 0],
  s: [-1, 0],
  ArrowLeft: [0, 1],
  a: [0, 1],
  ArrowRight: [0, -1],
  d: [0, -1],
};
const rounded = (pose) => pose.map((each) => Math.round(1000 * each) / 1000); // as a link holds it
const clamp = (value) => Math.max(-1, Math.min(1, value));

// The changes from one pose to the next, in thousandths, in the base of 36.
export function encoded(poses) {
  const steps = poses
    .slice(1)
    .flatMap((pose, k) => pose.map((each, i) => Math.round(1000 * (each - poses[k][i]))));
  return steps.map((step) => step.toString(36)).join(".");
}

export function decoded(text, start) {
  const poses = [rounded(start)];
  const steps = text.split(".").map((each) => parseInt(each, 36) / 1000);
  for (let k = 0; k + 2 < steps.length; k += 3)
    poses.push(rounded(poses.at(-1).map((each, i) => each + steps[k + i])));
  return poses;
}

class DriveView extends View {
  constructor(model, signal) {
    super(model, signal);
    this.parameters = { ...model.get("parameters") };
    this.places = new Map(model.get("places").map((each) => [each.name, each]));
    Object.assign(this, { wheels: "none", view: new Frame(), sheet: new Frame(), held: new Set() });
    this.build();
    this.live();
    addEventListener("hashchange", () => this.open(), { signal });
    this.enter();
    this.open();
  }

  leave() {
    this.sliding?.stop();
  }

  build() {
    const names = [...this.places.keys()];
    const wheels = ["none", ...Object.keys(this.model.get("wheels"))];
    const select = (name, values, onValue) =>
      choice({ name, label: name, options: values.map((each) => [each, each]), onValue });
    this.world = select("world", names, (name) => this.enter(name));
    this.dial = select("wheels", wheels, (name) => (this.wheels = name));
    this.controls = parameterControls({
      scenes: [],
      words: this.model.get("parameter_words"),
      choose() {},
      tell: (name) => (value) => {
        this.parameters[name] = value;
        return this.request();
      },
    });
    this.canvas = element("canvas", {
      tabindex: 0,
      role: "application",
      "aria-label": "Map. Arrow keys or W, A, S, D drive the robot.",
    });
    const how = matchMedia("(pointer: coarse)").matches
      ? "Drag here to drive"
      : "Drag, or click and use the arrow keys: drive!";
    this.prompt = element("p", { class: "icp-prompt", "aria-hidden": "true" }, how);
    const legend = legendOf([
      ["robot", "where its scans say that it is"],
      ["ghost", "where it is"],
    ]);
    this.score = element("p", { class: "icp-score" });
    this.said = element("p", { class: "icp-advice", role: "status" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    const close = button(
      "Recognise places",
      "Match the scans of two visits to one place, and close the drive there",
      () => this.close(),
    );
    const again = button("Start again", "Back to the start, with an empty map", () =>
      this.enter(this.at.name, this.rival),
    );
    const copy = button("Copy link", "A link that holds this drive, to race against", () =>
      this.copy(),
    );
    this.root = element(
      "div",
      {
        class: "icp-explorer icp-compact icp-drive",
        role: "group",
        "aria-label": "A robot to drive",
      },
      part("top", this.world.node, this.dial.node),
      part("stage", this.canvas, this.prompt),
      legend,
      part("row", this.score, close, again, ...(isPage() ? [copy] : [])),
      this.said,
      this.spoken,
      part("sliders", ...DIALS.map((name) => this.controls[name].node)),
    );
    this.listen();
  }

  // ---- what the driver does

  listen() {
    const on = (type, act) => this.canvas.addEventListener(type, act, { signal: this.signal });
    on("keydown", (event) => {
      if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.held.add(event.key);
      this.go();
    });
    on("keyup", ({ key }) => this.held.delete(key));
    on("blur", () => this.held.clear());
    const point = ({ offsetX, offsetY }) => (this.pointer = [offsetX, offsetY]);
    on("pointerdown", (event) =>
      this.go(point(event), this.canvas.setPointerCapture(event.pointerId)),
    );
    on("pointermove", (event) => this.pointer && point(event));
    on("lostpointercapture", () => (this.pointer = null));
  }

  // What the driver wants: by keys, or towards the pointer, as fast as it is far.
  wanted() {
    const sum = (k) => clamp([...this.held].reduce((total, key) => total + KEYS[key][k], 0));
    if (!this.pointer) return { ahead: sum(0), left: sum(1) };
    const [x, y, theta] = this.robot.pose;
    const [px, py] = this.view.place(...this.pointer);
    const off = Math.atan2(py - y, px - x) - theta;
    const turn = Math.atan2(Math.sin(off), Math.cos(off));
    const far = Math.min(1, Math.hypot(px - x, py - y) / 2);
    return far < 0.1
      ? { ahead: 0, left: 0 }
      : { ahead: far * Math.max(0, Math.cos(turn)), left: clamp(2.5 * turn) };
  }

  go() {
    this.prompt.hidden = true;
    this.now ??= performance.now();
    this.request();
  }

  enter(name, rival = null) {
    this.at = this.places.get(name) ?? [...this.places.values()][0];
    this.world.set(this.at.name);
    this.segments = floats(this.at.segments);
    const ends = (axis) => this.segments.filter((_, i) => i % 2 === axis);
    const [[left, right], [bottom, top]] = [0, 1].map((axis) => [
      Math.min(...ends(axis)),
      Math.max(...ends(axis)),
    ]);
    Object.assign(this, {
      left,
      top,
      across: right - left,
      down: top - bottom,
      center: [(left + right) / 2, (bottom + top) / 2],
    });
    this.sliding?.stop();
    const fresh = {
      poses: [],
      metres: 0,
      ticks: 0,
      behind: 0,
      now: null,
      pointer: null,
      shown: null,
      sliding: null,
      inked: null,
    };
    Object.assign(this, fresh, {
      rival,
      robot: new Robot(this.at.start),
      odometry: new Odometry(this.at.start),
    });
    const [width, height] = [this.across, this.down].map((each) => INK * (each + 2 * MARGIN));
    this.map = Object.assign(document.createElement("canvas"), { width, height });
    this.sheet.look({ width, height, center: this.center, scale: INK });
    this.prompt.hidden = false;
    this.scan();
    this.request();
  }

  // What the page's address asks for: a world, or a drive to beat.
  open() {
    const { hash } = location;
    const named = [...this.places.keys()].find(
      (each) => `#drive-${each.toLowerCase().replace(" ", "-")}` === hash,
    );
    if (named) this.enter(named);
    if (!hash.startsWith(RACE)) return;
    const told = Object.fromEntries(new URLSearchParams(hash.slice(RACE.length)));
    if (told.wheels in this.model.get("wheels")) this.dial.set((this.wheels = told.wheels));
    for (const name of DIALS)
      if (Number(told[name]) > 0) this.parameters[name] = Number(told[name]);
    this.enter(told.world);
    const poses = decoded(told.drive ?? "", this.at.start);
    const [metres, off] = [Number(told.metres), Number(told.off)];
    if (poses.length > 1 && [metres, off, ...poses.flat()].every(Number.isFinite))
      this.enter(told.world, { poses, metres, off });
  }

  copy() {
    const set = Object.fromEntries(DIALS.map((name) => [name, this.parameters[name]]));
    const drive = encoded(this.poses.slice(0, LONGEST));
    const told = {
      world: this.at.name,
      wheels: this.wheels,
      ...set,
      metres: this.metres.toFixed(1),
      off: this.off().toFixed(3),
      drive,
    };
    const link = location.href.split("#")[0] + RACE + new URLSearchParams(told);
    toClipboard(link, "A link to this drive is on the clipboard: who beats it?").then(
      (said) => (this.said.textContent = said),
    );
  }

  // Close the drive where a place is recognised: it slides there.
  close() {
    if (this.sliding) return;
    const { scans } = this.odometry;
    const before = scans.map(({ T }) => T);
    const off = this.off();
    const found = this.odometry.recognise(this.parameters);
    const after = scans.map(({ T }) => T);
    const told = `${found} scans recognised: ${off.toFixed(2)} m off before, ${this.off().toFixed(2)} m now.`;
    this.said.textContent = found
      ? told
      : "The scans recognise no place that the robot saw before.";
    this.score.textContent = this.sum();
    this.sliding = { stop() {} };
    const { stop } = tween(
      1,
      (at) => {
        scans.forEach((scan, k) => (scan.T = at < 1 ? between(before[k], after[k], at) : after[k]));
        this.inked = null;
        if (at >= 1) this.sliding = null;
        this.request();
      },
      { pace: 900 },
    );
    if (this.sliding) this.sliding = { stop };
  }

  // ---- what happens

  update() {
    const now = performance.now();
    if (this.now !== null && !this.sliding) {
      this.behind += Math.min(0.1, (now - this.now) / 1000);
      for (; this.behind >= TICK; this.behind -= TICK) this.tick();
    }
    const rests =
      !this.pointer && !this.held.size && !this.robot.speed && !this.robot.turning && !this.moved();
    if (rests && this.now !== null) this.spoken.textContent = this.sum();
    this.now = rests || this.now === null ? null : now;
    for (const name of DIALS) this.controls[name].set(this.parameters[name]);
    this.draw();
    if (this.now !== null || this.sliding) this.request();
  }

  tick() {
    this.robot.move(TICK, this.wanted(), this.segments);
    if (++this.ticks % SCAN === 0 && this.moved()) this.scan();
  }

  // Whether the robot has moved since its last scan.
  moved() {
    return rounded(this.robot.pose).some((each, i) => each !== this.poses.at(-1)[i]);
  }

  // Chance is the same for the same scan of a drive, so that a link repeats it.
  scan() {
    const pose = rounded(this.robot.pose);
    const last = this.poses.at(-1);
    const T = transform(...pose);
    const random = generator(this.poses.length);
    const step = last && compose(invert(transform(...last)), T);
    const noise = this.model.get("wheels")[this.wheels];
    if (last) this.metres += Math.hypot(step.x, step.y);
    const { points } = cast(this.segments, T, this.model.get("lidar"), random);
    this.odometry.add(
      points,
      step && noise ? wheelStep(step, noise, random) : null,
      this.metres,
      this.parameters,
    );
    this.poses.push(pose);
    this.ink(this.poses.length - 1, palette(this.root));
    this.score.textContent = this.sum();
    const { poses, metres, off } = this.rival ?? {};
    const lesson = this.off() > LOST ? this.at.lesson : this.at.hint;
    const beat = poses
      ? `To beat, in orange: ${metres.toFixed(0)} m in ${Math.round(poses.length * SCAN * TICK)} s, ${off.toFixed(2)} m off. `
      : "";
    // Read aloud, so once
    if (beat + lesson !== this.advised) this.said.textContent = this.advised = beat + lesson;
  }

  off() {
    const { T } = this.odometry.scans.at(-1);
    const [x, y] = this.poses.at(-1);
    return Math.hypot(T.x - x, T.y - y);
  }

  sum() {
    return `${this.metres.toFixed(0)} m driven, ${this.off().toFixed(2)} m off`;
  }

  // ---- how it is shown

  // Put a scan on the map, and the two ways that lead there.
  ink(k, colors) {
    const context = this.map.getContext("2d");
    const { scans } = this.odometry;
    const before = Math.max(0, k - 1);
    const way = [before, k].flatMap((i) => [scans[i].T.x, scans[i].T.y]);
    const truth = [before, k].flatMap((i) => this.poses[i].slice(0, 2));
    for (const mark of [
      ["scan", apply(scans[k].T, scans[k].points)],
      ["pair", truth],
      ["way", way],
    ])
      drawMark(context, this.sheet, colors, mark);
  }

  draw() {
    const long = this.across > 2 * ACROSS;
    const { scans } = this.odometry;
    const last = scans.at(-1);
    const colors = palette(this.root);
    const fresh = freshContext(this.canvas, (width) => Math.min(460, (long ? 0.4 : 0.7) * width));
    if (!fresh) return;
    if (this.inked !== colors.target) {
      // another theme, or a drive that slides
      this.map.getContext("2d").clearRect(0, 0, this.map.width, this.map.height);
      for (
        let k = 0, every = this.sliding ? Math.ceil(scans.length / 100) : 1;
        k < scans.length;
        k += every
      )
        this.ink(k, colors);
      this.inked = colors.target;
    }
    // It goes on as it last went
    const share = this.now === null || this.sliding ? 0 : (this.ticks % SCAN) / SCAN;
    const ahead = compose(last.T, between(transform(0, 0, 0), last.step, share));
    this.shown = this.shown && this.now !== null ? between(this.shown, ahead, 0.4) : ahead;
    // A small world is seen whole; in a long one both robots are kept in view.
    const { context, width, height } = fresh;
    const [ghost] = this.robot.pose;
    const { x, y } = this.shown;
    const across = long ? Math.max(ACROSS, 1.3 * Math.abs(x - ghost) + 4) : this.across + 1;
    const scale = Math.min(width / across, height / (this.down + 1));
    const center = long ? [(x + ghost) / 2, this.center[1]] : this.center;
    this.view.look({ width, height, center, scale });
    const mark = (kind, data) => drawMark(context, this.view, colors, [kind, data]);
    const seen = apply(last.T, last.points);
    mark("wall", this.segments);
    const corner = this.view.pixel(this.left - MARGIN, this.top + MARGIN);
    context.drawImage(
      this.map,
      ...corner,
      (this.map.width * scale) / INK,
      (this.map.height * scale) / INK,
    );
    mark("view", [last.T.x, last.T.y, ...seen]);
    mark("seen", seen);
    if (this.rival)
      mark(
        "rival",
        this.rival.poses[Math.min(Math.floor(this.ticks / SCAN), this.rival.poses.length - 1)],
      );
    mark("ghost", this.robot.pose);
    mark("robot", toXYTheta(this.shown));
  }
}

export default widgetOf(() => DriveView);
