// A state of the explorer as text: in a page a link to it, in JupyterLab the lines that set it.

import { SLIDERS } from "./controls.js";

const HASH = "#icp?";

// Put the text on the clipboard; resolves to what to tell the reader.
export async function copyState(model, shown) {
  const isPage = document.documentElement.hasAttribute("data-content_root");
  const text = isPage ? link(model, shown) : lines(model);
  try {
    await navigator.clipboard.writeText(text);
    return isPage ? "A link to this state is on the clipboard." : "The lines that set this state are on the clipboard.";
  } catch {
    return `Copy this: ${text}`; // no clipboard here
  }
}

function link(model, shown) {
  const values = Object.fromEntries([...SLIDERS, "scene", "guess"].map((name) => [name, model.get(name)]));
  const told = new URLSearchParams({ state: JSON.stringify({ ...values, shown }) });
  return location.href.split("#")[0] + HASH + told;
}

function lines(model) {
  const python = (value) => ({ null: "None", true: "True", false: "False" })[value] ?? JSON.stringify(value);
  return ["scene", ...SLIDERS, "guess"].map((name) => `explorer.${name} = ${python(model.get(name))}`).join("\n");
}

// The state that the page's address asks for; null without one, or where it makes no sense.
export function stateFromAddress(scenes) {
  if (!location.hash.startsWith(HASH)) return null;
  try {
    const told = JSON.parse(new URLSearchParams(location.hash.slice(HASH.length)).get("state"));
    const { shown, ...values } = told;
    const names = [...SLIDERS, "scene", "guess"];
    if (!names.every((name) => name in values) || !scenes.includes(values.scene)) return null;
    const distances = [values.max_correspondence_distance, values.huber_delta];
    const numbers = [...values.guess, values.overlap_ratio, ...distances.filter((each) => each !== null)];
    if (values.guess.length !== 3 || !numbers.every(Number.isFinite)) return null;
    if (!["point_to_point", "point_to_line"].includes(values.metric)) return null;
    return { shown, values: Object.fromEntries(names.map((name) => [name, values[name]])) };
  } catch {
    return null;
  }
}
