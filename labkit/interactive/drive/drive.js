// A robot to drive: the truth is a grey ghost, what the scans say is blue, and the map grows behind.

import { freshContext, palette, rule, tween } from "../explorer/canvas.js";
import { button, choice, element, parameterControls, part } from "../explorer/controls.js";
import { Frame } from "../explorer/frame.js";
import { floats } from "../explorer/scene.js";
import { apply, between, compose, invert, toXYTheta, transform } from "../explorer/se2.js";
import { isPage, toClipboard } from "../explorer/state.js";
import { View } from "../explorer/view.js";
import { Odometry } from "./odometry.js";
import { cast, generator } from "./rays.js";
import { Robot, decoded, encoded, rounded, wheelStep } from "./robot.js";

const TICK = 1 / 60, SCAN = 12; // s, and ticks from one scan to the next
const LONGEST = 900; // scans that a link holds: three minutes
const ACROSS = 12; // m that are seen of a longer world
const INK = 40, MARGIN = 3; // px of the map for a metre, and m about the walls
const LOST = 0.1; // m off, from which the lesson is told
const RACE = "#drive?";
const DIALS = ["max_correspondence_distance", "overlap_ratio", "huber_delta"];
const KEYS = { ArrowUp: [1, 0], w: [1, 0], ArrowDown: [-1, 0], s: [-1, 0], ArrowLeft: [0, 1], a: [0, 1], ArrowRight: [0, -1], d: [0, -1] };
const clamp = (value) => Math.max(-1, Math.min(1, value));

class DriveView extends View {
  constructor(model, signal) {
    super(model, signal);
    this.parameters = { ...model.get("parameters") };
    this.places = new Map(model.get("places").map((each) => [each.name, each]));
    Object.assign(this, { wheels: "none", frame: null, view: new Frame(), held: new Set() });
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
    const names = [...this.places.keys()], wheels = ["none", ...Object.keys(this.model.get("wheels"))];
    const select = (name, values, onValue) => choice({ name, label: name, options: values.map((each) => [each, each]), onValue });
    this.world = select("world", names, (name) => this.enter(name));
    this.dial = select("wheels", wheels, (name) => (this.wheels = name));
    this.controls = parameterControls({
      scenes: [], values: {}, words: this.model.get("parameter_words"), choose() {},
      tell: (name) => (value) => (this.parameters[name] = value, this.request()),
    });
    this.canvas = element("canvas", { tabindex: 0, role: "application", "aria-label": "Map. Arrow keys or W, A, S, D drive the robot." });
    const how = matchMedia("(pointer: coarse)").matches ? "Drag here to drive" : "Drag, or click and use the arrow keys: drive!";
    this.prompt = element("p", { class: "icp-prompt", "aria-hidden": "true" }, how);
    const mark = (color, sign, text) => element("span", {}, element("b", { style: `color: var(--icp-${color})`, "aria-hidden": "true" }, sign), text);
    const legend = element("p", { class: "icp-legend" }, mark("source", "●", " where its scans say that it is"), mark("reference", "◌", " where it is"));
    this.score = element("p", { class: "icp-score" });
    this.said = element("p", { class: "icp-advice", role: "status" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    const close = button("Recognise places", "Match the scans of two visits to one place, and close the drive there", () => this.close());
    const again = button("Start again", "Back to the start, with an empty map", () => this.enter(this.at.name, this.rival));
    const copy = button("Copy link", "A link that holds this drive, to race against", () => this.copy());
    this.root = element(
      "div", { class: "icp-explorer icp-compact icp-drive", role: "group", "aria-label": "A robot to drive" },
      part("top", this.world.node, this.dial.node), part("stage", this.canvas, this.prompt), legend,
      part("row", this.score, close, again, ...(isPage() ? [copy] : [])), this.said, this.spoken,
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
    on("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.pointer = [event.offsetX, event.offsetY];
      this.go();
    });
    on("pointermove", ({ offsetX, offsetY }) => this.pointer && (this.pointer = [offsetX, offsetY]));
    on("lostpointercapture", () => (this.pointer = null));
  }

  // What the driver wants: by keys, or towards the pointer, as fast as it is far.
  wanted() {
    const sum = (k) => clamp([...this.held].reduce((total, key) => total + KEYS[key][k], 0));
    if (!this.pointer) return { ahead: sum(0), left: sum(1) };
    const [x, y, theta] = this.robot.pose, [px, py] = this.view.place(...this.pointer);
    const off = Math.atan2(py - y, px - x) - theta, turn = Math.atan2(Math.sin(off), Math.cos(off));
    const far = Math.min(1, Math.hypot(px - x, py - y) / 2);
    return far < 0.1 ? { ahead: 0, left: 0 } : { ahead: far * Math.max(0, Math.cos(turn)), left: clamp(2.5 * turn) };
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
    this.bounds = [0, 1].map((axis) => [Math.min(...ends(axis)), Math.max(...ends(axis))]);
    this.sliding?.stop();
    Object.assign(this, {
      robot: new Robot(this.at.start), odometry: new Odometry(rounded(this.at.start)), poses: [], metres: 0, ticks: 0, behind: 0,
      now: null, pointer: null, shown: null, bending: null, rival,
    });
    const [width, height] = this.bounds.map(([low, high]) => INK * (high - low + 2 * MARGIN));
    this.map = Object.assign(document.createElement("canvas"), { width, height });
    this.prompt.hidden = false;
    this.scan();
    this.request();
  }

  // What the page's address asks for: a world, or a drive to beat.
  open() {
    const { hash } = location, named = [...this.places.keys()].find((each) => `#drive-${each.toLowerCase().replace(" ", "-")}` === hash);
    if (named) this.enter(named);
    if (!hash.startsWith(RACE)) return;
    const told = Object.fromEntries(new URLSearchParams(hash.slice(RACE.length)));
    if (told.wheels in this.model.get("wheels")) this.dial.set((this.wheels = told.wheels));
    for (const name of DIALS) if (Number(told[name]) > 0) this.parameters[name] = Number(told[name]);
    this.enter(told.world);
    const rival = { poses: decoded(told.drive ?? "", this.at.start), metres: Number(told.metres), off: Number(told.off) };
    if (rival.poses.flat().every(Number.isFinite) && rival.poses.length > 1) this.enter(told.world, rival);
  }

  copy() {
    const set = Object.fromEntries(DIALS.map((name) => [name, this.parameters[name]])), drive = encoded(this.poses.slice(0, LONGEST));
    const told = { world: this.at.name, wheels: this.wheels, ...set, metres: this.metres.toFixed(1), off: this.off().toFixed(3), drive };
    const link = location.href.split("#")[0] + RACE + new URLSearchParams(told);
    toClipboard(link, "A link to this drive is on the clipboard: who beats it?").then((said) => (this.said.textContent = said));
  }

  // Close the drive where a place is recognised: it slides there.
  close() {
    const { scans } = this.odometry, before = scans.map(({ T }) => T), off = this.off();
    const found = this.odometry.recognise(this.parameters), after = scans.map(({ T }) => T);
    this.said.textContent = found
      ? `${found} scans recognised: ${off.toFixed(2)} m off before, ${this.off().toFixed(2)} m now.`
      : "The scans recognise no place that the robot saw before.";
    if (!found || this.bending) return;
    const slide = (at) => {
      scans.forEach((scan, k) => (scan.T = at < 1 ? between(before[k], after[k], at) : after[k]));
      this.inked = null;
      if (at >= 1) this.bending = null;
      this.request();
    };
    this.bending = true;
    this.sliding = tween(1, slide, { pace: 900 });
  }

  // ---- what happens

  update() {
    const now = performance.now();
    if (this.now !== null && !this.bending) {
      this.behind += Math.min(0.1, (now - this.now) / 1000);
      for (; this.behind >= TICK; this.behind -= TICK) this.tick();
      const rests = !this.pointer && !this.held.size && this.robot.atRest() && !this.moved();
      this.now = rests ? null : now;
      if (rests) this.spoken.textContent = this.sum();
    } else if (this.now !== null) this.now = now;
    for (const name of DIALS) this.controls[name].set(this.parameters[name]);
    this.draw();
    if (this.now !== null || this.bending) this.request();
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
    const pose = rounded(this.robot.pose), last = this.poses.at(-1), T = transform(...pose), random = generator(this.poses.length);
    const step = last && compose(invert(transform(...last)), T), noise = this.model.get("wheels")[this.wheels];
    if (last) this.metres += Math.hypot(step.x, step.y);
    const { points } = cast(this.segments, T, this.model.get("lidar"), random);
    this.odometry.add(points, step && noise ? wheelStep(step, noise, random) : null, this.metres, this.parameters);
    this.poses.push(pose);
    this.ink(this.poses.length - 1);
    this.score.textContent = this.sum();
    const advice = this.advice(); // written only where it changes: it is read aloud
    if (advice !== this.advised) this.said.textContent = this.advised = advice;
  }

  off() {
    const { T } = this.odometry.scans.at(-1), [x, y] = this.poses.at(-1);
    return Math.hypot(T.x - x, T.y - y);
  }

  sum() {
    return `${this.metres.toFixed(0)} m driven, ${this.off().toFixed(2)} m off`;
  }

  advice() {
    const { metres, off, poses } = this.rival ?? {}, seconds = Math.round(poses?.length * SCAN * TICK);
    const beat = poses ? `To beat: ${metres.toFixed(0)} m in ${seconds} s, ${off.toFixed(2)} m off. ` : "";
    return beat + (this.off() > LOST ? this.at.lesson : this.at.hint);
  }

  // ---- how it is shown

  // Put a scan on the map, and the two paths that lead there.
  ink(k) {
    const context = this.map.getContext("2d"), { T, points } = this.odometry.scans[k], colors = palette(this.root);
    const [[left], [, top]] = this.bounds, at = ([x, y]) => [INK * (x - left + MARGIN), INK * (top + MARGIN - y)];
    const seen = apply(T, points), last = this.odometry.scans[k - 1]?.T ?? T;
    context.fillStyle = colors.target;
    context.globalAlpha = 0.35;
    for (let i = 0; i < seen.length; i += 2) {
      const [u, v] = at(seen.subarray(i, i + 2));
      context.fillRect(u - 1, v - 1, 2, 2);
    }
    context.globalAlpha = 1;
    rule(context, ...at(this.poses[Math.max(0, k - 1)]), ...at(this.poses[k]), colors.reference);
    rule(context, ...at([last.x, last.y]), ...at([T.x, T.y]), colors.source);
    this.inked = colors.target;
  }

  draw() {
    const fresh = freshContext(this.canvas, (width) => Math.min(460, (this.isLong() ? 0.4 : 0.7) * width));
    if (!fresh) return;
    const { context } = fresh, colors = palette(this.root), { scans } = this.odometry, last = scans.at(-1);
    if (this.inked !== colors.target) { // another theme, or a drive that bends
      this.map.getContext("2d").clearRect(0, 0, this.map.width, this.map.height);
      for (let k = 0, every = this.bending ? Math.ceil(scans.length / 100) : 1; k < scans.length; k += every) this.ink(k);
    }
    const share = this.now === null || this.bending ? 0 : (this.ticks % SCAN) / SCAN; // it goes on as it last went
    const ahead = compose(last.T, between(transform(0, 0, 0), last.step, share));
    this.shown = this.shown && !this.bending ? between(this.shown, ahead, 0.4) : ahead;
    this.aim(fresh);
    const { scale } = this.view, [[left, right], [bottom, top]] = this.bounds;
    context.strokeStyle = colors.soft;
    context.globalAlpha = 0.35;
    context.beginPath();
    for (let i = 0; i < this.segments.length; i += 4)
      context.moveTo(...this.view.pixel(...this.segments.subarray(i, i + 2))), context.lineTo(...this.view.pixel(...this.segments.subarray(i + 2, i + 4)));
    context.stroke();
    context.globalAlpha = 1;
    const size = [right - left, top - bottom].map((each) => scale * (each + 2 * MARGIN));
    context.drawImage(this.map, ...this.view.pixel(left - MARGIN, top + MARGIN), ...size);
    this.drawSweep(context, apply(this.shown, last.points), colors);
    const rival = this.rival?.poses[Math.min(Math.floor(this.ticks / SCAN), this.rival.poses.length - 1)];
    if (rival) this.drawRobot(context, rival, colors["method-1"], false);
    this.drawRobot(context, this.robot.pose, colors.reference, false);
    this.drawRobot(context, toXYTheta(this.shown), colors.source, true);
  }

  isLong() {
    return this.bounds[0][1] - this.bounds[0][0] > 2 * ACROSS;
  }

  // A small world is seen whole; in a long one both robots are kept in view.
  aim({ width, height }) {
    const [[left, right], [bottom, top]] = this.bounds, { x } = this.shown, [ghost] = this.robot.pose;
    const long = this.isLong(), across = long ? Math.max(ACROSS, 1.3 * Math.abs(x - ghost) + 4) : right - left + 1;
    const scale = Math.min(width / across, height / (top - bottom + 1)), center = [long ? (x + ghost) / 2 : (left + right) / 2, (bottom + top) / 2];
    this.view.look({ width, height, center, scale });
  }

  // What the scanner sees, where the scans say that it is.
  drawSweep(context, points, colors) {
    const at = this.view.pixel(this.shown.x, this.shown.y);
    context.fillStyle = colors.source;
    context.beginPath();
    context.moveTo(...at);
    for (let i = 0; i < points.length; i += 2) context.lineTo(...this.view.pixel(points[i], points[i + 1]));
    context.globalAlpha = 0.12;
    context.fill();
    context.globalAlpha = 1;
    for (let i = 0; i < points.length; i += 2) {
      const [u, v] = this.view.pixel(points[i], points[i + 1]);
      context.fillRect(u - 1.5, v - 1.5, 3, 3);
    }
  }

  drawRobot(context, [x, y, theta], color, solid) {
    const [u, v] = this.view.pixel(x, y), r = Math.max(7, 0.28 * this.view.scale), turn = (angle) => [u + r * Math.cos(theta + angle), v - r * Math.sin(theta + angle)];
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = 2;
    context.setLineDash(solid ? [] : [4, 3]);
    context.beginPath();
    context.arc(u, v, r, 0, 2 * Math.PI);
    context.globalAlpha = solid ? 0.85 : 0.25;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.setLineDash([]);
    context.strokeStyle = solid ? "white" : color;
    context.beginPath();
    context.moveTo(...turn(2.5)), context.lineTo(...turn(0)), context.lineTo(...turn(-2.5));
    context.stroke();
  }
}

function render({ model, el }) {
  const controller = new AbortController();
  el.append(new DriveView(model, controller.signal).root);
  return () => controller.abort();
}

export default { render };
