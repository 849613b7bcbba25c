// Predictions: a question, the reader's answer, and only then what happens. What follows a question
// keeps its place: a widget stands still, all else is blurred. book/_ext/predictions.py says how
// one is written and gives the box its classes.
(() => {
  const ANSWERS_KEY = "labkit-predictions";
  const SHOW_KEY = "labkit-answers";

  // Where storage is forbidden or damaged the page works; it only forgets.
  const attempt = (act) => {
    try {
      return act();
    } catch {
      return null;
    }
  };
  const recall = (storage, key) => attempt(() => JSON.parse(window[storage].getItem(key)));
  const keep = (storage, key, value) =>
    attempt(() => window[storage].setItem(key, JSON.stringify(value)));
  const stored = () => recall("localStorage", ANSWERS_KEY) ?? {};
  const store = (key, answer) => {
    const { [key]: _, ...otherAnswers } = stored();
    keep(
      "localStorage",
      ANSWERS_KEY,
      answer === null ? otherAnswers : { ...otherAnswers, [key]: answer },
    );
  };

  // Whether answers are shown: as the address says, for as long as the tab lives, or as the reader
  // chose.
  let all =
    new URLSearchParams(location.search).has("answers") ||
    (recall("sessionStorage", SHOW_KEY) ?? recall("localStorage", SHOW_KEY)) === true;
  if (all) keep("sessionStorage", SHOW_KEY, true);

  // The question in words tells one prediction from another, also when boxes are moved.
  const keyOf = (box) => {
    const passages = [...box.children]
      .filter((node) => node.matches("p, ol"))
      .map((node) => node.textContent);
    let hash = 0;
    for (const letter of passages.join(" ")) hash = (31 * hash + letter.codePointAt(0)) | 0;
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
    const rightChoice = Number(box.className.match(/predict-answer-(\d+)/)[1]);
    const name = `predict-${++choiceCount}`;
    const inputs = [...list.children].map((item, i) => {
      const input = make("input", { type: "radio", name, value: String(i + 1) });
      const choiceText = make("span");
      for (const child of [...item.childNodes])
        choiceText.append(...(child.nodeName === "P" ? child.childNodes : [child]));
      item.replaceChildren(make("label", {}, input, choiceText));
      return input;
    });
    list.setAttribute("role", "radiogroup");
    list.setAttribute("aria-label", "Your prediction");
    for (const item of list.children) item.setAttribute("role", "presentation");
    return {
      nodes: [],
      inputs,
      read: () => inputs.find((input) => input.checked)?.value ?? "",
      write: (answer) => inputs.forEach((input) => (input.checked = input.value === answer)),
      verdict: (answer) => {
        inputs.forEach((input, i) =>
          input
            .closest("li")
            .classList.toggle("predict-right", answer !== "" && i + 1 === rightChoice),
        );
        return Number(answer) === rightChoice
          ? `You said ${answer}, and so it is.`
          : `You said ${answer}; it is ${rightChoice}.`;
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
      const entry = input.value.trim();
      return Number.isFinite(Number(entry.replace(",", ".").replace("−", "-"))) ? entry : "";
    };
    return {
      nodes: [make("label", {}, "Your number ", input, ` ${unit}`)],
      inputs: [input],
      read,
      write: (entry) => (input.value = entry),
      verdict: (entry) => `You said ${`${entry} ${unit}`.trim()}; it is ${answer}.`,
    };
  };

  // A place in the picture above the box: clicked there, or typed as two numbers.
  const placed = (box) => {
    const rightPlace = box.className
      .match(/predict-at-(\d+)-(\d+)/)
      .slice(1)
      .map(Number);
    const picture = pictureAbove(box);
    const inputs = [0, 1].map(() =>
      make("input", { type: "number", min: 0, max: 100, step: 1, required: true }),
    );
    const labels = ["from the left", "from the bottom"].map((edge, i) =>
      make("label", {}, inputs[i], ` % ${edge}`),
    );
    const [flag, ring] = ["flag", "ring"].map((name) =>
      make("span", { className: `predict-${name}`, hidden: true }),
    );
    const place = () =>
      inputs.map((input) =>
        input.value !== "" && input.validity.valid ? Number(input.value) : NaN,
      );
    const put = (mark, [x, y]) => Object.assign(mark.style, { left: `${x}%`, bottom: `${y}%` });
    const draw = () => {
      flag.hidden = place().some(Number.isNaN);
      if (!flag.hidden) put(flag, place());
    };
    put(ring, rightPlace);
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
    inputs.forEach((input) => input.addEventListener("input", draw));
    return {
      nodes: [make("span", { textContent: "Click in the picture above, or type:" }), ...labels],
      inputs,
      read: () => (place().some(Number.isNaN) ? "" : place().join(", ")),
      write: (entry) => {
        entry.split(", ").forEach((percent, i) => (inputs[i].value = percent));
        if (entry === "") inputs[1].value = "";
        draw();
      },
      verdict: (entry) => {
        ring.hidden = entry === "";
        const { width, height } = picture?.getBoundingClientRect() ?? { width: 1, height: 1 };
        const [dx, dy] = place().map(
          (percent, i) => (percent - rightPlace[i]) * [1, height / (width || 1)][i],
        );
        const share = Math.round(Math.hypot(dx, dy));
        return `Your place is ${share} % of the picture's width from the ring.`;
      },
    };
  };

  let choiceCount = 0;
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
    const verdictNode = make("output", { className: "predict-verdict" });
    verdictNode.setAttribute("role", "status");
    const form = make("form", { className: "predict-form" }, ...nodes, commit, again, verdictNode);
    if (list) form.prepend(list); // so that Enter commits a choice
    details.before(form);
    held.forEach((node) =>
      node.classList.toggle(
        "predict-still",
        node.querySelector("script[type*=widget-view], .widget-subarea") !== null,
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
      const verdictText = verdict(committed ?? "");
      verdictNode.textContent = committed === null ? "" : verdictText;
      commit.hidden = committed !== null;
      again.hidden = committed === null;
      commit.disabled = read() === "";
      if (details.open !== open) details.open = open;
      for (const node of held) {
        node.classList.toggle("predict-held", !open);
        node.inert = !open;
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
    const tally = make("span");
    const buttons = ["held back", "shown"].map((textContent) =>
      make("button", { type: "button", textContent }),
    );
    node.replaceChildren(tally, make("span", { textContent: "Answers:" }), ...buttons);
    count = () => {
      const answered = boxes.filter((box) => box.isAnswered()).length;
      const name = boxes.length === 1 ? "prediction" : "predictions";
      tally.textContent = `${boxes.length} ${name}, ${answered} answered.`;
      buttons.forEach((button, i) =>
        button.setAttribute("aria-pressed", String(all === (i === 1))),
      );
    };
    buttons.forEach((button, i) =>
      button.addEventListener("click", () => {
        all = i === 1;
        for (const storage of ["localStorage", "sessionStorage"]) keep(storage, SHOW_KEY, all);
        for (const box of boxes) box.open(false);
      }),
    );
    count();
  };

  // A link into what is held back opens it; so does a link to a state of the explorer.
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const isAskedFor = (held) =>
      held.matches(".predict-held") &&
      (held.contains(target) ||
        (location.hash.startsWith("#icp?") && held.matches(".predict-still")));
    const askedFor = boxes.filter(({ held }) => held.some(isAskedFor));
    for (const box of askedFor) box.open(true);
    if (!askedFor.length || !target) return;
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
