// Formulas are drawn while the book is built (formulas.py). MathJax comes in for the labels of
// widgets; and in a book that was built without the pen it draws all: a formula when it comes
// near, and every one for paper. Formulas are no stops of the Tab key.
(() => {
  const vendor = new URL("vendor/mathjax/", document.currentScript.src).href;
  const isDrawn = !window.MathJax; // Sphinx would have left settings there
  const config = (window.MathJax ??= {});
  config.options = { ...config.options, enableMenu: false };
  if (isDrawn) {
    config.startup = { typeset: false };
  } else {
    config.loader = { load: [`${vendor}lazy.js`] };
    config.options.lazyMargin = "800px";
  }

  let begun = null;
  const mathjax = () =>
    (begun ??= new Promise((done, fail) => {
      const found = document.querySelector('script[src*="mathjax/tex-svg"]');
      if (found && window.MathJax.startup) return done();
      const script = found ?? document.createElement("script");
      script.addEventListener("load", done);
      script.addEventListener("error", fail);
      if (!found) document.head.append(Object.assign(script, { src: `${vendor}tex-svg-full.js` }));
    })).then(() => {
      window.MathJax.Hub = hub;
      return window.MathJax.startup.promise;
    });

  // The widgets speak to MathJax 2: give MathJax 3 that one entry point.
  const labels = [];
  const typeset = (node) => mathjax().then(() => window.MathJax.typesetPromise([node])).catch(console.warn);
  const hub = {
    Queue(...commands) {
      for (const command of commands) {
        const [name, , node] = Array.isArray(command) ? command : [];
        if (name === "Typeset" && /\\[([]/.test(node?.textContent)) labels.push(typeset(node));
      }
    },
  };
  config.Hub = hub;
  document.addEventListener("DOMContentLoaded", () => { window.MathJax.Hub = hub; });

  window.drawFormulas = async () => {
    if (!isDrawn) await mathjax().then(() => window.MathJax.startup.document.lazyTypesetAll());
    await Promise.all(labels);
  };

  // A copy has a drawn formula as its source in plain text, and as MathML in formatted text.
  document.addEventListener("copy", (event) => {
    const selection = getSelection();
    const copied = [...document.querySelectorAll("[data-tex]")].filter((node) => selection.containsNode(node, true));
    if (!copied.length || event.target.closest?.("input, textarea")) return;
    const formatted = document.createElement("div");
    for (let k = 0; k < selection.rangeCount; k++) formatted.append(selection.getRangeAt(k).cloneContents());
    formatted.querySelectorAll("[data-tex] > svg").forEach((node) => node.remove());
    const drawings = copied.map((node) => [...node.childNodes]);
    copied.forEach((node) => node.replaceChildren(`$${node.dataset.tex}$`));
    event.clipboardData.setData("text/plain", selection.toString());
    event.clipboardData.setData("text/html", formatted.innerHTML);
    copied.forEach((node, k) => node.replaceChildren(...drawings[k]));
    event.preventDefault();
  });
})();
