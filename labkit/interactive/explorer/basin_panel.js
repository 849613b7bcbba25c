// The part of the explorer that computes and shows the basin of convergence.

import { exploreBasin, startGrid } from "./basin.js";
import { basinGeometry, drawBasin } from "./charts.js";
import { button, choice, element } from "./controls.js";

const SIZE = 15;
const REACHES = [0.5, 1, 2];
const LEGEND =
  "Each start has the heading of the guess. ● ends at the answer, × elsewhere, – without an estimate.";

export class BasinPanel {
  // `job` gives {source, target, parameters, answer, guess, within, from} as things stand;
  // `onGuess` gets the offset from the answer of a start that the reader picked.
  constructor({ job, onGuess, signal }) {
    this.job = job;
    this.onGuess = onGuess;
    this.signal = signal;
    this.reach = 1;
    this.run = null;
    this.canvas = element("canvas", { class: "icp-basin", role: "img", "aria-label": "Basin: not computed yet" });
    this.canvas.addEventListener("click", (event) => this.pick(event), { signal });
    this.status = element("p", { class: "icp-status", role: "status" });
    this.start = button("Compute the basin", "Run the loop from a grid of guesses", () => this.toggle());
    const reach = choice({
      name: "reach", label: "offsets up to", options: REACHES.map((each) => [each, `${each} m`]),
      onValue: (value) => ((this.reach = Number(value)), this.forget()),
    });
    reach.set(this.reach);
    this.node = element(
      "section", { class: "icp-panel", "aria-label": "Basin of convergence" },
      element("h4", {}, "Basin of convergence"),
      element("div", { class: "icp-row" }, this.start, reach.node), this.canvas, this.status,
    );
    this.forget();
  }

  forget() {
    if (this.run) this.run.stopped = true;
    this.run = null;
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

  // The words for how things stand, written only where they change: a screen reader speaks them.
  tell() {
    let said = this.run?.found ?? LEGEND;
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
    run.found = `${said} Click one to start there.`;
    this.tell();
    this.canvas.setAttribute("aria-label", `Basin of convergence: ${said}`);
  }

  draw(colors = this.colors) {
    this.colors = colors;
    if (!this.run) return;
    const { answer, guess } = this.job();
    const offset = [guess.x - answer.x, guess.y - answer.y];
    drawBasin(this.canvas, { ...this.run, size: SIZE, reach: this.reach, guess: offset, colors });
  }

  pick(event) {
    const { side, left, top } = basinGeometry(this.canvas.clientWidth, SIZE);
    const column = Math.floor((event.offsetX - left) / side);
    const row = SIZE - 1 - Math.floor((event.offsetY - top) / side);
    if (Math.min(row, column) < 0 || Math.max(row, column) >= SIZE) return;
    const offset = (k) => (this.reach * 2 * k) / (SIZE - 1) - this.reach;
    this.onGuess(offset(column), offset(row));
  }
}
