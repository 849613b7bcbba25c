// A slider over pictures that Python drew.

import { element, keepToItself, slider } from "./explorer/controls.js";

function render({ model, el }) {
  const readouts = model.get("readouts"), label = model.get("label"), pictures = model.get("pictures");
  const { width, height } = model.get("size");
  const picture = element("img", { width, height, decoding: "sync" });
  const turn = slider({
    name: "page", label, values: readouts.map((_, index) => index), read: (index) => readouts[index],
    onValue: (index) => {
      model.set("index", index);
      model.save_changes();
    },
  });
  const show = () => {
    const index = model.get("index");
    turn.set(index);
    picture.src = `data:image/webp;base64,${pictures[index]}`;
    picture.alt = `${model.get("alt")}; ${label}: ${readouts[index]}`;
  };
  const input = turn.node.querySelector("input"), ticks = element("datalist", { id: `${input.id}-ticks` });
  ticks.append(...readouts.map((_, index) => element("option", { value: index })));
  input.setAttribute("list", ticks.id);
  const root = element("div", { class: "flipbook" }, turn.node, ticks, picture);
  const controller = new AbortController();
  keepToItself(root, controller.signal);
  model.on("change:index", show);
  show();
  el.append(root);
  return () => {
    controller.abort();
    model.off("change:index", show);
  };
}

export default { render };
