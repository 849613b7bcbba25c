// Canvases that are as sharp as the screen, in colours from the style sheet, light or dark.

const COLOR_NAMES = [
  "ink",
  "soft",
  "grid",
  "paper",
  "target",
  "gated",
  "trimmed",
  "noline",
  "down",
  "kept",
  "source",
  "reference",
  "method-1",
  "method-2",
];

export function palette(root) {
  const style = getComputedStyle(root);
  return Object.fromEntries(
    COLOR_NAMES.map((name) => [name, style.getPropertyValue(`--icp-${name}`).trim()]),
  );
}

// Call back when the page changes its theme: books, JupyterLab, VS Code and Colab mark it
// by an attribute of html or body.
export function watchTheme(callback, signal) {
  const observer = new MutationObserver(callback);
  const attributeFilter = [
    "class",
    "data-theme",
    "data-jp-theme-light",
    "data-vscode-theme-kind",
    "theme",
  ];
  for (const node of [document.documentElement, document.body])
    observer.observe(node, { attributes: true, attributeFilter });
  signal.addEventListener("abort", () => observer.disconnect());
}

// A context in CSS pixels, cleared; null while the canvas is hidden. `heightFor` gives the height.
export function freshContext(canvas, heightFor) {
  const width = canvas.clientWidth;
  if (width === 0) return null;
  const height = Math.round(heightFor(width));
  const dense = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * dense);
  canvas.height = Math.round(height * dense);
  canvas.style.height = `${height}px`;
  const context = canvas.getContext("2d");
  context.scale(dense, dense);
  const { fontSize, fontFamily } = getComputedStyle(canvas);
  context.font = `${Math.round(0.89 * parseFloat(fontSize))}px ${fontFamily}`;
  return { context, width, height };
}

export function rule(context, u0, v0, u1, v1, color) {
  context.strokeStyle = color;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(u0, v0);
  context.lineTo(u1, v1);
  context.stroke();
}

export function disc(context, u, v, r) {
  context.beginPath();
  context.arc(u, v, r, 0, 2 * Math.PI);
  context.fill();
}

// Markers about a pixel, each added to the path that is begun.

export function dot(context, u, v) {
  context.moveTo(u + 2, v);
  context.arc(u, v, 2, 0, 2 * Math.PI);
}

export function square(context, u, v) {
  context.rect(u - 2.5, v - 2.5, 5, 5);
}

export function cross(context, u, v) {
  context.moveTo(u - 3, v - 3);
  context.lineTo(u + 3, v + 3);
  context.moveTo(u - 3, v + 3);
  context.lineTo(u + 3, v - 3);
}

export function triangle(context, u, v) {
  context.moveTo(u, v - 3.5);
  context.lineTo(u + 3.3, v + 2.5);
  context.lineTo(u - 3.3, v + 2.5);
  context.closePath();
}

export function diamond(context, u, v) {
  context.moveTo(u, v - 3);
  context.lineTo(u + 3, v);
  context.lineTo(u, v + 3);
  context.lineTo(u - 3, v);
  context.closePath();
}

export function ring(context, u, v) {
  context.moveTo(u + 2.8, v);
  context.arc(u, v, 2.8, 0, 2 * Math.PI);
}

export function speck(context, u, v) {
  context.rect(u - 1.3, v - 1.3, 2.6, 2.6);
}

export function plus(context, u, v) {
  context.moveTo(u - 7, v);
  context.lineTo(u + 7, v);
  context.moveTo(u, v - 7);
  context.lineTo(u, v + 7);
}

// Call `show` with how many of `count` steps are over, `pace` milliseconds each, frame by frame:
// with whole numbers and the last one alone where the reader wants no motion.
export function tween(count, show, { pace = 100, start = 0 } = {}) {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches || count <= start) {
    show(count);
    return { stop() {} };
  }
  let begun = null;
  let frame = requestAnimationFrame(function go(now) {
    const at = Math.min(count, start + (now - (begun ??= now)) / pace);
    frame = at < count ? requestAnimationFrame(go) : null;
    show(at);
  });
  return { stop: () => cancelAnimationFrame(frame) };
}
