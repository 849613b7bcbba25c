// The controls of what a run is told: the scans, and the parameters that have sliders.

import { checkbox, choice, element, number, slider, steps } from "./controls.js";

// Names as in labkit's IcpParameters.
export const SLIDERS = ["metric", "max_correspondence_distance", "overlap_ratio", "huber_delta", "approach"];

const METRICS = [["point_to_point", "point to point"], ["point_to_line", "point to line"]];
const metres = (value) => (value === null ? "off" : `${value.toFixed(2)} m`);

// One control for each slider's name, and "scene"; `tell(name)` makes what takes its value.
export function parameterControls({ scenes, choose, tell }) {
  return {
    scene: choice({ name: "scene", label: "scans", onValue: choose, options: scenes.map((name) => [name, name]) }),
    metric: choice({ name: "metric", label: "metric", options: METRICS, onValue: tell("metric") }),
    max_correspondence_distance: slider({
      name: "gate", label: "gate", values: [...steps(0.05, 2, 0.05), null], read: metres,
      onValue: tell("max_correspondence_distance"),
    }),
    overlap_ratio: slider({
      name: "overlap", label: "overlap ρ", values: steps(0.2, 1, 0.01), read: (value) => value.toFixed(2),
      onValue: tell("overlap_ratio"),
    }),
    huber_delta: slider({
      name: "delta", label: "Huber δ", values: [...steps(0.01, 0.5, 0.01), null], read: metres,
      onValue: tell("huber_delta"),
    }),
    approach: checkbox({ name: "approach", label: "begin wide, end narrow", onValue: tell("approach") }),
  };
}

const DEGREES = 180 / Math.PI;
const GUESS = [
  { label: "x [m]", step: 0.05, digits: 3, factor: 1 },
  { label: "y [m]", step: 0.05, digits: 3, factor: 1 },
  { label: "turn [°]", step: 1, digits: 2, factor: DEGREES },
];

// The guess as three numbers, for those who would rather type than drag.
export function guessFields({ guess, move }) {
  const fields = GUESS.map(({ label, step, digits, factor }, i) => {
    const onValue = (value) => move(guess().map((old, k) => (k === i ? value / factor : old)));
    return number({ name: `guess-${i}`, label, step, digits, onValue });
  });
  const node = element("fieldset", {}, element("legend", {}, "guess"), ...fields.map((each) => each.node));
  return { node, set: (values) => fields.forEach((each, i) => each.set(values[i] * GUESS[i].factor)) };
}
