// The cost over the iterations, or another positive quantity over what was done.

import { disc, freshContext, rule } from "./canvas.js";

const LEFT = 46, RIGHT = 10, TOP = 18, BOTTOM = 20;

// The costs on a log scale, with a mark at the one that is shown; `title` says of what.
export function drawCost(canvas, { costs, shown, colors, title = "cost J [m²] over the iterations" }) {
  const fresh = freshContext(canvas, (width) => Math.min(120, 0.4 * width));
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
  context.textAlign = "left";
  context.fillText(title, 3, 12);

  context.strokeStyle = context.fillStyle = colors.kept;
  context.lineWidth = 1.5;
  context.beginPath();
  costs.forEach((cost, k) => context[k ? "lineTo" : "moveTo"](u(k), v(cost)));
  context.stroke();
  costs.forEach((cost, k) => disc(context, u(k), v(cost), 2.2));
  context.strokeStyle = colors.source;
  context.lineWidth = 2.5;
  context.beginPath();
  context.arc(u(shown), v(costs[shown]), 6, 0, 2 * Math.PI);
  context.stroke();
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
