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

document.addEventListener("DOMContentLoaded", () => {
  const nameAll = () => document.querySelectorAll(".widget-slider").forEach(nameSlider);
  new MutationObserver(nameAll).observe(document.body, { childList: true, subtree: true });
});
