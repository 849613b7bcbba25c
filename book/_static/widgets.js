// Draw each widget once it comes near. An anywidget brings its own module, and is drawn by that
// alone; for any other kind the files of ipywidgets are loaded, megabytes that no page needs to be
// read. All files lie beside this one, at any page depth, also on file://.
(() => {
  const vendor = new URL("vendor/", document.currentScript.src).href;
  const load = (file) =>
    new Promise((resolve, reject) => {
      const script = Object.assign(document.createElement("script"), { src: vendor + file, onload: resolve, onerror: reject });
      document.head.append(script);
    });

  // All widgets that are no anywidgets of themselves, at once.
  let begun = null;
  const drawOthers = () =>
    (begun ??= (async () => {
      await load("requirejs/require.js");
      window.require.config({
        paths: {
          anywidget: vendor + "anywidget/index",
          // defined inside embed-amd.js; its address says where the icon fonts are
          "@jupyter-widgets/html-manager/dist/libembed-amd": vendor + "html-manager/libembed-amd",
        },
      });
      await load("html-manager/embed-amd.js");
    })());

  // A widget's state as an anywidget's module knows it.
  const modelOf = (state) => {
    const listeners = {};
    const each = (names, act) => names.split(" ").forEach((name) => act((listeners[name] ??= new Set())));
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

  const modules = new Map(), models = new Map();
  const moduleOf = ({ _esm, _css }) => {
    if (!modules.has(_esm)) {
      if (_css) document.head.append(Object.assign(document.createElement("style"), { textContent: _css }));
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
    const kind = (name) => document.querySelectorAll(`script[type="application/vnd.jupyter.widget-${name}+json"]`);
    const states = Object.assign({}, ...[...kind("state")].map((each) => JSON.parse(each.textContent).state));
    const waiting = new Map();
    for (const view of kind("view")) {
      const id = JSON.parse(view.textContent).model_id, found = states[id], area = document.createElement("div");
      if (!found) continue;
      if (found.model_module !== "anywidget" || found.buffers) {
        waiting.set(view.parentElement, drawOthers);
        continue;
      }
      area.className = "widget-subarea";
      view.replaceWith(area);
      waiting.set(area, () => draw(area, id, found.state));
    }
    const begin = (node) => {
      const drawing = waiting.get(node)?.();
      waiting.delete(node);
      near.unobserve(node);
      return drawing;
    };
    const near = new IntersectionObserver((entries) => entries.forEach((each) => each.isIntersecting && begin(each.target)), {
      rootMargin: "1500px",
    });
    for (const node of waiting.keys()) near.observe(node);
    window.drawWidgets = () => Promise.all([...waiting.keys()].map(begin));
    addEventListener("beforeprint", window.drawWidgets);
    if (location.hash.startsWith("#icp?")) window.drawWidgets(); // a link to a state of the explorer
  });
})();
