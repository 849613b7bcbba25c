// What a widget shows of its model, once a frame at most.

import { watchTheme } from "./canvas.js";
import { keepToItself } from "./controls.js";

const SYNC_DELAY_MS = 120; // ms of rest before Python is told

// Views build `root`, draw it in `update`, and end in `leave` what still runs. They are drawn once
// they stand in the page, so that what is below moves once and not again when canvases have sizes.
export class View {
  constructor(model, signal) {
    Object.assign(this, { model, signal });
  }

  // Draw anew when the theme or the size changes.
  live() {
    const changed = () => this.request();
    const resized = new ResizeObserver(changed);
    keepToItself(this.root, this.signal);
    watchTheme(changed, this.signal);
    resized.observe(this.root);
    this.signal.addEventListener("abort", () => {
      resized.disconnect();
      clearTimeout(this.syncing);
      this.leave();
    });
  }

  // Draw anew, or do something else, when one of these values changes.
  follow(names, act = () => this.request()) {
    const changes = names.map((name) => `change:${name}`).join(" ");
    this.model.on(changes, act);
    this.signal.addEventListener("abort", () => this.model.off(changes, act));
  }

  request() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (!this.signal.aborted) this.update();
    });
  }

  sync() {
    clearTimeout(this.syncing);
    this.syncing = setTimeout(() => this.model.save_changes(), SYNC_DELAY_MS);
  }
}

// What a widget's module exports; `viewOf` tells which view a model is to have.
export const widgetOf = (viewOf) => ({
  render({ model, el }) {
    const controller = new AbortController();
    const view = new (viewOf(model))(model, controller.signal);
    el.append(view.root);
    view.update();
    return () => controller.abort();
  },
});
