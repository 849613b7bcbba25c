// A part of the plane on a canvas: x to the right, y up, a metre as long in both, over a grid.

import { fixed } from "./controls.js";

// Px from what can be dragged within which a finger grasps it; elsewhere it scrolls
export const TOUCH_REACH_PX = 24;

export class Frame {
  // Its middle shows the place `center` [x, y]; a metre takes `scale` of its pixels.
  look({ width, height, center, scale }) {
    Object.assign(this, { width, height, center, scale });
  }

  pixel(x, y) {
    return [
      this.width / 2 + (x - this.center[0]) * this.scale,
      this.height / 2 - (y - this.center[1]) * this.scale,
    ];
  }

  place(u, v) {
    return [
      this.center[0] + (u - this.width / 2) / this.scale,
      this.center[1] - (v - this.height / 2) / this.scale,
    ];
  }

  drawGrid(context, colors) {
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20].find((metres) => metres * this.scale >= 55) ?? 50;
    const digits = step < 1 ? 1 : 0;
    context.strokeStyle = colors.grid;
    context.fillStyle = colors.soft;
    context.lineWidth = 1;
    context.beginPath();
    const corner = [
      this.center[0] - this.width / 2 / this.scale,
      this.center[1] - this.height / 2 / this.scale,
    ];
    for (let k = Math.ceil(corner[0] / step); k * step < corner[0] + this.width / this.scale; k++) {
      const [u] = this.pixel(k * step, 0);
      context.moveTo(u, 0);
      context.lineTo(u, this.height);
      if (u > 20 && u < this.width - 70)
        context.fillText(fixed(k * step, digits), u + 3, this.height - 4);
    }
    for (
      let k = Math.ceil(corner[1] / step);
      k * step < corner[1] + this.height / this.scale;
      k++
    ) {
      const [, v] = this.pixel(0, k * step);
      context.moveTo(0, v);
      context.lineTo(this.width, v);
      if (v > 34 && v < this.height - 18) context.fillText(fixed(k * step, digits), 3, v - 3);
    }
    context.stroke();
    context.textBaseline = "top";
    context.fillText("y [m]", 3, 3);
    context.textBaseline = "alphabetic";
    context.textAlign = "right";
    context.fillText("x [m]", this.width - 3, this.height - 4);
    context.textAlign = "left";
  }
}
