// Predictions: a question, the reader's answer, and only then what happens. What follows a question
// keeps its place: a widget stands still, all else is blurred. book/_ext/predictions.py says how
// one is written and gives the box its classes.
(() => {
  const STORE = "labkit-predictions";
  const SHOW = "labkit-answers";

  // Where storage is forbidden or damaged the page works; it only forgets.
  const attempt = (act) => {
    try {
      return act();
    } catch {
      return null;
    }
  };
  const recall = (where, key) => attempt(() => JSON.parse(window[where].getItem(key)));
  const keep = (where, key, value) =>
    attempt(() => window[where].setItem(key, JSON.stringify(value)));
  const stored = () => recall("localStorage", STORE) ?? {};
  const store = (key, answer) => {
    const { [key]: _, ...others } = stored();
    keep("localStorage", STORE, answer === null ? others : { ...others, [key]: answer });
  };

  // Whether answers are shown: as the address says, for as long as the tab lives, or as the reader
  // chose.
  let all =
    new URLSearchParams(location.search).has("answers") ||
    (recall("sessionStorage", SHOW) ?? recall("localStorage", SHOW)) === true;
  if (all) keep("sessionStorage", SHOW, true);

  // The question in words tells one prediction from another, also when boxes are moved.
  const keyOf = (box) => {
    const words = [...box.children]
      .filter((each) => each.matches("p, ol"))
      .map((each) => each.textContent);
    let hash = 0;
    for (const letter of words.join(" ")) hash = (31 * hash + letter.codePointAt(0)) | 0;
    return `${location.pathname.split("/").pop()}#${hash}`;
  };

  // What may tell the answer: all that follows, to the next heading or box.
  const heldBack = (box) => {
    const held = [];
    let next = box.nextElementSibling;
    for (
      ;
      next && !next.matches("section, .admonition, .prev-next-area, h1, h2, h3, h4");
      next = next.nextElementSibling
    )
      held.push(next);
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
      for (const child of [...item.childNodes])
        words.append(...(child.nodeName === "P" ? child.childNodes : [child]));
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
        inputs.forEach((each, i) =>
          each.closest("li").classList.toggle("predict-right", answer !== "" && i + 1 === right),
        );
        return Number(answer) === right
          ? `You said ${answer}, and so it is.`
          : `You said ${answer}; it is ${right}.`;
      },
    };
  };

  const typed = (answer) => {
    const unit = answer.replace(/^[-+−\d.,\s]+/, "");
    const input = make("input", {
      type: "text",
      inputMode: "decimal",
      autocomplete: "off",
      size: 8,
    });
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
    const right = box.className
      .match(/predict-at-(\d+)-(\d+)/)
      .slice(1)
      .map(Number);
    const picture = pictureAbove(box);
    const inputs = [0, 1].map(() =>
      make("input", { type: "number", min: 0, max: 100, step: 1, required: true }),
    );
    const labels = ["from the left", "from the bottom"].map((words, i) =>
      make("label", {}, inputs[i], ` % ${words}`),
    );
    const [flag, ring] = ["flag", "ring"].map((name) =>
      make("span", { className: `predict-${name}`, hidden: true }),
    );
    const place = () =>
      inputs.map((each) => (each.value !== "" && each.validity.valid ? Number(each.value) : NaN));
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
        const [dx, dy] = place().map(
          (each, i) => (each - right[i]) * [1, height / (width || 1)][i],
        );
        const share = Math.round(Math.hypot(dx, dy));
        return `Your place is ${share} % of the picture's width from the ring.`;
      },
    };
  };

  let made = 0;
  const boxes = [];
  const enliven = (box) => {
    const list = box.querySelector(":scope > ol.predict-choices");
    const details = box.querySelector(":scope > details");
    if (!details) return;
    const answer = details.querySelector("strong")?.textContent.trim() ?? "";
    const key = keyOf(box);
    const held = heldBack(box);
    const { nodes, inputs, read, write, verdict } = list
      ? choice(box, list)
      : box.matches(".predict-place")
        ? placed(box)
        : typed(answer);

    const commit = make("button", { type: "submit", textContent: "Commit", disabled: true });
    const again = make("button", { type: "button", textContent: "Ask me again" });
    const said = make("output", { className: "predict-verdict" });
    said.setAttribute("role", "status");
    const form = make("form", { className: "predict-form" }, ...nodes, commit, again, said);
    if (list) form.prepend(list); // so that Enter commits a choice
    details.before(form);
    held.forEach((each) =>
      each.classList.toggle(
        "predict-still",
        each.querySelector("script[type*=widget-view], .widget-subarea") !== null,
      ),
    );
    const waiting = make("p", {
      className: "predict-waiting",
      textContent: "What follows is held back until you have answered.",
    });
    if (held.length) box.append(waiting);

    let committed = stored()[key] ?? null;
    let opened = false; // opened: without an answer
    const show = () => {
      const open = all || opened || committed !== null;
      for (const input of inputs) input.disabled = committed !== null;
      const words = verdict(committed ?? "");
      said.textContent = committed === null ? "" : words;
      commit.hidden = committed !== null;
      again.hidden = committed === null;
      commit.disabled = read() === "";
      if (details.open !== open) details.open = open;
      for (const each of held) {
        each.classList.toggle("predict-held", !open);
        each.inert = !open;
      }
      waiting.hidden = open;
    };
    const set = (answered, isOpen = false) => {
      [committed, opened] = [answered, isOpen];
      show();
      count();
    };
    if (committed !== null) write(committed);
    show();
    boxes.push({
      held,
      show,
      isAnswered: () => committed !== null,
      open: (isOpen) => set(committed, isOpen),
    });

    form.addEventListener("input", () => (commit.disabled = read() === ""));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (committed !== null || read() === "") return;
      store(key, read());
      set(read());
      details.querySelector("summary").focus({ preventScroll: true });
    });
    again.addEventListener("click", () => {
      store(key, null);
      write("");
      set(null);
      inputs[0].focus({ preventScroll: true });
    });
    details.addEventListener("toggle", () => details.open && set(committed, true));
  };

  // The switch at the chapter's head, and how many of its questions are answered.
  let count = () => {};
  const enlivenSwitch = (node) => {
    const told = make("span");
    const buttons = ["held back", "shown"].map((textContent) =>
      make("button", { type: "button", textContent }),
    );
    node.replaceChildren(told, make("span", { textContent: "Answers:" }), ...buttons);
    count = () => {
      const answered = boxes.filter((each) => each.isAnswered()).length;
      const name = boxes.length === 1 ? "prediction" : "predictions";
      told.textContent = `${boxes.length} ${name}, ${answered} answered.`;
      buttons.forEach((button, i) =>
        button.setAttribute("aria-pressed", String(all === (i === 1))),
      );
    };
    buttons.forEach((button, i) =>
      button.addEventListener("click", () => {
        all = i === 1;
        for (const where of ["localStorage", "sessionStorage"]) keep(where, SHOW, all);
        for (const each of boxes) each.open(false);
      }),
    );
    count();
  };

  // A link into what is held back opens it; so does a link to a state of the explorer.
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const wanted = (held) =>
      held.matches(".predict-held") &&
      (held.contains(target) ||
        (location.hash.startsWith("#icp?") && held.matches(".predict-still")));
    const found = boxes.filter(({ held }) => held.some(wanted));
    for (const each of found) each.open(true);
    if (!found.length || !target) return;
    target.scrollIntoView();
    target.focus({ preventScroll: true });
  };

  document.addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll(".admonition.predict").forEach(enliven);
    document.querySelectorAll(".predict-switch").forEach(enlivenSwitch);
    reveal();
    addEventListener("hashchange", reveal);
    document.addEventListener(
      "click",
      ({ target }) => target.closest?.("a[href*='#']") && setTimeout(reveal),
    );
  });
})();
