// A state of the explorer as a link to it. A page has its last state again when it is reloaded; in
// JupyterLab Python has it.

import { CONTROLS } from "./constants.js";
import { PARAMETERS, isValueOf } from "./controls.js";

const STORAGE_KEY = "labkit-explorer";
const STATE_HASH = "#icp?";
const STATE_NAMES = ["scene", ...PARAMETERS, "guess"];

export const isPage = () => document.documentElement.hasAttribute("data-content_root");
const stateOf = (model) => Object.fromEntries(STATE_NAMES.map((name) => [name, model.get(name)]));

const storedValues = () => {
  try {
    return JSON.parse(localStorage.getItem(STORAGE_KEY)) ?? {};
  } catch {
    return {}; // storage is forbidden or damaged: the explorer works, it only forgets
  }
};

function remember(key, value) {
  try {
    localStorage.setItem(STORAGE_KEY, JSON.stringify({ ...storedValues(), [key]: value }));
  } catch {}
}

// Where the run will end as the reader bet it, one place [x, y] a scene; null without a bet. Scenes
// of one name may hold other scans elsewhere; their first guess tells them apart.
const betOn = ({ name, guess }) =>
  `bet on ${name} from ${guess.map((coordinate) => coordinate.toFixed(6))}`;
export const storeBet = (scene, place) => remember(betOn(scene), place);
export function storedBet(scene) {
  const place = storedValues()[betOn(scene)];
  return place?.length === 2 && place.every(Number.isFinite) ? place : null;
}

export function copyState(model, shown) {
  const query = new URLSearchParams({ state: JSON.stringify({ ...stateOf(model), shown }) });
  return toClipboard(
    location.href.split("#")[0] + STATE_HASH + query,
    "A link to this state is on the clipboard.",
  );
}

// Put the text on the clipboard; resolves to what to tell the reader.
export async function toClipboard(text, message) {
  try {
    await navigator.clipboard.writeText(text);
    return message;
  } catch {
    return `Copy this: ${text}`; // no clipboard here
  }
}

// What a page keeps of a widget's own until it is loaded again.
export const keepHere = (name, value) =>
  isPage() && remember(`${name} of ${location.pathname}`, value);
export const keptHere = (name) =>
  isPage() ? storedValues()[`${name} of ${location.pathname}`] : null;

export function keepState(model) {
  keepHere("state", { ...stateOf(model), shown: 0 });
}

// The state that the page's address asks for.
export function stateFromAddress(scenes) {
  if (!location.hash.startsWith(STATE_HASH)) return null;
  return sensible(scenes, () =>
    JSON.parse(new URLSearchParams(location.hash.slice(STATE_HASH.length)).get("state")),
  );
}

// The state that the reader left.
export function keptState(scenes) {
  return sensible(scenes, () => keptHere("state"));
}

// Null without a state, or where it makes no sense.
function sensible(scenes, read) {
  try {
    const { shown, ...values } = read();
    if (!STATE_NAMES.every((name) => name in values) || !scenes.includes(values.scene)) return null;
    if (values.guess.length !== 3 || !values.guess.every(Number.isFinite)) return null;
    if (!CONTROLS.every((control) => isValueOf(control, values[control.name]))) return null;
    if (!(Number.isInteger(shown) && shown >= 0)) return null;
    return { shown, values: Object.fromEntries(STATE_NAMES.map((name) => [name, values[name]])) };
  } catch {
    return null;
  }
}
