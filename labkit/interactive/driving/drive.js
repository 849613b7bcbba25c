// A robot to drive: the truth is a grey ghost, what the scans say is blue, and the map grows
// behind.

import { freshContext, palette, tween } from "../explorer/canvas.js";
import { CONTROLS, TERMINATIONS } from "../explorer/constants.js";
import {
  SLIDERS,
  button,
  choice,
  element,
  isValueOf,
  parameterControls,
  part,
} from "../explorer/controls.js";
import { Frame } from "../explorer/frame.js";
import { floats } from "../explorer/scene.js";
import {
  DEGREE,
  apply,
  between,
  compose,
  invert,
  poseDifference,
  toXYTheta,
  transform,
} from "../explorer/se2.js";
import { isPage, keepHere, keptHere, toClipboard } from "../explorer/state.js";
import { View, widgetOf } from "../explorer/view.js";
import { drawMark, legendOf } from "../marks.js";
import { Odometry, distanceOff, takeScan } from "./odometry.js";
import { Robot, isDriven } from "./world.js";

const TICK_S = 1 / 60; // s
const TICKS_PER_SCAN = 12; // ticks from one scan to the next
const MAX_LINK_SCANS = 900; // scans that a link holds: three minutes
const MAX_VIEW_M = 12; // m that are seen of a longer world, or fewer:
const MIN_PX_PER_M = 55; // so that a narrow picture shows the robot large enough
const ROBOT_VIEW_M = 1; // m about a robot that are seen at least
const MIN_HEIGHT_PX = 230; // of the picture, on a telephone
const MAX_HEIGHT_PX = 340; // px of the picture: what is told and turned below it stays in view
const MAP_PX_PER_M = 40; // px of the map for a metre
const MAP_MARGIN_M = 3; // m of the map about the walls
const WRONG_STEP_M_RAD = [0.1, 5 * DEGREE]; // m and rad from which a step counts as wrong
const MIN_DRIFT_M = 0.1; // m off without a wrong step, from which it is told
const SLOW_SPEED_SHARE = 0.4; // share of the full speed, with Shift
const REPLAY_BUDGET_MS = 8; // ms of a frame for a drive of a link
const DRIVE_HASH = "#drive?";
const WALL_HINT = "A wall stops the robot: turn away from it, or drive back.";
const DRIVE_KEYS = {
  ArrowUp: [1, 0],
  w: [1, 0],
  ArrowDown: [-1, 0],
  s: [-1, 0],
  ArrowLeft: [0, 1],
  a: [0, 1],
  ArrowRight: [0, -1],
  d: [0, -1],
};
// To thousandths, as a link holds it.
const rounded = (pose) => pose.map((coordinate) => Math.round(1000 * coordinate) / 1000);
// A letter is the same key with Shift.
const keyOf = ({ key }) => (key.length === 1 ? key.toLowerCase() : key);
const clamp = (value) => Math.max(-1, Math.min(1, value));

// The changes from one pose to the next, in thousandths, in the base of 36.
export function encoded(poses) {
  const steps = poses
    .slice(1)
    .flatMap((pose, k) =>
      pose.map((coordinate, i) => Math.round(1000 * (coordinate - poses[k][i]))),
    );
  return steps.map((step) => step.toString(36)).join(".");
}

export function decoded(encodedSteps, start) {
  const poses = [rounded(start)];
  const steps = encodedSteps.split(".").map((number) => parseInt(number, 36) / 1000);
  for (let k = 0; k + 2 < steps.length; k += 3)
    poses.push(rounded(poses.at(-1).map((coordinate, i) => coordinate + steps[k + i])));
  return poses;
}

// Whether the match of a step is wrong, that errs by so much.
export const isWrong = ([metres, radians]) =>
  metres > WRONG_STEP_M_RAD[0] || radians > WRONG_STEP_M_RAD[1];

// What was gained by closing a drive, that was so many metres off before and after.
export function sayClosing(count, metresBefore, metresAfter) {
  if (!count) return "The scans recognise no place that the robot saw before.";
  const scans = count === 1 ? "1 scan" : `${count} scans`;
  const [errorBefore, errorAfter] = [metresBefore, metresAfter].map(
    (metres) => `${metres.toFixed(2)} m`,
  );
  const change = `${errorBefore} off before, ${errorAfter} now`;
  if (errorBefore === errorAfter)
    return `${scans} recognised, and nothing gained: still ${errorAfter} off.`;
  if (metresAfter > metresBefore)
    return `${scans} recognised, and the drive is worse: ${change}. A place was mistaken.`;
  return `${scans} recognised: ${change}.`;
}

class DriveView extends View {
  constructor(model, signal) {
    super(model, signal);
    this.parameters = { ...model.get("parameters") };
    this.places = new Map(model.get("places").map((place) => [place.name, place]));
    Object.assign(this, { wheels: "none", view: new Frame(), sheet: new Frame(), held: new Set() });
    this.build();
    this.live();
    addEventListener("hashchange", () => this.open(), { signal });
    const { world, wheels } = keptHere("drive") ?? {};
    this.choose(wheels);
    this.enter(world);
    this.open();
  }

  leave() {
    this.sliding?.stop();
  }

  build() {
    const names = [...this.places.keys()];
    const wheels = ["none", ...Object.keys(this.model.get("wheels"))];
    const select = (name, values, onValue) =>
      choice({ name, label: name, options: values.map((value) => [value, value]), onValue });
    this.world = select("world", names, (name) => this.enter(name));
    this.dial = select("wheels", wheels, (name) => {
      this.wheels = name;
      this.keep();
    });
    this.controls = parameterControls({
      scenes: [],
      onScene() {},
      onValue: (name) => (value) => {
        this.parameters[name] = value;
        return this.request();
      },
    });
    this.canvas = element("canvas", {
      tabindex: 0,
      role: "application",
      "aria-label": "Map. Arrow keys or W, A, S, D drive the robot, with Shift slowly.",
    });
    const promptText = matchMedia("(pointer: coarse)").matches
      ? "Drag here to drive; a short pull is slow"
      : "Drag, or click and use the arrow keys; with Shift slowly";
    this.prompt = element("p", { class: "icp-prompt", "aria-hidden": "true" }, promptText);
    const legend = legendOf([
      ["robot", "where its scans say that it is"],
      ["ghost", "where it is"],
      ["wall", "wall"],
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
      part("sliders", ...SLIDERS.map((name) => this.controls[name].node)),
    );
    this.listen();
  }

  // ---- what the driver does

  listen() {
    const on = (type, act) => this.canvas.addEventListener(type, act, { signal: this.signal });
    on("keydown", (event) => {
      this.isSlow = event.shiftKey;
      const key = keyOf(event);
      if (!DRIVE_KEYS[key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.held.add(key);
      this.go();
    });
    on("keyup", (event) => {
      this.isSlow = event.shiftKey;
      this.held.delete(keyOf(event));
    });
    on("blur", () => this.held.clear());
    const point = ({ offsetX, offsetY }) => (this.pointer = [offsetX, offsetY]);
    on("pointerdown", (event) => {
      point(event);
      this.canvas.setPointerCapture(event.pointerId);
      this.go();
    });
    on("pointermove", (event) => this.pointer && point(event));
    on("lostpointercapture", () => (this.pointer = null));
  }

  // What the driver wants: by keys, or towards the pointer, as fast as it is far.
  wanted() {
    const sum = (k) => clamp([...this.held].reduce((total, key) => total + DRIVE_KEYS[key][k], 0));
    const share = this.isSlow ? SLOW_SPEED_SHARE : 1;
    if (!this.pointer) return { ahead: share * sum(0), left: share * sum(1) };
    const [x, y, theta] = this.robot.pose;
    const [px, py] = this.view.place(...this.pointer);
    const bearing = Math.atan2(py - y, px - x) - theta;
    const turn = Math.atan2(Math.sin(bearing), Math.cos(bearing));
    const pull = Math.min(1, Math.hypot(px - x, py - y) / 2);
    return pull < 0.1
      ? { ahead: 0, left: 0 }
      : { ahead: pull * Math.max(0, Math.cos(turn)), left: clamp(2.5 * turn) };
  }

  go() {
    this.prompt.hidden = true;
    this.now ??= performance.now();
    this.request();
  }

  // Set the wheels by their name; there are none of another name.
  choose(wheels) {
    this.wheels = Object.hasOwn(this.model.get("wheels"), wheels) ? wheels : "none";
    this.dial.set(this.wheels);
  }

  keep() {
    keepHere("drive", { world: this.at.name, wheels: this.wheels });
  }

  // Go to the start of a world, with an empty map.
  enter(name, rival = null) {
    this.at = this.places.get(name) ?? [...this.places.values()][0];
    this.world.set(this.at.name);
    this.keep();
    this.segments = floats(this.at.segments);
    const [x, y] = [0, 1].map((axis) => this.segments.filter((_, i) => i % 2 === axis));
    this.box = { left: Math.min(...x), right: Math.max(...x) };
    Object.assign(this.box, { bottom: Math.min(...y), top: Math.max(...y) });
    this.sliding?.stop();
    this.rival = rival;
    this.robot = new Robot(this.at.start);
    this.odometry = new Odometry(this.at.start);
    this.poses = [];
    this.wrong = []; // numbers of the steps whose match is wrong
    this.worst = null; // the step that is told
    Object.assign(this, { ticks: 0, behind: 0 });
    Object.assign(this, { now: null, pointer: null, shown: null, sliding: null, inked: null });
    const { left, right, bottom, top } = this.box;
    const width = MAP_PX_PER_M * (right - left + 2 * MAP_MARGIN_M);
    const height = MAP_PX_PER_M * (top - bottom + 2 * MAP_MARGIN_M);
    this.map = Object.assign(document.createElement("canvas"), { width, height });
    this.sheet.look({
      width,
      height,
      center: [(left + right) / 2, (bottom + top) / 2],
      scale: MAP_PX_PER_M,
    });
    this.prompt.hidden = false;
    this.scan();
    this.request();
  }

  // What the page's address asks for: a world, or a drive to beat.
  open() {
    const { hash } = location;
    const named = [...this.places.keys()].find(
      (name) => `#drive-${name.toLowerCase().replace(" ", "-")}` === hash,
    );
    if (named) this.enter(named);
    if (!hash.startsWith(DRIVE_HASH)) return;
    const link = Object.fromEntries(new URLSearchParams(hash.slice(DRIVE_HASH.length)));
    this.choose(link.wheels);
    for (const control of CONTROLS.filter(({ name }) => SLIDERS.includes(name) && name in link)) {
      const value = link[control.name] === "null" ? null : Number(link[control.name]);
      if (isValueOf(control, value)) this.parameters[control.name] = value;
    }
    this.enter(link.world);
    const poses = decoded(link.drive ?? "", this.at.start).slice(0, MAX_LINK_SCANS);
    if (
      poses.length > 1 &&
      poses.flat().every(Number.isFinite) &&
      isDriven(poses, TICKS_PER_SCAN * TICK_S)
    )
      this.enter(link.world, { poses, odometry: new Odometry(poses[0]), setting: this.setting() });
  }

  // What a scan depends on beside the drive.
  setting() {
    const noise = this.model.get("wheels")[this.wheels];
    const { segments, parameters } = this;
    return { segments, lidar: this.model.get("lidar"), noise, parameters: { ...parameters } };
  }

  copy() {
    const set = Object.fromEntries(SLIDERS.map((name) => [name, this.parameters[name]]));
    const drive = encoded(this.poses.slice(0, MAX_LINK_SCANS));
    const settings = { world: this.at.name, wheels: this.wheels, ...set, drive };
    const link = location.href.split("#")[0] + DRIVE_HASH + new URLSearchParams(settings);
    toClipboard(link, "A link to this drive is on the clipboard: who beats it?").then(
      (message) => (this.said.textContent = message),
    );
  }

  // Close the drive where a place is recognised: it slides there.
  close() {
    if (this.sliding) return;
    const { scans } = this.odometry;
    const posesBefore = scans.map(({ T }) => T);
    const metresBefore = this.off();
    const recognisedCount = this.odometry.recognise(this.parameters);
    const posesAfter = scans.map(({ T }) => T);
    this.said.textContent = sayClosing(recognisedCount, metresBefore, this.off());
    this.score.textContent = this.sum();
    this.sliding = { stop() {} };
    const { stop } = tween(
      1,
      (at) => {
        scans.forEach(
          (scan, k) =>
            (scan.T = at < 1 ? between(posesBefore[k], posesAfter[k], at) : posesAfter[k]),
        );
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
      for (; this.behind >= TICK_S; this.behind -= TICK_S) this.tick();
    }
    const rests =
      !this.pointer && !this.held.size && !this.robot.speed && !this.robot.turning && !this.moved();
    if (rests && this.now !== null) this.spoken.textContent = this.sum();
    this.adviseAtWall();
    this.now = rests || this.now === null ? null : now;
    for (const name of SLIDERS) this.controls[name].set(this.parameters[name]);
    if (this.rival && this.rival.odometry.scans.length < this.rival.poses.length) this.replay();
    this.draw();
    if (this.now !== null || this.sliding) this.request();
  }

  tick() {
    this.robot.move(TICK_S, this.wanted(), this.segments);
    if (++this.ticks % TICKS_PER_SCAN === 0 && this.moved()) this.scan();
  }

  // Whether the robot has moved since its last scan.
  moved() {
    return rounded(this.robot.pose).some((coordinate, i) => coordinate !== this.poses.at(-1)[i]);
  }

  scan() {
    this.poses.push(rounded(this.robot.pose));
    takeScan(this.odometry, this.poses, this.setting());
    this.judge(this.poses.length - 1);
    this.ink(this.poses.length - 1, palette(this.root));
    this.score.textContent = this.sum();
    this.advise();
  }

  // Whether the match of the last step is wrong, by what the robot did.
  judge(k) {
    if (k === 0) return;
    const scan = this.odometry.scans[k];
    const [T_before, now] = this.poses.slice(k - 1).map((pose) => transform(...pose));
    const step = compose(invert(T_before), now);
    const error = poseDifference(step, scan.step);
    if (!isWrong(error)) return;
    this.wrong.push(k);
    const size = error[0] / WRONG_STEP_M_RAD[0] + error[1] / WRONG_STEP_M_RAD[1];
    if (this.worst && size < 1.2 * this.worst.size) return; // it is read aloud, so not each of them
    this.worst = { k, size, step, error, scan };
  }

  // Tell the worst step, and how its match ended; or what to try.
  advise() {
    const advice = this.worst ? this.slip() : this.hint();
    const sentence = this.beat() + (this.robot.isBlocked ? WALL_HINT : advice);
    if (sentence !== this.advised) this.said.textContent = this.advised = sentence;
  }

  // Say that a wall stops the robot, and that it no longer does.
  adviseAtWall() {
    if (this.isAtWall === this.robot.isBlocked) return;
    this.isAtWall = this.robot.isBlocked;
    this.advise();
  }

  slip() {
    const { k, step, error, scan } = this.worst;
    const driven = Math.hypot(step.x, step.y).toFixed(2);
    const turned = Math.abs(Math.round(toXYTheta(step)[2] / DEGREE));
    const errorText = `${error[0].toFixed(2)} m and ${Math.round(error[1] / DEGREE)}°`;
    const did = `the robot drove ${driven} m and turned ${turned}° since the scan before`;
    const unseen = scan.unseen.length ? ` It does not see a ${scan.unseen.join(" or a ")}.` : "";
    const match = `The match is ${errorText} off; ${TERMINATIONS[scan.ending]}.`;
    return `Scan ${k}: ${did}. ${match}${unseen}`;
  }

  hint() {
    if (this.off() < MIN_DRIFT_M) return this.at.hint;
    const [cm, degrees] = [100 * WRONG_STEP_M_RAD[0], Math.round(WRONG_STEP_M_RAD[1] / DEGREE)];
    const limits = `${cm} cm or ${degrees}°`;
    return `No match is more than ${limits} off: small errors add up. Recognise places.`;
  }

  beat() {
    if (!this.rival) return "";
    const { poses, odometry } = this.rival;
    const seconds = Math.round(poses.length * TICKS_PER_SCAN * TICK_S);
    if (odometry.scans.length < poses.length) return "Replaying the drive of the link … ";
    const { metres } = odometry.scans.at(-1);
    const metresOff = distanceOff(odometry, poses.at(-1)).toFixed(2);
    return `To beat, in orange: ${metres.toFixed(0)} m in ${seconds} s, ${metresOff} m off. `;
  }

  // Match the scans of the link's drive anew, for some milliseconds: its score is not believed.
  replay() {
    const { poses, odometry, setting } = this.rival;
    const deadline = performance.now() + REPLAY_BUDGET_MS;
    while (odometry.scans.length < poses.length && performance.now() < deadline)
      takeScan(odometry, poses, setting);
    this.advise();
    if (odometry.scans.length < poses.length) this.request();
  }

  off() {
    return distanceOff(this.odometry, this.poses.at(-1));
  }

  sum() {
    const { metres } = this.odometry.scans.at(-1);
    const steps = this.poses.length - 1;
    const wrongSteps = `${this.wrong.length} of ${steps} wrong`.replaceAll(" ", "\u00a0");
    return `${metres.toFixed(0)} m driven, ${this.off().toFixed(2)} m off, ${wrongSteps}`;
  }

  // ---- how it is shown

  // Put a scan on the map, and the two ways that lead there.
  ink(k, colors) {
    const context = this.map.getContext("2d");
    const { scans } = this.odometry;
    const previous = Math.max(0, k - 1);
    const believedStep = [previous, k].flatMap((i) => [scans[i].T.x, scans[i].T.y]);
    const truth = [previous, k].flatMap((i) => this.poses[i].slice(0, 2));
    for (const mark of [
      ["scan", apply(scans[k].T, scans[k].points)],
      ["pair", truth],
      ["way", believedStep],
    ])
      drawMark(context, this.sheet, colors, mark);
  }

  isLong() {
    return this.box.right - this.box.left > 2 * MAX_VIEW_M;
  }

  // The part of the world that is shown: a small world whole, of a long one what is about the
  // robots; both robots in any case.
  look(width, height) {
    const { left, right, bottom, top } = this.box;
    const [x, y] = [
      [this.shown.x, this.robot.pose[0]],
      [this.shown.y, this.robot.pose[1]],
    ];
    const middle = (x[0] + x[1]) / 2;
    const across = Math.min(MAX_VIEW_M, width / MIN_PX_PER_M);
    const xRange = this.isLong() ? [middle - across / 2, middle + across / 2] : [left, right];
    const [low, high] = [
      Math.min(xRange[0], ...x) - ROBOT_VIEW_M / 2,
      Math.max(xRange[1], ...x) + ROBOT_VIEW_M / 2,
    ];
    const [under, over] = [
      Math.min(bottom, ...y) - ROBOT_VIEW_M / 2,
      Math.max(top, ...y) + ROBOT_VIEW_M / 2,
    ];
    const scale = Math.min(width / (high - low), height / (over - under));
    this.view.look({ width, height, center: [(low + high) / 2, (under + over) / 2], scale });
  }

  // Put the prompt where the robot is not.
  placePrompt(height) {
    const [, v] = this.view.pixel(...this.robot.pose);
    this.prompt.classList.toggle("icp-above", v > height / 2);
  }

  draw() {
    const { scans } = this.odometry;
    const lastScan = scans.at(-1);
    const colors = palette(this.root);
    const share = this.isLong() ? 0.4 : 0.7; // of the width
    const fresh = freshContext(this.canvas, (width) => {
      const height = Math.max(share * width, Math.min(width, MIN_HEIGHT_PX));
      return Math.min(MAX_HEIGHT_PX, height);
    });
    if (!fresh) return;
    // Another theme, or a drive that slides: all of it anew.
    if (this.inked !== colors.target) {
      this.map.getContext("2d").clearRect(0, 0, this.map.width, this.map.height);
      const every = this.sliding ? Math.ceil(scans.length / 100) : 1;
      for (let k = 0; k < scans.length; k += every) this.ink(k, colors);
      this.inked = colors.target;
    }
    // It goes on as it last went.
    const part =
      this.now === null || this.sliding ? 0 : (this.ticks % TICKS_PER_SCAN) / TICKS_PER_SCAN;
    const ahead = compose(lastScan.T, between(transform(0, 0, 0), lastScan.step, part));
    this.shown = this.shown && this.now !== null ? between(this.shown, ahead, 0.4) : ahead;
    const { context, width, height } = fresh;
    this.look(width, height);
    this.placePrompt(height);
    const mark = (kind, data) => drawMark(context, this.view, colors, [kind, data]);
    const seenPoints = apply(lastScan.T, lastScan.points);
    mark("wall", this.segments);
    const corner = this.view.pixel(this.box.left - MAP_MARGIN_M, this.box.top + MAP_MARGIN_M);
    const size = [this.map.width, this.map.height].map(
      (pixels) => (pixels * this.view.scale) / MAP_PX_PER_M,
    );
    context.drawImage(this.map, ...corner, ...size);
    mark("view", [lastScan.T.x, lastScan.T.y, ...seenPoints]);
    mark("seen", seenPoints);
    if (this.rival) {
      const { poses } = this.rival;
      mark("rival", poses[Math.min(Math.floor(this.ticks / TICKS_PER_SCAN), poses.length - 1)]);
    }
    mark("ghost", this.robot.pose);
    mark("robot", toXYTheta(this.shown));
  }
}

export default widgetOf(() => DriveView);
