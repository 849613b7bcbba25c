// Draw each widget once it comes near. An anywidget brings its own module and needs no kernel; of
// any other kind the page shows nothing.
(() => {
  // A widget's state as its module knows it.
  const modelOf = (state) => {
    const listeners = {};
    const each = (names, act) =>
      names.split(" ").forEach((name) => act((listeners[name] ??= new Set())));
    return {
      get: (name) => state[name],
      set: (name, value) => {
        const same = JSON.stringify(state[name]) === JSON.stringify(value);
        state[name] = value;
        if (!same) for (const listener of listeners[`change:${name}`] ?? []) listener();
      },
      on: (names, listener) => each(names, (all) => all.add(listener)),
      off: (names, listener) => each(names, (all) => all.delete(listener)),
      save_changes: () => {}, // there is no kernel
    };
  };

  const modules = new Map();
  const models = new Map();
  const moduleOf = ({ _esm, _css }) => {
    if (!modules.has(_esm)) {
      if (_css)
        document.head.append(Object.assign(document.createElement("style"), { textContent: _css }));
      modules.set(_esm, import(URL.createObjectURL(new Blob([_esm], { type: "text/javascript" }))));
    }
    return modules.get(_esm);
  };
  const draw = async (area, id, state) => {
    if (!models.has(id)) models.set(id, modelOf(state));
    const { default: widget } = await moduleOf(state);
    await widget.render({ model: models.get(id), el: area });
  };

  document.addEventListener("DOMContentLoaded", () => {
    const kind = (name) =>
      document.querySelectorAll(`script[type="application/vnd.jupyter.widget-${name}+json"]`);
    // Lighter pages hold each text of a module once, and its name in the states.
    const states = {};
    const texts = {};
    for (const each of kind("state")) {
      const told = JSON.parse(each.textContent);
      Object.assign(states, told.state);
      Object.assign(texts, told.texts);
    }
    const waiting = new Map();
    for (const view of kind("view")) {
      const id = JSON.parse(view.textContent).model_id;
      const state = states[id]?.state;
      if (!state?._esm) continue;
      for (const name of ["_esm", "_css"]) state[name] = texts[state[name]] ?? state[name];
      const area = Object.assign(document.createElement("div"), { className: "widget-subarea" });
      view.replaceWith(area);
      waiting.set(area, () => draw(area, id, state));
    }
    const begin = (node) => {
      const drawing = waiting.get(node)?.();
      waiting.delete(node);
      near.unobserve(node);
      return drawing;
    };
    const near = new IntersectionObserver(
      (entries) => entries.forEach((each) => each.isIntersecting && begin(each.target)),
      { rootMargin: "1500px" },
    );
    for (const node of waiting.keys()) near.observe(node);
    window.drawWidgets = () => Promise.all([...waiting.keys()].map(begin));
    // A link to a state of the explorer
    if (location.hash.startsWith("#icp?")) window.drawWidgets();
  });
})();
