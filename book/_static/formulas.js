// MathJax: formulas are typeset when they come near, and all of them for paper. They are no
// stops of the Tab key; screen readers get them as MathML.
(() => {
  const lazy = new URL("vendor/mathjax/lazy.js", document.currentScript.src).href;
  const config = (window.MathJax ??= {});
  config.loader = { load: [lazy] };
  config.options = { ...config.options, enableMenu: false, lazyMargin: "800px" };
})();

// The widgets still typeset their formulas through MathJax 2's `Hub.Queue`.
// Give MathJax 3 that one entry point.
document.addEventListener("DOMContentLoaded", () => {
  const mathjax = window.MathJax;
  if (!mathjax || mathjax.Hub) return;
  mathjax.Hub = {
    Queue(...commands) {
      for (const command of commands) {
        if (Array.isArray(command) && command[0] === "Typeset" && mathjax.typesetPromise) {
          mathjax.typesetPromise([command[2]]).catch(console.warn);
        }
      }
    },
  };
});
