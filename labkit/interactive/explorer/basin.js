// The basin of convergence: from which guesses the loop ends at the answer. The runs are computed
// here, and then walk over the map together, an iteration a beat.

import { disc, rule, tween } from "./canvas.js";
import { button, choice, element } from "./controls.js";
import { icp } from "./icp.js";
import { failed } from "./result.js";
import { DEGREE, poseDifference, toXYTheta, transform } from "./se2.js";

const OUTCOME_WORDS = ["finds the answer", "ends elsewhere", "gets no estimate"];
const FOUND_WITHIN_M_RAD = [0.1, 2 * DEGREE]; // m and rad from the answer
const GRID_SIDE_COUNT = 15;
const REACHES_M = [0.5, 1, 2];
const WORK_SLICE_MS = 12; // ms of work, then the page is awake again
const SWARM_STEP_MS = 60; // ms that an iteration of the swarm takes

// What becomes of one guess, an index into OUTCOME_WORDS.
export function outcomeOf(result, answer) {
  if (failed(result.termination)) return 2;
  const [distance, angle] = poseDifference(answer, result.T_target_source);
  return distance <= FOUND_WITHIN_M_RAD[0] && angle <= FOUND_WITHIN_M_RAD[1] ? 0 : 1;
}

// The part of the explorer that computes it. `job` gives {source, target, parameters, answer,
// guess, from, key} as things stand; `changed` is called when there is more to see.
export class Basin {
  constructor({ job, changed, signal }) {
    Object.assign(this, { job, changed, signal });
    this.reach = 1;
    this.status = element("p", { class: "icp-status", role: "status" });
    this.start = button(
      "Compute the basin",
      "Run the loop from a grid of guesses around the answer",
      () => this.toggle(),
    );
    const reach = choice({
      name: "reach",
      label: "up to",
      options: REACHES_M.map((metres) => [metres, `${metres} m`]),
      onValue: (value) => {
        this.reach = Number(value);
        return this.forget();
      },
    });
    reach.set(this.reach);
    this.node = element("div", { class: "icp-row icp-basin" }, this.start, reach.node, this.status);
    this.forget();
  }

  forget() {
    if (this.run) this.run.stopped = true;
    this.walking?.stop();
    this.run = null;
    this.tell();
    this.changed();
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
    const { complete, stale, outcomes, job } = this.run ?? {};
    let message = "";
    if (stale) message = "Parameters, heading or scene have changed since.";
    else if (complete) {
      const foundCount = outcomes.filter((outcome) => outcome === 0).length;
      const [metres] = FOUND_WITHIN_M_RAD;
      const share = `${foundCount} of ${outcomes.length}`;
      message = `${share} guesses end within ${metres} m of the ${job.from}.`;
    }
    if (this.status.textContent !== message) this.status.textContent = message;
    this.start.textContent = this.running()
      ? "Stop"
      : this.run
        ? "Compute again"
        : "Compute the basin";
  }

  // Run the loop from every start, a slice of time after the other, so that the page stays awake.
  async toggle() {
    if (this.running()) {
      this.run.stopped = true;
      return this.tell();
    }
    const job = this.job();
    const theta = toXYTheta(job.guess)[2];
    const step = (2 * this.reach) / (GRID_SIDE_COUNT - 1);
    const run = {
      job,
      key: job.key,
      step,
      outcomes: new Uint8Array(GRID_SIDE_COUNT * GRID_SIDE_COUNT),
      paths: [],
      done: 0,
      at: 0,
    };
    this.run = run;
    this.tell();
    while (run.done < run.outcomes.length) {
      const until = performance.now() + WORK_SLICE_MS;
      do {
        const [x, y] = placeOf(run, run.done);
        const start = transform(x, y, theta);
        const result = icp(job.source, job.target, start, job.parameters);
        run.paths.push(result.history.map((iteration) => iteration.T_target_source));
        run.outcomes[run.done++] = outcomeOf(result, job.answer);
      } while (run.done < run.outcomes.length && performance.now() < until);
      this.changed();
      await new Promise((resolve) => setTimeout(resolve));
      if (run.stopped || this.signal.aborted) return;
    }
    run.complete = true;
    this.tell();
    const longest = Math.max(...run.paths.map((path) => path.length - 1));
    this.walking = tween(
      longest,
      (at) => {
        run.at = Math.floor(at);
        return this.changed();
      },
      { pace: SWARM_STEP_MS },
    );
  }

  // What becomes of the guess, in words; empty where that is not known.
  of(x, y) {
    if (!this.run?.complete || this.run.stale) return "";
    const { job, step, outcomes } = this.run;
    const half = (GRID_SIDE_COUNT - 1) / 2;
    const [column, row] = [x - job.answer.x, y - job.answer.y].map(
      (distance) => Math.round(distance / step) + half,
    );
    return Math.min(column, row) < 0 || Math.max(column, row) >= GRID_SIDE_COUNT
      ? ""
      : OUTCOME_WORDS[outcomes[row * GRID_SIDE_COUNT + column]];
  }

  // The swarm; and where a run has ended, its start: a tile for the answer, one with a cross for
  // elsewhere, a bar for none.
  draw(context, frame, colors) {
    if (!this.run) return;
    const { step, outcomes, paths, at, done, stale } = this.run;
    const side = step * frame.scale;
    const r = Math.min(4, 0.25 * side);
    for (let k = 0; k < done; k++) {
      const [u, v] = frame.pixel(...placeOf(this.run, k));
      const outcome = outcomes[k];
      const path = paths[k];
      const ended = at >= path.length - 1;
      const color = ended
        ? [colors["method-2"], colors["method-1"], colors.soft][outcome]
        : colors.source;
      const { x, y } = path[ended ? path.length - 1 : at];
      context.fillStyle = color;
      context.globalAlpha = stale ? 0.15 : 0.6;
      disc(context, ...frame.pixel(x, y), 2.5);
      if (!ended) continue;
      context.globalAlpha = stale ? 0.05 : [0.3, 0.18, 0.12][outcome];
      context.fillRect(u - side / 2, v - side / 2, side, side);
      context.globalAlpha = stale ? 0.15 : 0.7;
      if (outcome)
        rule(
          context,
          u - r,
          v - (outcome === 1 ? r : 0),
          u + r,
          v + (outcome === 1 ? r : 0),
          color,
        );
      if (outcome === 1) rule(context, u - r, v + r, u + r, v - r, color);
    }
    context.globalAlpha = 1;
  }
}

// Where the k-th guess stands: rows along y, columns along x, around the answer.
function placeOf({ job: { answer }, step }, k) {
  const half = (GRID_SIDE_COUNT - 1) / 2;
  return [
    answer.x + ((k % GRID_SIDE_COUNT) - half) * step,
    answer.y + (Math.floor(k / GRID_SIDE_COUNT) - half) * step,
  ];
}
