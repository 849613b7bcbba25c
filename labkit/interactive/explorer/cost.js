// Positive numbers over what was done: the cost over the iterations, or what else falls.

import { disc, freshContext, rule } from "./canvas.js";

export const MAX_TRAIL_COUNT = 150; // numbers that a curve remembers of what was done by hand
const RIGHT_PX = 12;
const TOP_PX = 24;
const BOTTOM_PX = 22;
const PADDING_PX = 9; // px; so much lie the curves within the frame

// The costs on a log scale, with a ring at the one that is shown. More than one series are two
// methods'; `lastIndex` is that of the right end.
export function drawCost(
  canvas,
  {
    series,
    shown,
    colors,
    lastIndex = series[0].length - 1,
    title = "cost J [m²] over the iterations",
  },
) {
  const fresh = freshContext(canvas, (width) => Math.min(130, 0.42 * width));
  if (!fresh) return;
  const { context, width, height } = fresh;
  const positive = series
    .flat()
    .filter((number) => number > 0)
    .map(Math.log10);
  let low = Math.min(...positive);
  let high = Math.max(...positive);
  if (!positive.length) [low, high] = [-1, 0];
  if (high - low < 0.3) [low, high] = [(low + high) / 2 - 0.15, (low + high) / 2 + 0.15];
  const room = Math.max(
    2,
    Math.floor((height - TOP_PX - BOTTOM_PX) / (1.6 * parseFloat(context.font))),
  );
  const ticks = logTicks(low, high, room);
  const name = nameFor(ticks);
  const left = 10 + Math.max(...ticks.map((tick) => context.measureText(name(tick)).width));
  const u = (k) =>
    left + PADDING_PX + (k / Math.max(1, lastIndex)) * (width - left - RIGHT_PX - 2 * PADDING_PX);
  const v = (cost) => {
    const share = cost > 0 ? (Math.log10(cost) - low) / (high - low) : 0;
    return height - BOTTOM_PX - PADDING_PX - share * (height - TOP_PX - BOTTOM_PX - 2 * PADDING_PX);
  };

  rule(context, left, height - BOTTOM_PX, width - RIGHT_PX, height - BOTTOM_PX, colors.soft);
  rule(context, left, TOP_PX, left, height - BOTTOM_PX, colors.soft);
  context.fillStyle = colors.soft;
  context.textAlign = "right";
  for (const tick of ticks) {
    context.fillText(name(tick), left - 5, v(tick) + 4);
    rule(context, left, v(tick), width - RIGHT_PX, v(tick), colors.grid);
  }
  context.textAlign = "center";
  const step = [1, 2, 5, 10, 20, 50].find((count) => lastIndex / count <= 7) ?? 100;
  for (let k = 0; k <= lastIndex; k += step) context.fillText(k, u(k), height - BOTTOM_PX + 15);
  context.textAlign = "left";
  context.textBaseline = "top";
  context.fillText(title, 3, 2, width - 6);

  series.forEach((costs, i) => {
    context.strokeStyle = context.fillStyle =
      series.length > 1 ? colors[`method-${i + 1}`] : colors.source;
    context.lineWidth = 1.5;
    context.setLineDash(i ? [5, 3] : []);
    context.beginPath();
    costs.forEach((cost, k) => context[k ? "lineTo" : "moveTo"](u(k), v(cost)));
    context.stroke();
    context.setLineDash([]);
    costs.forEach((cost, k) => disc(context, u(k), v(cost), 2));
    const at = Math.min(shown, costs.length - 1);
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(u(at), v(costs[at]), 5.5, 0, 2 * Math.PI);
    context.stroke();
  });
}

// Round numbers between two logarithms, two at least, or the two ends.
function logTicks(low, high, room) {
  for (const factors of [[1], [1, 2, 5], [1, 1.5, 2, 3, 4, 5, 6, 7, 8]]) {
    const ticks = [];
    for (let power = Math.floor(low); power <= high; power++)
      for (const factor of factors) {
        const tick = Number((factor * 10 ** power).toPrecision(2));
        if (Math.log10(tick) >= low && Math.log10(tick) <= high) ticks.push(tick);
      }
    if (ticks.length > 1) return ticks.filter((_, i) => i % Math.ceil(ticks.length / room) === 0);
  }
  return [low, high].map((power) => Number((10 ** power).toPrecision(2)));
}

// One way to write all ticks.
function nameFor(ticks) {
  return Math.min(...ticks) < 1e-3 ? (tick) => tick.toExponential().replace("-", "−") : String;
}
