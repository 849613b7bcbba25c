// Draw each widget once it comes near. An anywidget brings its own module and needs no kernel; of
// any other kind the page shows nothing.
(() => {
  // A widget's state as its module knows it.
  const modelOf = (values) => {
    const listeners = {};
    const forNames = (names, act) =>
      names.split(" ").forEach((name) => act((listeners[name] ??= new Set())));
    return {
      get: (name) => values[name],
      set: (name, value) => {
        const same = JSON.stringify(values[name]) === JSON.stringify(value);
        values[name] = value;
        if (!same) for (const listener of listeners[`change:${name}`] ?? []) listener();
      },
      on: (names, listener) => forNames(names, (all) => all.add(listener)),
      off: (names, listener) => forNames(names, (all) => all.delete(listener)),
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
  const draw = async (area, id, values) => {
    if (!models.has(id)) models.set(id, modelOf(values));
    const { default: widget } = await moduleOf(values);
    await widget.render({ model: models.get(id), el: area });
  };

  document.addEventListener("DOMContentLoaded", () => {
    const kind = (name) =>
      document.querySelectorAll(`script[type="application/vnd.jupyter.widget-${name}+json"]`);
    // Lighter pages hold each text of a module once, and its name in the states.
    const states = {};
    const texts = {};
    for (const script of kind("state")) {
      const embedded = JSON.parse(script.textContent);
      Object.assign(states, embedded.state);
      Object.assign(texts, embedded.texts);
    }
    const waiting = new Map();
    for (const view of kind("view")) {
      const id = JSON.parse(view.textContent).model_id;
      const values = states[id]?.state;
      if (!values?._esm) continue;
      for (const name of ["_esm", "_css"]) values[name] = texts[values[name]] ?? values[name];
      const area = Object.assign(document.createElement("div"), { className: "widget-subarea" });
      view.replaceWith(area);
      waiting.set(area, () => draw(area, id, values));
    }
    const begin = (node) => {
      const drawing = waiting.get(node)?.();
      waiting.delete(node);
      observer.unobserve(node);
      return drawing;
    };
    const observer = new IntersectionObserver(
      (entries) => entries.forEach((entry) => entry.isIntersecting && begin(entry.target)),
      { rootMargin: "1500px" },
    );
    for (const node of waiting.keys()) observer.observe(node);
    window.drawWidgets = () => Promise.all([...waiting.keys()].map(begin));
    // A link to a state of the explorer
    if (location.hash.startsWith("#icp?")) window.drawWidgets();
  });
})();
