// The two scans in the plane: drawn with their pairs, the source dragged by the reader, the view
// zoomed and panned, and a bet on where the run will end.

import { drawMark } from "../marks.js";
import { PAIR_FATES, fates } from "./correspondences.js";
import { disc, freshContext, rule } from "./canvas.js";
import { element } from "./controls.js";
import { Frame, TOUCH_REACH_PX } from "./frame.js";
import { DEGREE } from "./se2.js";

const KNOB_ARM_PX = 50; // px from the scanner to the knob that turns it
const KNOB_REACH_PX = 18; // px within which the knob is grasped
const MARGIN_SHARE = 0.06;
const EDGE_PX = 14; // px that the scanner stays within the map
const LONE_POINT_SHARE = 0.05; // of the points, on each side: what is far tells little
export const MAX_ZOOM = 10;

export class Plane extends Frame {
  // `onPose` gets {x, y, theta} when the reader moves the source; `pose` tells where it is;
  // `onBet` gets [x, y] when the bet is placed; `onView` is called when the view has changed.
  constructor({ label, pose, onPose, onBet, onView, signal }) {
    super();
    this.canvas = element("canvas", {
      class: "icp-plane",
      tabindex: 0,
      role: "application",
      "aria-label": label,
    });
    this.pose = pose;
    this.onPose = onPose;
    this.onBet = onBet;
    this.onView = onView;
    this.mode = "move"; // or "pan", or "bet"
    this.bet = null;
    this.fingers = new Map();
    const listen = (type, listener) =>
      this.canvas.addEventListener(type, listener, { signal, passive: false });
    listen("pointerdown", (event) => this.grasp(event));
    listen("pointermove", (event) => this.pull(event));
    for (const type of ["pointerup", "pointercancel"]) listen(type, (event) => this.release(event));
    listen("wheel", (event) => this.roll(event));
    listen("touchstart", (event) => this.touch(event));
    listen("keydown", (event) => this.press(event));
  }

  // Show the part of the plane that holds the points, but for lone ones far away.
  frame(points) {
    const range = (axis) => {
      const sorted = points.filter((_, i) => i % 2 === axis).sort();
      const low = sorted[Math.floor(LONE_POINT_SHARE * sorted.length)];
      const high = sorted[Math.ceil((1 - LONE_POINT_SHARE) * sorted.length) - 1];
      const more = 0.1 * (high - low) || 1;
      return [Math.max(sorted[0], low - more), Math.min(sorted.at(-1), high + more)];
    };
    this.bounds = [range(0), range(1)];
    this.source = [];
    this.showAll();
  }

  showAll() {
    this.zoom = 1;
    this.center = this.bounds.map(([low, high]) => (low + high) / 2);
    this.onView();
  }

  // Closer or farther, within bounds, about a pixel; the middle by default.
  zoomBy(factor, u = this.width / 2, v = this.height / 2) {
    if (factor * this.zoom <= 1) return this.showAll();
    const [x, y] = this.place(u, v);
    const zoom = Math.min(MAX_ZOOM, factor * this.zoom);
    const change = zoom / this.zoom;
    this.center = [x + (this.center[0] - x) / change, y + (this.center[1] - y) / change];
    this.zoom = zoom;
    this.onView();
  }

  // The wheel zooms the map that was clicked, else it scrolls the page.
  roll(event) {
    if (!event.ctrlKey && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.zoomBy(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
  }

  // A finger far from the scan scrolls the page; two zoom.
  touch(event) {
    const { left, top } = this.canvas.getBoundingClientRect();
    const [{ clientX, clientY }] = event.touches;
    if (
      event.touches.length > 1 ||
      this.mode !== "move" ||
      this.isNear(clientX - left, clientY - top)
    )
      event.preventDefault();
  }

  isNear(u, v) {
    const { x, y, theta } = this.pose();
    const [u0, v0] = this.pixel(x, y);
    const spots = [
      [u0, v0],
      [u0 + KNOB_ARM_PX * Math.cos(theta), v0 - KNOB_ARM_PX * Math.sin(theta)],
    ];
    for (let i = 0; i < this.source.length; i += 2)
      spots.push(this.pixel(this.source[i], this.source[i + 1]));
    return spots.some(([a, b]) => Math.hypot(a - u, b - v) < TOUCH_REACH_PX);
  }

  // Move the view by pixels, not far beyond the points.
  panBy(du, dv) {
    const next = [this.center[0] - du / this.scale, this.center[1] + dv / this.scale];
    const beyond = [this.width, this.height].map((side) => side / 4 / this.scale);
    this.center = next.map((coordinate, k) => {
      const [low, high] = this.bounds[k];
      return Math.max(low - beyond[k], Math.min(high + beyond[k], coordinate));
    });
    this.onView();
  }

  // The nearest place for the scanner that lies on the whole map, so that no scan gets lost.
  onMap(x, y) {
    if (!this.whole) return [x, y];
    const reach = [this.width, this.height].map((side) => (side / 2 - EDGE_PX) / this.whole);
    return [x, y].map((coordinate, k) => {
      const middle = (this.bounds[k][0] + this.bounds[k][1]) / 2;
      return Math.max(middle - reach[k], Math.min(middle + reach[k], coordinate));
    });
  }

  grasp(event) {
    const { x, y, theta } = this.pose();
    this.fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.fingers.size > 1) return (this.grip = null);
    if (
      event.pointerType === "touch" &&
      this.mode === "move" &&
      !this.isNear(event.offsetX, event.offsetY)
    )
      return;
    if (this.mode === "bet") {
      event.preventDefault();
      return this.onBet(this.place(event.offsetX, event.offsetY));
    }
    const [u, v] = this.pixel(x, y);
    const knob = [u + KNOB_ARM_PX * Math.cos(theta), v - KNOB_ARM_PX * Math.sin(theta)];
    const turning = Math.hypot(event.offsetX - knob[0], event.offsetY - knob[1]) < KNOB_REACH_PX;
    const panning = this.mode === "pan" || event.button === 1;
    this.grip = { panning, turning, u: event.offsetX, v: event.offsetY, x, y, theta };
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    event.preventDefault();
  }

  pull(event) {
    if (this.fingers.size === 2 && this.fingers.has(event.pointerId)) return this.pinch(event);
    if (!this.grip) return;
    const { panning, turning, u, v, x, y, theta } = this.grip;
    const du = event.offsetX - u;
    const dv = event.offsetY - v;
    if (du === 0 && dv === 0) return;
    if (panning) {
      Object.assign(this.grip, { u: event.offsetX, v: event.offsetY });
      return this.panBy(du, dv);
    }
    if (!turning) return this.onPose({ x: x + du / this.scale, y: y - dv / this.scale, theta });
    const [u0, v0] = this.pixel(x, y);
    const angleBefore = Math.atan2(v0 - v, u - u0);
    const angleNow = Math.atan2(v0 - event.offsetY, event.offsetX - u0);
    this.onPose({ x, y, theta: theta + angleNow - angleBefore });
  }

  // Two fingers: as much closer as they part, about their middle.
  pinch({ pointerId, offsetX, offsetY }) {
    const apart = () => {
      const [[a, b], [c, d]] = this.fingers.values();
      return [Math.hypot(a - c, b - d), (a + c) / 2, (b + d) / 2];
    };
    const [spanBefore] = apart();
    this.fingers.set(pointerId, [offsetX, offsetY]);
    const [spanNow, u, v] = apart();
    if (spanBefore > 0) this.zoomBy(spanNow / spanBefore, u, v);
  }

  // A scan that was dragged out of a zoomed view brings the view along.
  release({ pointerId }) {
    this.fingers.delete(pointerId);
    const dragged = this.grip && !this.grip.panning;
    this.grip = null;
    const { x, y } = this.pose();
    const [u, v] = this.pixel(x, y);
    if (!dragged || (u > 0 && u < this.width && v > 0 && v < this.height)) return;
    this.center = [x, y];
    this.onView();
  }

  press(event) {
    const metres = event.shiftKey ? 0.01 : 0.05;
    const turn = (event.shiftKey ? 0.2 : 1) * DEGREE;
    const moves = {
      ArrowLeft: [-metres, 0, 0],
      ArrowRight: [metres, 0, 0],
      ArrowDown: [0, -metres, 0],
      ArrowUp: [0, metres, 0],
      PageUp: [0, 0, turn],
      PageDown: [0, 0, -turn],
    };
    const move = moves[event.key];
    if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const { x, y, theta } = this.pose();
    if (this.mode === "pan") return this.panBy(-600 * move[0], 600 * move[1]);
    if (this.mode === "bet")
      return this.onBet((this.bet ?? [x, y]).map((coordinate, k) => coordinate + move[k]));
    this.onPose({ x: x + move[0], y: y + move[1], theta: theta + move[2] });
  }

  // `names` are words for the older scanner, the newer one and its knob.
  draw({ target, source, pairs, path, answer, pose, colors, names = [], below = () => {} }) {
    const [[left, right], [bottom, top]] = this.bounds;
    const full = document.fullscreenElement?.contains(this.canvas);
    const fresh = freshContext(this.canvas, (width) =>
      full ? 0.64 * innerHeight : Math.min(370, (width < 365 ? 0.72 : 0.9) * width),
    );
    if (!fresh) return;
    this.source = source;
    const { context } = fresh;
    this.whole =
      (1 - 2 * MARGIN_SHARE) *
      Math.min(fresh.width / (right - left), fresh.height / (top - bottom));
    this.look({ ...fresh, center: this.center, scale: this.zoom * this.whole });
    this.drawGrid(context, colors);
    below(context, this, colors);

    const mark = (kind, data) => drawMark(context, this, colors, [kind, data]);
    mark("older", target);
    mark(
      "passed",
      source.filter((_, i) => (i >> 1) % pairs.stride),
    ); // from afar not all are looked at
    const fate = fates(pairs);
    const endsOfPair = (i) => [
      ...pairs.source.subarray(2 * i, 2 * i + 2),
      ...pairs.target.subarray(2 * i, 2 * i + 2),
    ];
    PAIR_FATES.forEach((name, f) =>
      mark(
        name,
        Array.from(fate, (fateOfPair, i) => (fateOfPair === f ? endsOfPair(i) : [])).flat(),
      ),
    );
    if (answer) mark("answer", [answer.x, answer.y]);
    const tip = this.drawScanners(context, path, pose, colors);
    const newerScanner = this.pixel(pose.x, pose.y);
    context.textAlign = "center";
    [this.pixel(0, 0), newerScanner, tip].slice(0, names.length).forEach(([u, v], i) => {
      context.fillStyle = i ? colors.source : colors.ink;
      context.fillText(names[i], u, v + (i ? -12 : 20));
    });
    context.textAlign = "left";
  }

  // Where the older scanner stood, the way of the newer one, and the knob: where that is.
  drawScanners(context, path, pose, colors) {
    context.strokeStyle = colors.ink;
    context.lineWidth = 1.2;
    const [u0, v0] = this.pixel(0, 0);
    context.strokeRect(u0 - 5, v0 - 5, 10, 10);
    context.strokeStyle = colors.source;
    context.lineWidth = 2;
    context.beginPath();
    path.forEach(({ x, y }) => context.lineTo(...this.pixel(x, y)));
    const [u, v] = this.pixel(pose.x, pose.y);
    const tip = [u + KNOB_ARM_PX * Math.cos(pose.theta), v - KNOB_ARM_PX * Math.sin(pose.theta)];
    context.moveTo(u, v);
    context.lineTo(...tip);
    context.stroke();
    const ring = (center, radius, filling) => {
      context.fillStyle = filling;
      disc(context, ...center, radius);
      context.stroke();
    };
    const isGuess = path.length === 1; // hollow: nothing has been estimated yet
    ring(this.pixel(path[0].x, path[0].y), 5, colors.paper);
    if (!isGuess) ring([u, v], 5, colors.source);
    ring(tip, 7, colors.paper);
    if (this.bet) this.drawBet(context, colors);
    return tip;
  }

  drawBet(context, colors) {
    const [u, v] = this.pixel(...this.bet);
    rule(context, u, v, u, v - 22, colors.ink);
    context.fillStyle = colors.ink;
    context.beginPath();
    context.moveTo(u, v - 22);
    context.lineTo(u + 13, v - 17);
    context.lineTo(u, v - 12);
    context.fill();
  }
}
