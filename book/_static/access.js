// What the theme leaves unsaid to those who read by ear, by keyboard or on paper.

// An element with these attributes and children; the scripts after this one use it, too.
const make = (tag, attributes = {}, ...children) => {
  const node = Object.assign(document.createElement(tag), attributes);
  node.append(...children);
  return node;
};

(() => {
  const root = document.documentElement;

  // Paper is light, whatever the screen is.
  let onScreen = null;
  addEventListener("beforeprint", () => {
    onScreen ??= root.dataset.theme;
    root.dataset.theme = "light";
  });
  addEventListener("afterprint", () => {
    root.dataset.theme = onScreen;
    onScreen = null;
  });

  const TABLE_SELECTOR = ".pst-scrollable-table-container";
  const MAX_NARROW_PX = 600; // width of a telephone's window
  const MAX_OPEN_ROWS = 8; // of a table of six columns or more; a longer one is folded
  const MAX_SHORT_LETTERS = 16; // of cells that stand several in a line
  const isNarrow = () => innerWidth <= MAX_NARROW_PX;

  // A table that a telephone would scroll: its rows stand below one another, each cell with its
  // name; short ones, numbers, several in a line.
  const stack = (node) => {
    const names = [...node.querySelectorAll("thead th, thead td")].map((cell) =>
      cell.textContent.trim(),
    );
    const cells = [...node.querySelectorAll("tbody td:not(:first-child)")];
    const isShort = cells.every((cell) => cell.textContent.trim().length <= MAX_SHORT_LETTERS);
    node.classList.toggle("in-short", isShort);
    for (const row of node.querySelectorAll("tbody tr"))
      [...row.cells].forEach((cell, k) => names[k] && k && (cell.dataset.name = names[k]));
    node.classList.add("stacked");
  };

  // A long table shows its number of rows; the rest is folded.
  const fold = (node) => {
    const count = node.querySelectorAll("tbody tr").length;
    if (count <= MAX_OPEN_ROWS || !node.querySelector("thead th:nth-child(6)")) return false;
    const details = make("details", {}, make("summary", {}, `Table of ${count} rows`));
    node.replaceWith(details);
    details.append(node);
    return true;
  };

  // A table is seen once all of it has been read: a row that arrives would move its columns. On a
  // telephone it is folded or stacked before: nothing below it jumps.
  const isFollowed = (node) =>
    node.nextElementSibling !== null || (node !== document.body && isFollowed(node.parentElement));
  const settleTables = () => {
    for (const node of document.querySelectorAll(TABLE_SELECTOR)) {
      const isRead = document.readyState !== "loading" || isFollowed(node);
      if (node.matches(".settled") || !isRead) continue;
      node.classList.add("settled");
      if (!isNarrow() || fold(node)) continue;
      if (node.querySelector("thead") && node.scrollWidth > node.clientWidth) stack(node);
    }
  };
  const reading = new MutationObserver(settleTables);
  reading.observe(root, { childList: true, subtree: true });

  document.addEventListener("DOMContentLoaded", () => {
    reading.disconnect();
    settleTables();
    const changeAll = (selector, change) => document.querySelectorAll(selector).forEach(change);

    // Names that say something else than what is to be read, and names that are missing.
    changeAll(".search-button-field, details.hide > summary", (node) =>
      node.removeAttribute("aria-label"),
    );
    changeAll(".bd-links summary", (node) =>
      node.setAttribute("aria-label", "Pages below this one"),
    );
    changeAll(".bd-sidebar-primary", (node) => {
      node.setAttribute("role", "navigation");
      node.setAttribute("aria-label", "The book");
    });
    changeAll(".citation-list, [role=doc-biblioentry]", (node) => node.removeAttribute("role"));
    changeAll('[id="exercise-content"]', (node) => node.removeAttribute("id"));
    // Two on the page of the search
    const fields = document.querySelectorAll('[id="search-input"]');
    [...fields].slice(1).forEach((node) => node.removeAttribute("id"));
    changeAll("th", (node) => node.textContent.trim() || node.replaceWith(make("td")));

    // Anchors for exercises and equations; figures and headings have theirs.
    changeAll(".exercise.admonition[id] > .admonition-title, div.math[id] > .eqno", (node) => {
      if (node.querySelector(".headerlink")) return;
      const link = make("a", {
        className: "headerlink",
        href: `#${node.parentElement.id}`,
        textContent: "#",
        title: "Link to this",
      });
      link.setAttribute("aria-label", "Link to this");
      node.append(link);
    });

    // What a term means, beside it: under the mouse, the focus, or a finger, whose second tap leads
    // on.
    const note = make("div", { className: "term-note", hidden: true });
    const hide = () => (note.hidden = true);
    note.setAttribute("role", "tooltip");
    document.body.append(note);
    changeAll("a[title]:has(.std-term)", (link) => {
      const meaning = link.title;
      let isFirstTap = false;
      const tell = () => {
        const { left, bottom } = link.getBoundingClientRect();
        Object.assign(note, { textContent: meaning, hidden: false });
        const rightmost = root.clientWidth - note.offsetWidth - 8;
        note.style.left = `${scrollX + Math.max(8, Math.min(left, rightmost))}px`;
        note.style.top = `${scrollY + bottom + 4}px`;
      };
      link.removeAttribute("title");
      link.setAttribute("aria-description", meaning);
      for (const type of ["mouseenter", "focus"]) link.addEventListener(type, tell);
      for (const type of ["mouseleave", "blur"]) link.addEventListener(type, hide);
      link.addEventListener(
        "pointerdown",
        (event) => (isFirstTap = event.pointerType === "touch" && note.hidden),
      );
      link.addEventListener("click", (event) => {
        if (!isFirstTap) return;
        event.preventDefault();
        tell();
      });
    });
    document.addEventListener("keydown", ({ key }) => key === "Escape" && hide());

    // Ways past all links to what moves under the hand, in the theme's bar of such ways.
    changeAll('.cell_output:has(script[type*="widget-view"], .widget-subarea)', (node, k) => {
      Object.assign(node, { id: node.id || `widget-${k + 1}`, tabIndex: -1 });
      document
        .getElementById("pst-skip-link")
        .append(make("a", { href: `#${node.id}` }, `Skip to widget ${k + 1}`));
    });

    // On a telephone, a docstring shows its first sentence; the rest is folded. A link into a fold
    // opens it.
    const unfold = () => {
      const target = document.getElementById(location.hash.slice(1));
      let details = target?.closest("details");
      while (details) {
        details.open = true;
        details = details.parentElement.closest("details");
      }
      target?.scrollIntoView();
    };
    if (isNarrow()) {
      changeAll(".bd-article > section dl.py:not(dl.py dl.py) > dd", (node) => {
        const rest = [...node.children].slice(1);
        const name = node.previousElementSibling.querySelector(".descname").textContent;
        const details = make("details", {}, make("summary", {}, `More on ${name}`), ...rest);
        if (rest.length) node.append(details);
      });
      if (location.hash) unfold();
      addEventListener("hashchange", unfold);
    }

    // What scrolls sideways can be scrolled by keys. First all is read, then all is written: a
    // page is laid out once, not once for each. To measure what is folded would unfold it.
    const reach = () => {
      const all = document.querySelectorAll(
        `${TABLE_SELECTOR}, div.math, .bd-article pre, .bd-article figure`,
      );
      const nodes = [...all].filter((node) => !node.closest("details:not([open])"));
      // Its margin would make it scroll on
      nodes.forEach((node) => node.removeAttribute("tabindex"));
      nodes.forEach((node) => node.classList.remove("stacked"));
      const overflowing = nodes.filter((node) => node.scrollWidth > node.clientWidth);
      overflowing.forEach((node) =>
        isNarrow() && node.querySelector("thead") ? stack(node) : (node.tabIndex = 0),
      );
      due = null;
    };
    let due = null;
    const soon = () => (due ??= requestAnimationFrame(reach));
    addEventListener("load", soon); // once the page is laid out
    addEventListener("resize", soon);
    document.addEventListener("toggle", soon, true); // an answer is opened
  });
})();
