// Formulas are drawn while the book is built (formulas.py). A copy has each as its source in plain
// text, and as MathML in formatted text.
document.addEventListener("copy", (event) => {
  const selection = getSelection();
  const copied = [...document.querySelectorAll("[data-tex]")].filter((node) =>
    selection.containsNode(node, true),
  );
  if (!copied.length || event.target.closest?.("input, textarea")) return;
  const formatted = document.createElement("div");
  for (let k = 0; k < selection.rangeCount; k++)
    formatted.append(selection.getRangeAt(k).cloneContents());
  formatted.querySelectorAll("[data-tex] > svg").forEach((node) => node.remove());
  const drawings = copied.map((node) => [...node.childNodes]);
  copied.forEach((node) => node.replaceChildren(`$${node.dataset.tex}$`));
  event.clipboardData.setData("text/plain", selection.toString());
  event.clipboardData.setData("text/html", formatted.innerHTML);
  copied.forEach((node, k) => node.replaceChildren(...drawings[k]));
  event.preventDefault();
});
