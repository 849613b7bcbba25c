// A live figure: sliders, the picture that a model draws of their values, and its numbers.

import { freshContext, palette } from "./explorer/canvas.js";
import { button, element, fixed, nearestIndex, part, slider } from "./explorer/controls.js";
import { MAX_TRAIL_COUNT, drawCost } from "./explorer/cost.js";
import { Frame, TOUCH_REACH_PX } from "./explorer/frame.js";
import { SPEAK_DELAY_MS, writeRows } from "./explorer/readouts.js";
import { floats } from "./explorer/scene.js";
import { View, widgetOf } from "./explorer/view.js";
import { drawMark, legendOf } from "./marks.js";
import { MODELS } from "./models.js";

const MAX_FIGURE_PX = 400; // px
const FIGURE_STEP_MS = 120; // ms that a value stands while one slider plays

// What Python packed: arrays are base64, all else is as it is.
export function unpackedArrays(packed) {
  const read = ([name, value]) => [name, typeof value === "string" ? floats(value) : value];
  return Object.fromEntries(Object.entries(packed).map(read));
}

class LiveFigure extends View {
  constructor(model, signal) {
    super(model, signal);
    this.first = model.get("values");
    this.answer = MODELS[model.get("model_name")](unpackedArrays(model.get("model_data")));
    this.sliders = model.get("sliders").map(({ label, values }, k) => {
      const digits = Math.max(...values.map((value) => (String(value).split(".")[1] ?? "").length));
      const onValue = (value) =>
        this.set(model.get("values").map((oldValue, i) => (i === k ? value : oldValue)));
      return slider({
        name: `value-${k}`,
        label,
        values,
        read: (value) => fixed(value, digits),
        onValue,
      });
    });
    this.build();
    this.live();
    this.follow(["values"]);
    this.trail = [];
  }

  leave() {
    clearTimeout(this.speaking);
    clearInterval(this.playing);
  }

  build() {
    const { panels } = this.answer(...this.model.get("values"));
    const [left, right, bottom, top] = this.model.get("window");
    const style = `aspect-ratio: ${right - left} / ${top - bottom}; max-height: ${MAX_FIGURE_PX}px`;
    this.canvases = panels.map(() => element("canvas", { class: "icp-panel", role: "img", style }));
    if (this.answer.drag) for (const canvas of this.canvases) this.letDrag(canvas);
    // Its numbers are told beside it
    this.curve = element("canvas", { class: "icp-cost", "aria-hidden": "true" });
    const reset = button("Reset", "As it was at first", () => {
      this.trail = [];
      return this.set(this.first);
    });
    this.play = button("Play", "Move the slider to its end", () => this.togglePlay());
    const tools = this.sliders.length === 1 ? [this.play, reset] : [reset];
    const figures = panels.map(({ name }, k) =>
      part("named", ...(name ? [element("p", {}, name)] : []), this.canvases[k]),
    );
    const labels = new Map(
      panels.flatMap(({ marks }) => marks.map(([kind, , label]) => [kind, label])),
    );
    this.numbers = element("dl", { class: "icp-readouts" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    this.root = element(
      "div",
      {
        class: "icp-explorer icp-compact icp-live",
        role: "group",
        "aria-label": this.model.get("label"),
      },
      part(
        panels.length > 1 ? "stack" : "frame",
        part("left", part("panels", ...figures), legendOf([...labels])),
        part(
          "right",
          part("sliders", ...this.sliders.map(({ node }) => node)),
          part("row", ...tools),
          this.numbers,
          this.curve,
          this.spoken,
        ),
      ),
    );
  }

  // Each slider's nearest value; what is dragged stays among those that can be chosen.
  set(values) {
    this.model.set(
      "values",
      this.model.get("sliders").map(({ values: all }, k) => all[nearestIndex(all, values[k])]),
    );
    this.sync();
  }

  // In the picture the thing itself is dragged; a finger elsewhere scrolls the page.
  letDrag(canvas) {
    let grip = null;
    const listen = (type, listener) =>
      canvas.addEventListener(type, listener, { signal: this.signal, passive: false });
    const place = ({ offsetX, offsetY }) => this.view.place(offsetX, offsetY);
    canvas.classList.add("icp-drag");
    listen("touchstart", (event) => {
      const { left, top } = canvas.getBoundingClientRect();
      const [{ clientX, clientY }] = event.touches;
      if (this.isNear(clientX - left, clientY - top)) event.preventDefault();
    });
    listen("pointerdown", (event) => {
      if (event.pointerType === "touch" && !this.isNear(event.offsetX, event.offsetY)) return;
      event.preventDefault();
      grip = { values: this.model.get("values"), from: place(event) };
      canvas.setPointerCapture(event.pointerId);
    });
    listen(
      "pointermove",
      (event) => grip && this.set(this.answer.drag(grip.values, grip.from, place(event))),
    );
    for (const type of ["pointerup", "pointercancel"]) listen(type, () => (grip = null));
  }

  isNear(u, v) {
    const { marks } = this.answer(...this.model.get("values")).panels[0];
    const held = ["newer", "query", "stray"];
    const spots = marks
      .filter(([kind]) => held.includes(kind))
      .flatMap(([, data]) =>
        Array.from({ length: data.length / 2 }, (_, i) =>
          this.view.pixel(data[2 * i], data[2 * i + 1]),
        ),
      );
    return spots.some(([a, b]) => Math.hypot(a - u, b - v) < TOUCH_REACH_PX);
  }

  togglePlay() {
    const [{ values }] = this.model.get("sliders");
    const stop = () => {
      clearInterval(this.playing);
      this.playing = null;
      return (this.play.textContent = "Play");
    };
    if (this.playing) return stop();
    let at = values.indexOf(this.model.get("values")[0]);
    if (at === values.length - 1) at = -1;
    this.play.textContent = "Pause";
    this.playing = setInterval(() => {
      this.set([values[++at]]);
      return at === values.length - 1 && stop();
    }, FIGURE_STEP_MS);
  }

  update() {
    const values = this.model.get("values");
    const { panels, numbers, curve } = this.answer(...values);
    this.sliders.forEach((control, k) => control.set(values[k]));
    writeRows(this.numbers, numbers);
    panels.forEach((panel, k) => this.drawPanel(this.canvases[k], panel));
    const { title, trail, series, shown } = curve;
    const lastNumber = this.trail.at(-1);
    if (trail !== undefined && trail !== lastNumber)
      this.trail = [...this.trail, trail].slice(-MAX_TRAIL_COUNT);
    drawCost(this.curve, {
      series: series ?? [this.trail],
      shown: shown ?? this.trail.length - 1,
      title,
      colors: palette(this.root),
    });
    const numbersText = numbers.map((row) => row.join(": ")).join("; ");
    const name = ({ name }) => [name, this.model.get("label")].filter(Boolean).join(": ");
    this.canvases.forEach((canvas, k) =>
      canvas.setAttribute("aria-label", `${name(panels[k])}; ${numbersText}`),
    );
    clearTimeout(this.speaking);
    this.speaking = setTimeout(() => (this.spoken.textContent = numbersText), SPEAK_DELAY_MS);
  }

  drawPanel(canvas, { marks, isPlane = true }) {
    const [left, right, bottom, top] = this.model.get("window");
    const fresh = freshContext(canvas, (width) =>
      Math.min(MAX_FIGURE_PX, (width * (top - bottom)) / (right - left)),
    );
    if (!fresh) return;
    const { context, width, height } = fresh;
    const colors = palette(this.root);
    const frame = new Frame();
    const scale = Math.min(width / (right - left), height / (top - bottom));
    frame.look({ width, height, center: [(left + right) / 2, (bottom + top) / 2], scale });
    this.view = frame;
    if (isPlane) frame.drawGrid(context, colors);
    for (const mark of marks) drawMark(context, frame, colors, mark);
  }
}

export default widgetOf(() => LiveFigure);
