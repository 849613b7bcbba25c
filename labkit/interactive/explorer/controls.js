// The controls: plain HTML elements with labels, which the browser makes usable by keyboard;
// and those of what a run is told: the scans, the guess, and the parameters that have sliders.

import { CONTROLS } from "./constants.js";

export const PARAMETERS = CONTROLS.map(({ name }) => name);
export const SLIDERS = CONTROLS.filter(({ kind }) => kind === "slider").map(({ name }) => name);
const VALUE_TOLERANCE = 1e-9; // of a value that went through a link

// Ids are the whole page's, but JupyterLab loads this module anew for each widget: a count alone
// would give two widgets the same ids, and a label of the second would belong to the first.
const loaded = Math.random().toString(36).slice(2);
let idCount = 0;

function freshId(name) {
  return `icp-${name}-${loaded}-${++idCount}`;
}

export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null) node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
}

export function part(name, ...children) {
  return element("div", { class: `icp-${name}` }, ...children);
}

// A slider over `values`, the last of which may be null: off.
export function slider({ name, label, title = null, values, read, onValue }) {
  const id = freshId(name);
  // The slider itself says it
  const output = element("span", { class: "icp-value", "aria-hidden": "true" });
  const input = element("input", {
    id,
    type: "range",
    name,
    min: 0,
    max: values.length - 1,
    step: 1,
    oninput: () => onValue(values[input.valueAsNumber]),
  });
  const set = (value) => {
    const index = value === null ? values.indexOf(null) : nearestIndex(values, value);
    if (input.valueAsNumber !== index) input.value = index;
    const valueText = read(value);
    if (valueText === output.textContent) return;
    output.textContent = valueText;
    input.setAttribute("aria-valuetext", valueText);
  };
  const resize = (newValues) => {
    values = newValues;
    input.max = values.length - 1;
  };
  const node = element(
    "div",
    { class: "icp-slider", title },
    element("label", { for: id, class: `icp-word-${name}` }, label),
    input,
    output,
  );
  return { node, set, resize };
}

// The index of the value that is nearest to the one wanted; that of null is none's.
export function nearestIndex(values, target) {
  const apart = (value) => Math.abs((value ?? Infinity) - target);
  return values.reduce(
    (nearest, value, i) => (apart(value) < apart(values[nearest]) ? i : nearest),
    0,
  );
}

// Whether a control can be set to a value; that of a slider may have lost its last digits.
export function isValueOf({ kind, values }, value) {
  if (kind === "checkbox") return typeof value === "boolean";
  const isNear = (usualValue) =>
    Number.isFinite(usualValue) && Math.abs(usualValue - value) < VALUE_TOLERANCE;
  return values.some(
    (usualValue) => usualValue === value || (value !== null && isNear(usualValue)),
  );
}

// Numbers from `first` to `last` in equal steps, without the dust of adding them up.
export function steps(start, stop, step) {
  const count = Math.round((stop - start) / step);
  return Array.from({ length: count + 1 }, (_, i) => Number((start + i * step).toFixed(6)));
}

export function choice({ name, label, title = null, options, onValue }) {
  const id = freshId(name);
  const select = element("select", { id, name, onchange: () => onValue(select.value) });
  for (const [value, text] of options) select.append(element("option", { value }, text));
  const node = element(
    "div",
    { class: "icp-field", title },
    element("label", { for: id }, label),
    select,
  );
  return { node, set: (value) => (select.value = value) };
}

export function checkbox({ name, label, title = null, onValue }) {
  const id = freshId(name);
  const input = element("input", {
    id,
    type: "checkbox",
    name,
    onchange: () => onValue(input.checked),
  });
  const node = element(
    "div",
    { class: "icp-check", title },
    input,
    element("label", { for: id }, label),
  );
  return { node, set: (value) => (input.checked = value) };
}

export function button(text, title, onclick) {
  return element("button", { type: "button", title, onclick }, text);
}

// A button that is down or up; `set` says which.
export function toggle(text, title, onclick) {
  const node = element("button", { type: "button", title, "aria-pressed": "false", onclick }, text);
  return { node, set: (down) => node.setAttribute("aria-pressed", String(down)) };
}

// JupyterLab would take focus and arrow keys away from what lies in a cell.
export function keepToItself(root, signal) {
  for (const type of ["mousedown", "focusin", "keydown"])
    root.addEventListener(type, (event) => event.stopPropagation(), { signal });
}

// So many digits after the point, a true minus, and no negative zero.
export const fixed = (value, count) =>
  (Math.round(value * 10 ** count) / 10 ** count || 0).toFixed(count).replace("-", "−");

// Two digits after the point where they tell all of it, else three.
export const digits = (value) =>
  fixed(value, Math.abs(100 * value - Math.round(100 * value)) < 1e-6 ? 2 : 3);

// The controls by name, and "scene". `onValue(name)` makes what takes the value of one; `values`
// are those of a slider by its name, where they are not the usual ones.
export function parameterControls({ scenes, onScene, onValue, values = {} }) {
  const makers = {
    slider: ({ unit, ...control }) => {
      const withUnit = (value) => [digits(value), unit].filter(Boolean).join(" ");
      return slider({ ...control, read: (value) => (value === null ? "off" : withUnit(value)) });
    },
    choice: ({ values: names, ...control }) =>
      choice({ ...control, options: names.map((name) => [name, name.replaceAll("_", " ")]) }),
    checkbox,
  };
  const controls = CONTROLS.map(({ kind, help, ...control }) => {
    const { name } = control;
    const own = { title: help, onValue: onValue(name), values: values[name] ?? control.values };
    return [name, makers[kind]({ ...control, ...own })];
  });
  const options = scenes.map((name) => [name, name]);
  return {
    scene: choice({ name: "scene", label: "scans", onValue: onScene, options }),
    ...Object.fromEntries(controls),
  };
}

const GUESS_SLIDERS = [
  { name: "x", unit: "m", factor: 1, usual: steps(-3, 3, 0.05) },
  { name: "y", unit: "m", factor: 1, usual: steps(-3, 3, 0.05) },
  { name: "turn", unit: "°", factor: 180 / Math.PI, usual: steps(-180, 180, 1) },
];

// Sliders of the guess: of x, y and turn those for which there are `values`; all where there are
// none.
export function guessSliders({ values, guess, move }) {
  const nodes = {};
  const all = GUESS_SLIDERS.map(({ name, unit, factor, usual }, k) => {
    if (values && !(name in values)) return { set() {} };
    const onValue = (value) =>
      move(guess().map((coordinate, i) => (i === k ? value / factor : coordinate)));
    const read = (value) =>
      unit === "°" ? `${fixed(value, value % 1 ? 1 : 0)}°` : `${digits(value)} ${unit}`;
    const control = slider({
      name,
      label: `guess ${name}`,
      values: values?.[name] ?? usual,
      read,
      onValue,
    });
    nodes[name] = control.node;
    return control;
  });
  return {
    ...nodes,
    set: (row) => all.forEach(({ set }, k) => set(row[k] * GUESS_SLIDERS[k].factor)),
  };
}
