// The explorer: state from the model, one update a frame, and the parts put together.
//
// The model is the widget's state. In JupyterLab it is tied to Python, in a page to nothing.

import { Basin } from "./basin.js";
import { HandView } from "./by_hand.js";
import { palette, tween } from "./canvas.js";
import {
  PARAMETERS,
  button,
  element,
  guessSliders,
  parameterControls,
  part,
  slider,
  steps,
  toggle,
} from "./controls.js";
import { drawCost } from "./cost.js";
import { pairsAt } from "./correspondences.js";
import { icp } from "./icp.js";
import { MAX_ZOOM, Plane } from "./plane.js";
import { Readouts, outcome } from "./readouts.js";
import { unpacked } from "./scene.js";
import { apply, between, toXYTheta, transform } from "./se2.js";
import {
  copyState,
  isPage,
  keepState,
  keptState,
  stateFromAddress,
  storeBet,
  storedBet,
} from "./state.js";
import { View, widgetOf } from "./view.js";

const PLAY_STEP_MS = 350;
const MAX_RUN_MS = 6000; // ms that an iteration takes, and a run
const MOTION_MS = 100; // ms of an iteration in which the scan moves
const SAVE_DELAY_MS = 120; // ms after which the browser keeps the state
const EXPLORER_KEYS_HINT =
  "Arrow keys move the guess by 5 cm, Page Up and Page Down turn it by 1°; with Shift finer.";
const DRAG_HINT = "Drag the scan, or its knob to turn it.";
const BET_HINT =
  "Where will the run end? Click on the map, or move the flag by arrow keys; then play.";

class ExplorerView extends View {
  constructor(model, signal) {
    super(model, signal);
    this.compact = model.get("form") === "sliders";
    this.build();
    this.live();
    this.follow([...PARAMETERS, "guess"]);
    this.follow(["scene"], () => this.enter());
    const linked = !this.compact && stateFromAddress(this.names());
    const givenState = linked || (!this.compact && keptState(this.names()));
    if (givenState) this.set(givenState.values);
    this.enter();
    if (!linked) return;
    this.shown = linked.shown;
    setTimeout(() => this.root.scrollIntoView({ block: "center" }), 300);
  }

  leave() {
    this.playing?.stop();
    this.basin.forget();
  }

  build() {
    const values = this.model.get("sliders");
    this.controls = parameterControls({
      values: values ?? {},
      scenes: this.names(),
      onScene: (name) => this.choose(name),
      onValue: (name) => (value) => this.set({ [name]: value }),
    });
    const place = (guess) => {
      this.stop();
      this.set({ guess });
      return this.request();
    };
    const move = this.compact ? place : (guess) => this.move(guess);
    this.guess = guessSliders({ values, guess: () => this.model.get("guess"), move });
    this.plane = new Plane({
      label: `Map of both scans. ${EXPLORER_KEYS_HINT}`,
      signal: this.signal,
      pose: () => this.pose(),
      onPose: ({ x, y, theta }) => this.move([x, y, theta]),
      onBet: (place) => this.bet(place),
      onView: () => this.request(),
    });
    this.play = button("Play", "Show one iteration after the other", () => this.togglePlay());
    const read = (k) => `${k} of ${this.last()}`;
    const onValue = (k) => this.show(k);
    this.scrubber = slider({ name: "iteration", label: "iteration", values: [0], read, onValue });
    this.cost = element("canvas", { class: "icp-cost", role: "img" });
    this.readouts = new Readouts(this.signal);
    this.basin = new Basin({
      job: () => this.basinJob(),
      signal: this.signal,
      changed: () => this.request(),
    });
    this.said = element("p", { class: "icp-status", role: "status" });
    this.assemble();
  }

  enlarge() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.root.requestFullscreen?.().catch(() => {});
  }

  names() {
    return this.model.get("scene_data").map(({ name }) => name);
  }

  // The map and what belongs to it on the left, sliders and numbers on the right.
  assemble() {
    const { scene, metric, approach, ...sliders } = this.controls;
    this.start = button("Start", "Show the first guess", () => this.show(0));
    this.step = button("Step", "Show the next iteration", () => this.walk(this.number() + 1));
    this.end = button("End", "Show the result", () => this.show(this.last()));
    this.nearer = button("+", "Zoom in", () => this.plane.zoomBy(1.6));
    this.farther = button("−", "Zoom out", () => this.plane.zoomBy(1 / 1.6));
    const mode = (name, text, title) =>
      toggle(text, title, () => this.setMode(this.plane.mode === name ? "move" : name));
    this.modes = {
      pan: mode("pan", "Pan", "Drag the view, not the scan"),
      bet: mode("bet", "Bet", BET_HINT),
    };
    const reset = button("Reset", "Guess, parameters and view as at first", () => this.reset());
    const copy = button("Copy state", "Copy a link to what is shown", () =>
      copyState(this.model, this.number()).then((message) => (this.said.textContent = message)),
    );
    const shown = Object.keys(this.model.get("sliders") ?? sliders);
    const { set, ...guess } = this.guess;
    const rows = shown.map((name) => sliders[name]?.node ?? guess[name]);
    const full = button("Full screen", "Larger, for a lecture", () => this.enlarge());
    const { sentence, numbers, legend, ending, spoken } = this.readouts;
    const tools = [this.nearer, this.farther, this.modes.pan.node];
    if (this.compact) tools.push(reset);
    else tools.push(this.modes.bet.node, reset, ...(isPage() ? [copy] : []));
    const map = part("left", this.plane.canvas, part("row", ...tools), legend, this.said);
    const playing = part("row", this.start, this.step, this.play, this.end);
    const run = this.model.get("runs") ? [playing, this.scrubber.node] : [];
    const more = this.compact ? [] : [approach.node, ...Object.values(guess)];
    const side = part(
      "right",
      part("sliders", ...rows, ...more),
      part("run", ...run),
      sentence,
      numbers,
      spoken,
    );
    if (!this.compact) {
      side.append(this.cost);
      map.append(this.basin.node);
    }
    const top = this.compact ? [] : [part("top", scene.node, metric.node, full)];
    this.root = element(
      "div",
      {
        class: `icp-explorer${this.compact ? " icp-compact" : ""}`,
        role: "group",
        "aria-label": this.model.get("label"),
      },
      part("frame", ...top, map, side, ending),
    );
  }

  // ---- what the reader does

  set(values) {
    for (const [name, value] of Object.entries(values)) this.model.set(name, value);
    clearTimeout(this.keeping);
    if (!this.compact) this.keeping = setTimeout(() => keepState(this.model), SAVE_DELAY_MS);
    this.sync();
  }

  choose(name) {
    const { guess } = this.model.get("scene_data").find((scene) => scene.name === name);
    this.set({ scene: name, guess });
  }

  move([x, y, theta]) {
    this.stop();
    this.shown = 0;
    this.set({ guess: [...this.plane.onMap(x, y), Math.atan2(Math.sin(theta), Math.cos(theta))] });
    this.request();
  }

  bet(place) {
    this.plane.bet = place;
    storeBet(this.scene, place);
    this.request();
  }

  reset() {
    storeBet(this.scene, null);
    const firstParameters = this.model.get("first_parameters");
    this.set(Object.fromEntries(PARAMETERS.map((name) => [name, firstParameters[name]])));
    this.choose(this.model.get("scene"));
    this.enter();
  }

  setMode(name) {
    this.plane.mode = name;
    if (name === "bet") {
      this.show(0);
      if (!this.plane.bet) this.bet(this.model.get("guess").slice(0, 2));
      this.plane.canvas.focus({ preventScroll: true });
    }
    this.said.textContent = { move: DRAG_HINT, pan: "Drag the view.", bet: BET_HINT }[name];
    this.request();
  }

  // The last iteration stays the last one when a slider makes the run longer.
  show(k) {
    this.stop();
    this.shown = k >= this.last() ? null : k;
    if (k >= this.last()) this.told = true;
    if (k > 0) this.setMode("move");
    this.request();
    this.readouts.speak({ result: this.result, told: this.isTold(), ...this.reference() });
  }

  // Go on to an iteration, each in a short motion.
  walk(target, pace = MOTION_MS) {
    this.stop();
    this.setMode("move");
    const start = this.number();
    this.shown = start;
    this.playing = tween(
      target,
      (at) => {
        if (at >= target) return this.show(target);
        this.shown = Math.floor(at);
        this.part = Math.min(1, ((at - this.shown) * pace) / MOTION_MS);
        this.request();
      },
      { pace, start },
    );
    if (this.shown !== null && this.shown < target) this.play.textContent = "Pause";
    else this.playing = null;
  }

  togglePlay() {
    if (this.playing) return this.stop();
    if (this.number() >= this.last()) this.shown = 0;
    this.walk(this.last(), Math.min(PLAY_STEP_MS, MAX_RUN_MS / this.last()));
  }

  stop() {
    this.playing?.stop();
    this.playing = null;
    this.part = 0;
    this.play.textContent = "Play";
    this.request();
  }

  // ---- what there is to show

  last() {
    return this.result.history.length - 1;
  }

  // The end of a run is told once it was seen; a run that fails at once has been.
  isTold() {
    return this.told || this.last() === 0;
  }

  number() {
    return Math.min(this.shown ?? Infinity, this.last());
  }

  pose() {
    const k = this.number(); // a guess may be newer than the run
    const [x, y, theta] = k
      ? toXYTheta(this.result.history[k].T_target_source)
      : this.model.get("guess");
    return { x, y, theta };
  }

  // Where the basin is centred: the known answer, else what was found.
  answer() {
    return this.known ?? this.result.T_target_source ?? transform(...this.model.get("guess"));
  }

  reference() {
    return {
      known: this.known,
      reference: this.scene.reference,
      source: this.source,
      target: this.target,
    };
  }

  parameters() {
    const moved = PARAMETERS.map((name) => [name, this.model.get(name)]);
    return { ...this.model.get("first_parameters"), ...Object.fromEntries(moved) };
  }

  basinJob() {
    const parameters = this.parameters();
    const guess = this.model.get("guess");
    return {
      source: this.source,
      target: this.target,
      parameters,
      answer: this.answer(),
      guess: transform(...guess),
      from: this.known ? this.scene.reference : "estimate",
      key: JSON.stringify([this.scene.name, parameters, guess[2]]),
    };
  }

  // ---- how it is shown

  enter() {
    const name = this.model.get("scene");
    this.scene = this.model.get("scene_data").find((scene) => scene.name === name);
    Object.assign(this, unpacked(this.scene));
    const [atAnswer, atGuess] = [this.known, transform(...this.scene.guess)].map((T) =>
      T ? apply(T, this.source) : [],
    );
    this.stop();
    this.plane.bet = this.compact ? null : storedBet(this.scene);
    this.setMode("move");
    this.plane.frame(Float64Array.of(0, 0, ...this.target.points, ...atAnswer, ...atGuess));
    // Else it is watched
    const isRun = this.compact && Object.keys(this.model.get("sliders") ?? PARAMETERS).length;
    this.shown = isRun ? null : 0;
    this.told = this.compact;
    this.basin.forget();
    this.request();
  }

  // The run; or, where none runs, the pairs at the guess.
  compute(T, parameters) {
    if (this.model.get("runs")) return icp(this.source, this.target, T, parameters);
    return {
      T_target_source: T,
      termination: null,
      history: [pairsAt(this.source, this.target, T, parameters)],
    };
  }

  update() {
    const parameters = this.parameters();
    const guess = this.model.get("guess");
    const key = JSON.stringify([this.scene.name, parameters, guess]);
    if (key !== this.computed) {
      this.computed = key;
      this.result = this.compute(transform(...guess), parameters);
      this.basin.outdate(this.basinJob().key);
      this.model.set("outcome", outcome(this.result));
      this.sync();
      this.readouts.speak({ result: this.result, told: this.isTold(), ...this.reference() });
    }
    for (const name of [...PARAMETERS, "scene"]) this.controls[name].set(this.model.get(name));
    this.guess.set(guess);
    this.scrubber.resize(steps(0, this.last(), 1));
    this.scrubber.set(this.number());
    this.nearer.disabled = this.plane.zoom === MAX_ZOOM;
    this.farther.disabled = this.plane.zoom === 1;
    this.start.disabled = this.number() === 0;
    this.step.disabled = this.end.disabled = this.number() === this.last();
    for (const [name, mode] of Object.entries(this.modes)) mode.set(this.plane.mode === name);
    this.draw();
  }

  draw() {
    const colors = palette(this.root);
    const k = this.number();
    const { history } = this.result;
    const parameters = this.parameters();
    const path = history.slice(0, k + 1).map((iteration) => iteration.T_target_source);
    let { pairs } = history[k];
    let T = path[k];
    if (this.part && k < this.last()) {
      T = between(T, history[k + 1].T_target_source, this.part); // on the way to the next iteration
      pairs = pairsAt(this.source, this.target, T, parameters).pairs;
      path.push(T);
    }
    const [x, y, theta] = this.part ? toXYTheta(T) : Object.values(this.pose());
    const answer = this.isTold() ? this.known : null;
    const below = (...where) => this.basin.draw(...where);
    this.plane.draw({
      target: this.target.points,
      source: apply(T, this.source),
      pairs,
      path,
      answer,
      pose: { x, y, theta },
      colors,
      below,
    });
    this.readouts.write({
      result: this.result,
      shown: k,
      told: this.isTold(),
      bet: this.plane.bet,
      parameters,
      ...this.reference(),
    });
    if (this.compact) return;
    const costs = history
      .slice(0, this.isTold() ? undefined : k + 1)
      .map((iteration) => iteration.cost);
    drawCost(this.cost, { series: [costs], shown: k, lastIndex: this.last(), colors });
    const [firstCost, lastCost] = [costs[0], costs.at(-1)].map((cost) => cost.toPrecision(3));
    this.cost.setAttribute(
      "aria-label",
      `Cost over ${costs.length - 1} iterations: from ${firstCost} to ${lastCost} m²`,
    );
    const fate = k === 0 && this.basin.of(x, y);
    if (fate) this.said.textContent = `A run from this guess ${fate}.`;
  }
}

export default widgetOf((model) => (model.get("form") === "by hand" ? HandView : ExplorerView));
