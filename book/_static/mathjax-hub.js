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
