// The marks of all widgets: apart in shape or dash as well as in colour, as in labkit.plotting.

import { ROBOT_RADIUS_M } from "./driving/world.js";
import { cross, diamond, dot, plus, ring, speck, square, triangle } from "./explorer/canvas.js";
import { element } from "./explorer/controls.js";

const points = (marker) => (context, frame, data) => {
  for (let i = 0; i < data.length; i += 2) marker(context, ...frame.pixel(data[i], data[i + 1]));
};

// Two places [x, y] each: the ends of a line, or two corners of a cell.
const segments = (context, frame, data) => {
  for (let i = 0; i < data.length; i += 4) {
    context.moveTo(...frame.pixel(data[i], data[i + 1]));
    context.lineTo(...frame.pixel(data[i + 2], data[i + 3]));
  }
};
const cells = (context, frame, data) => {
  for (let i = 0; i < data.length; i += 4) {
    const [u, v] = frame.pixel(data[i], data[i + 1]);
    const [right, top] = frame.pixel(data[i + 2], data[i + 3]);
    context.rect(u, v, right - u, top - v);
  }
};
const outline = (context, frame, data) => {
  for (let i = 0; i < data.length; i += 2) context.lineTo(...frame.pixel(data[i], data[i + 1]));
};
// A robot: a drop that points ahead.
const drop = (context, frame, [x, y, theta]) => {
  const [u, v] = frame.pixel(x, y);
  const r = Math.max(7, ROBOT_RADIUS_M * frame.scale);
  context.arc(u, v, r, 0.8 - theta, 2 * Math.PI - 0.8 - theta);
  context.lineTo(u + 1.45 * r * Math.cos(theta), v - 1.45 * r * Math.sin(theta));
  context.closePath();
};
const circle = (context, frame, [x, y, radius]) =>
  context.arc(...frame.pixel(x, y), radius * frame.scale, 0, 2 * Math.PI);

// How each kind is drawn, and its sign in the legend; `fill` is how opaque its inside is, and `end`
// the marker at the first end of each segment.
const MARK_KINDS = {
  gated: { path: segments, color: "gated", sign: "··×", dash: [1.5, 2.5], end: cross },
  trimmed: { path: segments, color: "trimmed", sign: "--□", dash: [5, 3], end: square },
  "no line": { path: segments, color: "noline", sign: "-·◇", dash: [5, 2, 1, 2], end: diamond },
  "down-weighted": {
    path: segments,
    color: "down",
    sign: "-·▲",
    dash: [6, 2, 1, 2],
    end: triangle,
    fill: 1,
  },
  kept: { path: segments, color: "kept", sign: "—●", end: dot, fill: 1 },
  passed: { path: points(speck), color: "soft", sign: "·", fill: 1, width: 0.1 },
  scanner: { color: "ink", sign: "□" },
  now: { color: "source", sign: "●—○" },
  answer: { path: points(plus), color: "ink", sign: "+", dash: [3, 2] },
  bet: { color: "ink", sign: "⚑" },
  older: { path: points(speck), color: "target", sign: "▪", fill: 1 },
  newer: { path: points(ring), color: "source", sign: "○" },
  robot: { path: drop, color: "source", sign: "●", fill: 0.85, width: 2 },
  ghost: { path: drop, color: "reference", sign: "◌", fill: 0.25, width: 2, dash: [4, 3] },
  rival: { path: drop, color: "method-1", sign: "◌", fill: 0.25, width: 2, dash: [2, 2] },
  scan: { path: points(speck), color: "target", sign: "▪", fill: 0.35, width: 0.1 },
  wall: { path: segments, color: "soft", sign: "—" },
  seen: { path: points(speck), color: "source", sign: "▪", fill: 1 },
  view: { path: outline, color: "source", sign: "◣", fill: 0.12, width: 0.2 },
  way: { path: segments, color: "source", sign: "—", width: 2 },
  pair: { path: segments, color: "soft", sign: "—" },
  pull: { path: segments, color: "gated", sign: "→", width: 3 },
  stray: { path: segments, color: "gated", sign: "- -", dash: [6, 4], width: 2 },
  after: { path: points(plus), color: "kept", sign: "+", width: 2 },
  before: { path: points(cross), color: "ink", sign: "×", width: 1.5 },
  cell: { path: cells, color: "soft", sign: "□" },
  open: { path: cells, color: "kept", sign: "▨", fill: 0.3, width: 1.5 },
  reach: { path: circle, color: "kept", sign: "◌", dash: [5, 3], width: 1.5 },
  query: { path: points(diamond), color: "source", sign: "◆", fill: 1 },
};

export function drawMark(context, frame, colors, [kind, data]) {
  const { path, color, dash = [], width = 1, fill = 0, end } = MARK_KINDS[kind];
  const paint = () => {
    context.globalAlpha = fill;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
  };
  context.strokeStyle = context.fillStyle = colors[color];
  context.lineWidth = width;
  context.setLineDash(dash);
  context.beginPath();
  path(context, frame, data);
  paint();
  if (fill) context.lineWidth = 0.1;
  for (let i = 0; end && i < data.length; i += 4)
    end(context, ...frame.pixel(data[i], data[i + 1]));
  paint();
}

// What kinds of marks stand for: [kind, words] each.
export function legendOf(entries) {
  const signs = entries.map(([kind, words]) => {
    const { sign, color } = MARK_KINDS[kind];
    return element(
      "span",
      {},
      element("b", { style: `color: var(--icp-${color})`, "aria-hidden": "true" }, sign),
      ` ${words}`,
    );
  });
  return element("p", { class: "icp-legend" }, ...signs);
}
