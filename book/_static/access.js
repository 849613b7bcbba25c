// What the theme and the widgets leave unsaid to those who read by ear, by keyboard or on paper.
(() => {
  const root = document.documentElement;

  // A slider of ipywidgets is a handle without a name that speaks the index of its value.
  // Let it say the name and the value that stand beside it.
  const nameSlider = (slider) => {
    const handle = slider.querySelector(".noUi-handle");
    const label = slider.querySelector(".widget-label");
    const value = slider.querySelector(".widget-readout");
    if (!handle || !label || !value) return;
    handle.setAttribute("aria-label", label.textContent);
    handle.setAttribute("aria-valuetext", value.textContent);
    if (label.title === "null") label.removeAttribute("title"); // a tooltip that nobody gave
  };

  // A picture that a telephone shows too small can be enlarged; then it scrolls.
  const letEnlarge = (picture) => {
    const node = picture.closest("p, a") ?? picture;
    const frame = document.createElement("div");
    const button = document.createElement("button");
    const show = (large) => {
      frame.classList.toggle("enlarged", large);
      if (large) frame.tabIndex = 0; // what scrolls can be scrolled by keys
      else frame.removeAttribute("tabindex");
      button.textContent = large ? "Fit to the page" : "Enlarge";
    };
    Object.assign(button, { type: "button", className: "enlarge" });
    button.addEventListener("click", () => show(button.textContent === "Enlarge"));
    node.replaceWith(frame);
    frame.append(node);
    frame.after(button);
    show(false);
  };

  // A page in a folder may not read another one. The search, which reads those that it found,
  // gets their texts from one script.
  if (location.protocol === "file:" && location.pathname.endsWith("/search.html")) {
    let texts;
    const load = () =>
      new Promise((loaded) => {
        window.labbookExcerpts = loaded;
        const script = document.createElement("script");
        script.src = `${root.dataset.content_root}excerpts.js`;
        document.head.append(script);
      });
    window.fetch = async (page) => {
      texts ??= load();
      const name = page.slice(root.dataset.content_root.length).replace(/\.html.*/, "");
      const text = (await texts)[name];
      return { text: async () => text && `<div role="main">${text}</div>` };
    };
  }

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

  document.addEventListener("DOMContentLoaded", () => {
    const each = (selector, change) => document.querySelectorAll(selector).forEach(change);
    const tend = () => {
      each(".widget-slider", nameSlider);
      each(".flipbook > img", letEnlarge);
    };
    new MutationObserver(tend).observe(document.body, { childList: true, subtree: true });

    // Names that say something else than what is to be read, and names that are missing.
    each(".search-button-field, details.hide > summary", (node) => node.removeAttribute("aria-label"));
    each(".bd-links summary", (node) => node.setAttribute("aria-label", "Pages below this one"));
    each(".bd-sidebar-primary", (node) => {
      node.setAttribute("role", "navigation");
      node.setAttribute("aria-label", "The book");
    });
    each(".citation-list, [role=doc-biblioentry]", (node) => node.removeAttribute("role"));
    each('[id="exercise-content"]', (node) => node.removeAttribute("id"));
    const fields = document.querySelectorAll('[id="search-input"]'); // two on the page of the search
    [...fields].slice(1).forEach((node) => node.removeAttribute("id"));
    each("th", (node) => node.textContent.trim() || node.replaceWith(document.createElement("td")));

    each("article figure:has(img):not(.killian-map)", (figure) => letEnlarge(figure.querySelector("img")));

    // What scrolls sideways can be scrolled by keys. First all is read, then all is written: a
    // page is laid out once, not once for each.
    const reach = () => {
      const nodes = [...document.querySelectorAll(".pst-scrollable-table-container, div.math, .bd-article pre")];
      nodes.forEach((node) => node.removeAttribute("tabindex")); // its margin would make it scroll on
      const wide = nodes.filter((node) => node.scrollWidth > node.clientWidth);
      wide.forEach((node) => { node.tabIndex = 0; });
    };
    addEventListener("load", reach); // once the page is laid out
    addEventListener("resize", reach);
    document.addEventListener("toggle", reach, true); // an answer is opened
  });
})();
