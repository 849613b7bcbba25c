// A live figure: sliders, the picture that a model draws of their values, and its numbers.

import { freshContext, palette, watchTheme } from "./explorer/canvas.js";
import { element, keepToItself, slider } from "./explorer/controls.js";
import { Frame } from "./explorer/frame.js";
import { PATIENCE, writeRows } from "./explorer/readouts.js";
import { floats } from "./explorer/scene.js";
import { drawMark, signOf } from "./marks.js";
import { MODELS } from "./models.js";

const HIGHEST = 400; // px
const SYNC = 120; // ms of rest before Python is told

// What Python packed: arrays are base64, all else is as it is.
export function unpackedArrays(given) {
  const read = ([name, value]) => [name, typeof value === "string" ? floats(value) : value];
  return Object.fromEntries(Object.entries(given).map(read));
}

class LiveFigure {
  constructor(model, signal) {
    Object.assign(this, { model, signal });
    this.answer = MODELS[model.get("model_name")](unpackedArrays(model.get("given")));
    this.sliders = model.get("sliders").map(({ label, values }, k) => {
      const digits = Math.max(...values.map((each) => (String(each).split(".")[1] ?? "").length));
      const onValue = (value) => this.set(model.get("values").map((old, i) => (i === k ? value : old)));
      return slider({ name: `value-${k}`, label, values, read: (value) => value.toFixed(digits), onValue });
    });
    this.build();
    const changed = () => this.request();
    model.on("change:values", changed);
    watchTheme(changed, signal);
    const resized = new ResizeObserver(changed);
    resized.observe(this.root);
    signal.addEventListener("abort", () => {
      model.off("change:values", changed);
      resized.disconnect();
      clearTimeout(this.syncing);
      clearTimeout(this.speaking);
    });
    this.draw();
  }

  build() {
    const part = (name, ...children) => element("div", { class: `icp-${name}` }, ...children);
    const { panels } = this.answer(...this.model.get("values"));
    this.canvases = panels.map(() => element("canvas", { class: "icp-panel", role: "img" }));
    const figures = panels.map(({ name }, k) => part("named", ...(name ? [element("p", {}, name)] : []), this.canvases[k]));
    const labels = new Map(panels.flatMap(({ marks }) => marks.map(([kind, , label]) => [kind, label])));
    const entries = [...labels].map(([kind, label]) => {
      const { sign, color } = signOf(kind);
      return element("span", {}, element("b", { style: `color: ${color}`, "aria-hidden": "true" }, sign), ` ${label}`);
    });
    this.numbers = element("dl", { class: "icp-readouts" });
    this.spoken = element("p", { class: "icp-spoken", role: "status" });
    this.root = element(
      "div", { class: "icp-explorer icp-compact icp-live", role: "group", "aria-label": this.model.get("label") },
      part(
        panels.length > 1 ? "stack" : "frame",
        part("left", part("panels", ...figures), element("p", { class: "icp-legend" }, ...entries)),
        part("right", part("sliders", ...this.sliders.map(({ node }) => node)), this.numbers, this.spoken),
      ),
    );
    keepToItself(this.root, this.signal);
  }

  set(values) {
    this.model.set("values", values);
    clearTimeout(this.syncing);
    this.syncing = setTimeout(() => this.model.save_changes(), SYNC);
  }

  request() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (!this.signal.aborted) this.draw();
    });
  }

  draw() {
    const values = this.model.get("values"), { panels, numbers } = this.answer(...values);
    this.sliders.forEach((each, k) => each.set(values[k]));
    writeRows(this.numbers, numbers);
    panels.forEach((panel, k) => this.drawPanel(this.canvases[k], panel));
    const said = numbers.map((each) => each.join(": ")).join("; ");
    const name = ({ name }) => [name, this.model.get("label")].filter(Boolean).join(": ");
    this.canvases.forEach((canvas, k) => canvas.setAttribute("aria-label", `${name(panels[k])}; ${said}`));
    clearTimeout(this.speaking);
    this.speaking = setTimeout(() => (this.spoken.textContent = said), PATIENCE);
  }

  drawPanel(canvas, { marks }) {
    const [left, right, bottom, top] = this.model.get("window");
    const fresh = freshContext(canvas, (width) => Math.min(HIGHEST, (width * (top - bottom)) / (right - left)));
    if (!fresh) return;
    const { context, width, height } = fresh, colors = palette(this.root), frame = new Frame();
    const scale = Math.min(width / (right - left), height / (top - bottom));
    frame.look({ width, height, center: [(left + right) / 2, (bottom + top) / 2], scale });
    frame.drawGrid(context, colors);
    for (const mark of marks) drawMark(context, frame, colors, mark);
  }
}

function render({ model, el }) {
  const controller = new AbortController();
  el.append(new LiveFigure(model, controller.signal).root);
  return () => controller.abort();
}

export default { render };
