// Predictions: a question, the reader's answer, and only then what happens.
// book/_ext/predictions.py says how one is written and gives the box its classes.
(() => {
  const STORE = "labkit-predictions";

  const stored = () => {
    try {
      return JSON.parse(localStorage.getItem(STORE)) ?? {};
    } catch {
      return {}; // storage is forbidden or damaged: the page works, it only forgets
    }
  };
  const store = (key, answer) => {
    const { [key]: _, ...others } = stored();
    try {
      localStorage.setItem(STORE, JSON.stringify(answer === null ? others : { ...others, [key]: answer }));
    } catch {}
  };

  const make = (tag, attributes = {}, ...children) => {
    const node = Object.assign(document.createElement(tag), attributes);
    node.append(...children);
    return node;
  };

  // The question in words tells one prediction from another, also when boxes are moved.
  const keyOf = (box) => {
    const words = [...box.children].filter((each) => each.matches("p, ol")).map((each) => each.textContent);
    let hash = 0;
    for (const letter of words.join(" ")) hash = (31 * hash + letter.codePointAt(0)) | 0;
    return `${location.pathname.split("/").pop()}#${hash}`;
  };

  // What may tell the answer: all that follows, to the next heading or box.
  const heldBack = (box) => {
    const held = [];
    let next = box.nextElementSibling;
    for (; next && !next.matches("section, .admonition, .prev-next-area, h1, h2, h3, h4"); next = next.nextElementSibling) held.push(next);
    return held;
  };

  // The last picture before the box.
  const pictureAbove = (box) => {
    let node = box.previousElementSibling;
    while (node && !node.querySelector("img")) node = node.previousElementSibling;
    return node && [...node.querySelectorAll("img")].at(-1);
  };

  // Each kind of question: its controls, and the verdict on an answer.
  const choice = (box, list) => {
    const right = Number(box.className.match(/predict-answer-(\d+)/)[1]);
    const name = `predict-${++made}`;
    const inputs = [...list.children].map((item, i) => {
      const input = make("input", { type: "radio", name, value: String(i + 1) });
      const words = make("span");
      for (const child of [...item.childNodes]) words.append(...(child.nodeName === "P" ? child.childNodes : [child]));
      item.replaceChildren(make("label", {}, input, words));
      return input;
    });
    list.setAttribute("role", "radiogroup");
    list.setAttribute("aria-label", "Your prediction");
    for (const item of list.children) item.setAttribute("role", "presentation");
    return {
      nodes: [],
      inputs,
      read: () => inputs.find((each) => each.checked)?.value ?? "",
      write: (answer) => inputs.forEach((each) => (each.checked = each.value === answer)),
      verdict: (answer) => {
        inputs.forEach((each, i) => each.closest("li").classList.toggle("predict-right", answer !== "" && i + 1 === right));
        return Number(answer) === right ? `You said ${answer}, and so it is.` : `You said ${answer}; it is ${right}.`;
      },
    };
  };

  const typed = (answer) => {
    const unit = answer.replace(/^[-+−\d.,\s]+/, "");
    const input = make("input", { type: "text", inputMode: "decimal", autocomplete: "off", size: 8 });
    const read = () => {
      const text = input.value.trim();
      return Number.isFinite(Number(text.replace(",", ".").replace("−", "-"))) ? text : "";
    };
    return {
      nodes: [make("label", {}, "Your number ", input, ` ${unit}`)],
      inputs: [input],
      read,
      write: (text) => (input.value = text),
      verdict: (text) => `You said ${`${text} ${unit}`.trim()}; it is ${answer}.`,
    };
  };

  // A place in the picture above the box: clicked there, or typed as two numbers.
  const placed = (box) => {
    const right = box.className.match(/predict-at-(\d+)-(\d+)/).slice(1).map(Number);
    const picture = pictureAbove(box);
    const inputs = [0, 1].map(() => make("input", { type: "number", min: 0, max: 100, step: 1, required: true }));
    const labels = ["from the left", "from the bottom"].map((words, i) => make("label", {}, inputs[i], ` % ${words}`));
    const [flag, ring] = ["flag", "ring"].map((name) => make("span", { className: `predict-${name}`, hidden: true }));
    const place = () => inputs.map((each) => (each.value !== "" && each.validity.valid ? Number(each.value) : NaN));
    const put = (mark, [x, y]) => Object.assign(mark.style, { left: `${x}%`, bottom: `${y}%` });
    const draw = () => {
      flag.hidden = place().some(Number.isNaN);
      if (!flag.hidden) put(flag, place());
    };
    put(ring, right);
    if (picture) {
      const frame = make("span", { className: "predict-picture" });
      picture.replaceWith(frame);
      frame.append(picture, flag, ring);
      frame.addEventListener("click", (event) => {
        if (inputs[0].disabled) return;
        const { left, bottom, width, height } = picture.getBoundingClientRect();
        inputs[0].value = Math.round((100 * (event.clientX - left)) / width);
        inputs[1].value = Math.round((100 * (bottom - event.clientY)) / height);
        inputs[1].dispatchEvent(new Event("input", { bubbles: true }));
      });
    }
    inputs.forEach((each) => each.addEventListener("input", draw));
    return {
      nodes: [make("span", { textContent: "Click in the picture above, or type:" }), ...labels],
      inputs,
      read: () => (place().some(Number.isNaN) ? "" : place().join(", ")),
      write: (text) => {
        text.split(", ").forEach((each, i) => (inputs[i].value = each));
        if (text === "") inputs[1].value = "";
        draw();
      },
      verdict: (text) => {
        ring.hidden = text === "";
        const { width, height } = picture?.getBoundingClientRect() ?? { width: 1, height: 1 };
        const [dx, dy] = place().map((each, i) => (each - right[i]) * [1, height / (width || 1)][i]);
        return `Your place is ${Math.round(Math.hypot(dx, dy))} % of the picture's width from the ring.`;
      },
    };
  };

  let made = 0;
  const enliven = (box) => {
    const list = box.querySelector(":scope > ol.predict-choices");
    const details = box.querySelector(":scope > details");
    if (!details) return;
    const answer = details.querySelector("strong")?.textContent.trim() ?? "";
    const key = keyOf(box), held = heldBack(box);
    const { nodes, inputs, read, write, verdict } = list
      ? choice(box, list)
      : box.matches(".predict-place") ? placed(box) : typed(answer);

    const commit = make("button", { type: "submit", textContent: "Commit", disabled: true });
    const again = make("button", { type: "button", textContent: "Ask me again" });
    const said = make("output", { className: "predict-verdict" });
    said.setAttribute("role", "status");
    const form = make("form", { className: "predict-form" }, ...nodes, commit, again, said);
    if (list) form.prepend(list); // so that Enter commits a choice
    details.before(form);
    const waiting = make("p", { className: "predict-waiting", textContent: "What comes next is shown once you have answered." });
    if (held.length) box.append(waiting);

    const show = (committed, open) => {
      for (const input of inputs) input.disabled = committed !== null;
      said.textContent = committed === null ? "" : verdict(committed);
      if (committed === null) verdict("");
      commit.hidden = committed !== null;
      again.hidden = committed === null;
      commit.disabled = read() === "";
      if (details.open !== open) details.open = open;
      held.forEach((each) => each.classList.toggle("predict-held", !open));
      waiting.hidden = open;
      if (open) dispatchEvent(new Event("resize")); // what was hidden had no width
    };
    let committed = stored()[key] ?? null;
    if (committed !== null) write(committed);
    show(committed, committed !== null);

    form.addEventListener("input", () => (commit.disabled = read() === ""));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (committed !== null || read() === "") return;
      store(key, (committed = read()));
      show(committed, true);
      details.querySelector("summary").focus({ preventScroll: true });
    });
    again.addEventListener("click", () => {
      store(key, (committed = null));
      write("");
      show(null, false);
      inputs[0].focus({ preventScroll: true });
    });
    details.addEventListener("toggle", () => details.open && show(committed, true)); // opened without an answer
  };

  document.addEventListener("DOMContentLoaded", () => document.querySelectorAll(".admonition.predict").forEach(enliven));
})();
