// The cost over the iterations, and the basin of convergence.

import { freshContext } from "./palette.js";

const LEFT = 46, RIGHT = 10, TOP = 20, BOTTOM = 30;

// The cost J on a log scale, with a mark at the iteration that is shown.
export function drawCost(canvas, { costs, shown, colors }) {
  const fresh = freshContext(canvas, 0.55);
  if (!fresh) return;
  const { context, width, height } = fresh;
  const positive = costs.filter((each) => each > 0).map(Math.log10);
  const low = Math.min(...positive, -1), high = Math.max(...positive, low + 0.1);
  const margin = 0.08 * (high - low), last = Math.max(1, costs.length - 1);
  const u = (k) => LEFT + (k / last) * (width - LEFT - RIGHT);
  const v = (cost) => {
    const share = cost > 0 ? (Math.log10(cost) - low + margin) / (high - low + 2 * margin) : 0;
    return height - BOTTOM - share * (height - TOP - BOTTOM);
  };

  drawFrame(context, width, height, colors);
  context.textAlign = "right";
  for (const tick of logTicks(low - margin, high + margin)) {
    context.fillText(tick < 1e-3 ? tick.toExponential(0) : String(tick), LEFT - 6, v(tick) + 4);
    rule(context, LEFT, v(tick), width - RIGHT, v(tick), colors.grid);
  }
  context.textAlign = "center";
  for (const k of countTicks(costs.length - 1)) context.fillText(k, u(k), height - BOTTOM + 14);
  context.fillText("iteration", (LEFT + width - RIGHT) / 2, height - 3);
  context.textAlign = "left";
  context.fillText("cost J [m²]", 3, 12);

  context.strokeStyle = context.fillStyle = colors.kept;
  context.lineWidth = 1.5;
  context.beginPath();
  costs.forEach((cost, k) => context[k ? "lineTo" : "moveTo"](u(k), v(cost)));
  context.stroke();
  costs.forEach((cost, k) => disc(context, u(k), v(cost), 2.2));
  context.strokeStyle = colors.accent;
  context.lineWidth = 2.5;
  context.beginPath();
  context.arc(u(shown), v(costs[shown]), 6, 0, 2 * Math.PI);
  context.stroke();
}

// Square side and centre of each start in the basin's picture, and back.
export function basinGeometry(width, size) {
  const side = (Math.min(width, 340) - LEFT - RIGHT) / size;
  return { side, left: LEFT, top: TOP, span: side * size };
}

// What became of each start: a disc for the answer, a cross for elsewhere, a bar for none.
export function drawBasin(canvas, { outcomes, done, size, reach, guess, stale, colors }) {
  const { span: wanted } = basinGeometry(canvas.clientWidth, size);
  const fresh = freshContext(canvas, (wanted + TOP + BOTTOM) / Math.max(1, canvas.clientWidth));
  if (!fresh) return;
  const { context, width } = fresh;
  const { side, left, top, span } = basinGeometry(width, size);
  const center = (k) => ((k + 0.5) * side);
  context.globalAlpha = stale ? 0.35 : 1;
  for (let k = 0; k < done; k++) {
    const u = left + center(k % size), v = top + span - center(Math.floor(k / size)), r = side * 0.3;
    context.fillStyle = context.strokeStyle = [colors.kept, colors.gated, colors.soft][outcomes[k]];
    context.lineWidth = 1.5;
    if (outcomes[k] === 0) disc(context, u, v, side * 0.42);
    if (outcomes[k] === 1) rule(context, u - r, v - r, u + r, v + r), rule(context, u - r, v + r, u + r, v - r);
    if (outcomes[k] === 2) rule(context, u - r, v, u + r, v);
  }
  context.globalAlpha = 1;
  context.strokeStyle = colors.soft;
  context.lineWidth = 1;
  context.strokeRect(left, top, span, span);
  const at = (offset) => ((offset / reach) * (size - 1) / 2 + (size - 1) / 2 + 0.5) * side;
  context.fillStyle = colors.soft;
  for (const tick of [-reach, 0, reach]) {
    context.textAlign = "center";
    context.fillText(tick, left + at(tick), top + span + 14);
    context.textAlign = "right";
    context.fillText(tick, left - 6, top + span - at(tick) + 4);
  }
  context.textAlign = "center";
  context.fillText("x of the guess from the answer [m]", left + span / 2, top + span + 27);
  context.textAlign = "left";
  context.fillText("y [m]", 3, 12);
  context.beginPath();
  context.rect(left, top, span, span);
  context.save();
  context.clip();
  context.strokeStyle = colors.ink;
  context.lineWidth = 2.5;
  context.strokeRect(left + at(guess[0]) - 6, top + span - at(guess[1]) - 6, 12, 12);
  context.restore();
}

function drawFrame(context, width, height, colors) {
  rule(context, LEFT, height - BOTTOM, width - RIGHT, height - BOTTOM, colors.soft);
  rule(context, LEFT, TOP, LEFT, height - BOTTOM, colors.soft);
  context.fillStyle = colors.soft;
}

// 1, 2 and 5 times powers of ten between two logarithms; fewer where there are many.
function logTicks(low, high) {
  const factors = high - low > 1.5 ? [1] : high - low > 0.6 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8];
  const ticks = [];
  for (let power = Math.floor(low); power <= high; power++)
    for (const factor of factors) {
      const tick = Number((factor * 10 ** power).toPrecision(2));
      if (Math.log10(tick) >= low && Math.log10(tick) <= high) ticks.push(tick);
    }
  return ticks;
}

function countTicks(last) {
  const step = [1, 2, 5, 10, 20].find((each) => last / each <= 7) ?? 50;
  return Array.from({ length: Math.floor(last / step) + 1 }, (_, i) => i * step);
}

function rule(context, u0, v0, u1, v1, color = null) {
  if (color) {
    context.strokeStyle = color;
    context.lineWidth = 1;
  }
  context.beginPath();
  context.moveTo(u0, v0);
  context.lineTo(u1, v1);
  context.stroke();
}

function disc(context, u, v, r) {
  context.beginPath();
  context.arc(u, v, r, 0, 2 * Math.PI);
  context.fill();
}
