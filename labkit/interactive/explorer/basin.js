// The basin of convergence: from which guesses the loop ends at the answer. It is computed,
// drawn, and one of its guesses picked, by mouse or by keyboard.

import { disc, freshContext, rule } from "./canvas.js";
import { button, choice, element } from "./controls.js";
import { failed, icp } from "./icp.js";
import { poseDifference, toXYTheta, transform } from "./se2.js";

const OUTCOMES = ["the answer", "somewhere else", "no estimate"];
const SIZE = 15;
const REACHES = [0.5, 1, 2];
const PAD = { left: 34, right: 10, top: 20, bottom: 30 };
const MARKS =
  "Each start has the heading of the guess. ● ends at the answer, × elsewhere, – without an estimate; " +
  "the square is the guess.";

// Guesses on a square grid around the answer, all with the heading of `guess`: rows from
// -reach to reach along y, columns along x.
function startGrid(answer, guess, reach, size) {
  const offset = (k) => (reach * (2 * k)) / (size - 1) - reach;
  const theta = toXYTheta(guess)[2];
  const starts = [];
  for (let row = 0; row < size; row++)
    for (let column = 0; column < size; column++)
      starts.push(transform(answer.x + offset(column), answer.y + offset(row), theta));
  return starts;
}

// What becomes of one guess, an index into OUTCOMES.
export function outcomeOf(result, answer, [metres, radians]) {
  if (failed(result.termination)) return 2;
  const [distance, angle] = poseDifference(answer, result.T_target_source);
  return distance <= metres && angle <= radians ? 0 : 1;
}

// Run the loop from every start, `slice` milliseconds at a time, and report in between, so
// that the page stays awake. Resolves to whether it came to the end.
async function exploreBasin(job, { slice = 12, stopped, report }) {
  const outcomes = new Uint8Array(job.starts.length);
  let done = 0;
  while (done < outcomes.length) {
    const until = performance.now() + slice;
    do {
      const result = icp(job.source, job.target, job.starts[done], job.parameters);
      outcomes[done++] = outcomeOf(result, job.answer, job.within);
    } while (done < outcomes.length && performance.now() < until);
    report(outcomes, done);
    await new Promise((resolve) => setTimeout(resolve));
    if (stopped()) return false;
  }
  return true;
}

// Side of a start's square in the picture, and of all of them.
function basinGeometry(width) {
  const side = (Math.min(width, 330) - PAD.left - PAD.right) / SIZE;
  return { side, span: side * SIZE };
}

// What became of each start: a disc for the answer, a cross for elsewhere, a bar for none.
function drawBasin(canvas, { outcomes, done, reach, guess, cursor, stale, colors }) {
  const fresh = freshContext(canvas, (width) => basinGeometry(width).span + PAD.top + PAD.bottom);
  if (!fresh) return;
  const { context } = fresh, { left, top } = PAD;
  const { side, span } = basinGeometry(fresh.width);
  const at = (k) => [left + ((k % SIZE) + 0.5) * side, top + span - (Math.floor(k / SIZE) + 0.5) * side];
  context.globalAlpha = stale ? 0.35 : 1;
  for (let k = 0; k < done; k++) {
    const [u, v] = at(k), r = side * 0.3;
    context.fillStyle = context.strokeStyle = [colors.kept, colors.gated, colors.soft][outcomes[k]];
    context.lineWidth = 1.5;
    if (outcomes[k] === 0) disc(context, u, v, side * 0.42);
    if (outcomes[k] === 1) rule(context, u - r, v - r, u + r, v + r), rule(context, u - r, v + r, u + r, v - r);
    if (outcomes[k] === 2) rule(context, u - r, v, u + r, v);
  }
  context.globalAlpha = 1;
  context.strokeStyle = context.fillStyle = colors.soft;
  context.lineWidth = 1;
  context.strokeRect(left, top, span, span);
  const along = (offset) => ((offset / reach) * (SIZE - 1) / 2 + SIZE / 2) * side;
  for (const tick of [-reach, 0, reach]) {
    context.textAlign = "center";
    context.fillText(tick, left + along(tick), top + span + 14);
    context.textAlign = "right";
    context.fillText(tick, left - 6, top + span - along(tick) + 4);
  }
  context.textAlign = "center";
  context.fillText("x of the guess from the answer [m]", left + span / 2, top + span + 27);
  context.textAlign = "left";
  context.fillText("y [m]", 3, 12);
  if (cursor !== null) {
    const [u, v] = at(cursor);
    context.strokeStyle = colors.source;
    context.lineWidth = 3;
    context.strokeRect(u - side / 2, v - side / 2, side, side);
  }
  context.beginPath();
  context.rect(left, top, span, span);
  context.save();
  context.clip();
  context.strokeStyle = colors.ink;
  context.lineWidth = 2.5;
  context.strokeRect(left + along(guess[0]) - 6, top + span - along(guess[1]) - 6, 12, 12);
  context.restore();
}

// The part of the explorer that computes and shows it. `job` gives {source, target, parameters,
// answer, guess, within, from, key} as things stand; `onGuess` gets the offset from the answer
// of a start that the reader picked; `onComplete` is called when all have been tried.
export class BasinPanel {
  constructor({ job, onGuess, onComplete, signal }) {
    Object.assign(this, { job, onGuess, onComplete, signal });
    this.reach = 1;
    this.run = this.cursor = null;
    this.canvas = element("canvas", {
      class: "icp-basin", role: "application", tabindex: 0, "aria-label": "Basin: not computed yet",
    });
    const listen = (type, listener) => this.canvas.addEventListener(type, listener, { signal });
    listen("click", (event) => this.click(event));
    listen("keydown", (event) => this.press(event));
    listen("blur", () => ((this.cursor = null), this.draw()));
    this.status = element("p", { class: "icp-status", role: "status" });
    this.start = button("Compute the basin", "Run the loop from a grid of guesses", () => this.toggle());
    const reach = choice({
      name: "reach", label: "offsets up to", options: REACHES.map((each) => [each, `${each} m`]),
      onValue: (value) => ((this.reach = Number(value)), this.forget()),
    });
    reach.set(this.reach);
    this.node = element(
      "details", { class: "icp-more" },
      element("summary", {}, "Basin of convergence: from which guesses does the run find the answer?"),
      element("div", { class: "icp-row" }, this.start, reach.node), this.canvas, this.status,
    );
    this.node.addEventListener("toggle", () => this.draw(), { signal });
    this.forget();
  }

  forget() {
    if (this.run) this.run.stopped = true;
    this.run = this.cursor = null;
    this.canvas.hidden = true;
    this.tell();
  }

  // Whether what the picture shows still belongs to the sliders, which may be moved back.
  outdate(key) {
    if (!this.run) return;
    this.run.stale = this.run.key !== key;
    this.run.stopped ||= this.run.stale;
    this.tell();
  }

  running() {
    return this.run && !this.run.stopped && !this.run.complete;
  }

  // How far the basin reaches that is shown whole and still belongs to the sliders; null without one.
  completed() {
    return this.run?.complete && !this.run.stale ? this.reach : null;
  }

  // The words for how things stand, written only where they change: a screen reader speaks them.
  tell() {
    let said = this.run?.found ?? MARKS;
    if (this.run?.stale) said = "Parameters, heading or scene have changed since.";
    if (this.status.textContent !== said) this.status.textContent = said;
    this.start.textContent = this.running() ? "Stop" : this.run ? "Compute again" : "Compute the basin";
  }

  async toggle() {
    if (this.running()) {
      this.run.stopped = true;
      return this.tell();
    }
    const job = this.job();
    const run = { key: job.key, outcomes: new Uint8Array(SIZE * SIZE), done: 0, stopped: false, stale: false };
    this.run = run;
    this.canvas.hidden = false;
    this.tell();
    const starts = startGrid(job.answer, job.guess, this.reach, SIZE);
    const report = (outcomes, done) => {
      Object.assign(run, { outcomes, done });
      if (this.run === run) this.draw();
    };
    run.complete = await exploreBasin(
      { ...job, starts }, { stopped: () => run.stopped || this.signal.aborted, report },
    );
    if (this.run !== run || !run.complete) return;
    const reached = run.outcomes.filter((each) => each === 0).length;
    const said = `${reached} of ${run.done} guesses end within ${job.within[0]} m of the ${job.from}.`;
    this.onComplete();
    run.found = `${said} Click one to start there, or move by arrow keys and press Enter.`;
    this.tell();
    this.canvas.setAttribute("aria-label", `Basin of convergence: ${said} Arrow keys move, Enter starts there.`);
  }

  draw(colors = this.colors) {
    this.colors = colors;
    if (!this.run || !colors) return;
    const { answer, guess } = this.job();
    const offset = [guess.x - answer.x, guess.y - answer.y];
    drawBasin(this.canvas, { ...this.run, reach: this.reach, guess: offset, cursor: this.cursor, colors });
  }

  pick(column, row) {
    const offset = (k) => (this.reach * 2 * k) / (SIZE - 1) - this.reach;
    this.onGuess(offset(column), offset(row));
  }

  click(event) {
    const { side } = basinGeometry(this.canvas.clientWidth);
    const column = Math.floor((event.offsetX - PAD.left) / side);
    const row = SIZE - 1 - Math.floor((event.offsetY - PAD.top) / side);
    if (Math.min(row, column) >= 0 && Math.max(row, column) < SIZE) this.pick(column, row);
  }

  // A cursor over the starts: it says what became of each, and Enter starts there.
  press(event) {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1] };
    const here = this.cursor ?? (SIZE * SIZE - 1) / 2;
    const column = here % SIZE, row = Math.floor(here / SIZE);
    if (event.key === "Enter" && this.cursor !== null) this.pick(column, row);
    else if (moves[event.key]) {
      const within = (k) => Math.max(0, Math.min(SIZE - 1, k));
      const [right, up] = moves[event.key];
      this.cursor = within(row + up) * SIZE + within(column + right);
      const found = this.cursor < this.run.done ? OUTCOMES[this.run.outcomes[this.cursor]] : "not computed";
      this.status.textContent = `This start ends at: ${found}. Enter starts there.`;
      this.draw();
    } else return;
    event.preventDefault();
  }
}
