// Things to try in the default scenes; each ticks itself off once all that it asks for was seen.

import { button, element } from "./controls.js";
import { recall, remember } from "./memory.js";

const near = (value, wanted) => value !== null && Math.abs(value - wanted) < 0.011;
const atEnd = ({ shown, last }) => shown === last;
const wideBasin = ({ basin, max_correspondence_distance: gate, huber_delta: delta }) =>
  basin === 2 && near(gate, 1) && near(delta, 0.03);

// `seen` are the views of the scene that must have been on the screen, in this order.
const TASKS = [
  {
    scene: "The lesson's experiment", text: "a start from which the run ends somewhere else",
    seen: [(view) => atEnd(view) && !view.found && !view.failed],
  },
  {
    scene: "Room", text: "a gate of 0.05 m that fails, then a wider one that works",
    seen: [
      (view) => atEnd(view) && near(view.max_correspondence_distance, 0.05) && !view.found,
      (view) => atEnd(view) && view.found,
    ],
  },
  {
    scene: "A truck drives ahead", text: "the result with overlap 0.95, then with 0.70",
    seen: [0.95, 0.7].map((wanted) => (view) => atEnd(view) && near(view.overlap_ratio, wanted)),
  },
  {
    scene: "Corridor", text: "the result point to point, then point to line",
    seen: ["point_to_point", "point_to_line"].map((wanted) => (view) => atEnd(view) && view.metric === wanted),
  },
  {
    scene: "Turn on the spot", text: "the first three steps, one by one",
    seen: [0, 1, 2, 3].map((wanted) => (view) => view.shown === wanted),
  },
  {
    scene: "Two rooms", text: "gate 1 m, δ 0.03 m: the basin up to 2 m, then the one of begin wide, end narrow",
    seen: [false, true].map((wanted) => (view) => wideBasin(view) && view.approach === wanted),
  },
];

// The list, for those tasks whose scene can be chosen; without any, nothing is shown.
export class Tasks {
  constructor(scenes) {
    const done = recall("tasks") ?? {};
    this.tasks = TASKS.filter(({ scene }) => scenes.includes(scene)).map((task) => ({
      ...task, done: done[task.scene] ?? 0, item: element("li", {}, `${task.scene}: ${task.text}`),
    }));
    this.summary = element("summary");
    const items = this.tasks.map(({ item }) => item);
    const over = button("Start over", "Untick all", () => this.record(() => 0));
    this.node = element("details", { class: "icp-more", hidden: !items.length }, this.summary, element("ul", { class: "icp-tasks" }, ...items), over);
    this.tell();
  }

  notice(view) {
    this.record(({ scene, seen, done }) => (scene === view.scene && seen[done]?.(view) ? done + 1 : done));
  }

  record(progress) {
    const before = this.tasks.map(({ done }) => done);
    for (const task of this.tasks) task.done = progress(task);
    if (this.tasks.some(({ done }, k) => done !== before[k]))
      remember("tasks", Object.fromEntries(this.tasks.map(({ scene, done }) => [scene, done])));
    this.tell();
  }

  tell() {
    const isDone = ({ done, seen }) => done === seen.length;
    for (const task of this.tasks) task.item.classList.toggle("icp-done", isDone(task));
    const said = `Things to try: ${this.tasks.filter(isDone).length} of ${this.tasks.length} done`;
    if (this.summary.textContent !== said) this.summary.textContent = said;
  }
}
