// Nearest-neighbour search; what labkit/neighbors.py answers, by a KD-tree in the plane.

const LEAF_POINTS = 8; // points that are looked at one by one

export class NearestNeighbors {
  constructor(target) {
    this.target = target;
    this.order = Int32Array.from({ length: target.length / 2 }, (_, i) => i);
    this.axes = new Uint8Array(this.order.length); // by which coordinate a node splits
    this.build(0, this.order.length);
  }

  // Put the median of order[start..stop) in the middle, smaller ones before it.
  build(start, stop) {
    if (stop - start <= LEAF_POINTS) return;
    const part = this.order.subarray(start, stop);
    const spread = [0, 1].map((axis) => {
      const values = Array.from(part, (i) => this.target[2 * i + axis]);
      return Math.max(...values) - Math.min(...values);
    });
    const axis = spread[1] > spread[0] ? 1 : 0;
    part.sort((i, j) => this.target[2 * i + axis] - this.target[2 * j + axis]);
    const middle = (start + stop) >> 1;
    this.axes[middle] = axis;
    this.build(start, middle);
    this.build(middle + 1, stop);
  }

  // Index of the target point nearest to (x, y); of equally near ones the first.
  nearest(x, y) {
    this.best = -1;
    this.bestSquare = Infinity;
    this.search(0, this.order.length, x, y);
    return this.best;
  }

  search(start, stop, x, y) {
    if (stop - start <= LEAF_POINTS) {
      for (let k = start; k < stop; k++) this.consider(this.order[k], x, y);
      return;
    }
    const middle = (start + stop) >> 1;
    const split = this.order[middle];
    this.consider(split, x, y);
    const offset = this.axes[middle] ? y - this.target[2 * split + 1] : x - this.target[2 * split];
    const below = offset < 0;
    this.search(below ? start : middle + 1, below ? middle : stop, x, y);
    // Not `<`: on the other side a point as near may have the smaller index.
    if (offset * offset <= this.bestSquare)
      this.search(below ? middle + 1 : start, below ? stop : middle, x, y);
  }

  consider(i, x, y) {
    const dx = x - this.target[2 * i];
    const dy = y - this.target[2 * i + 1];
    const square = dx * dx + dy * dy;
    if (square < this.bestSquare || (square === this.bestSquare && i < this.best)) {
      this.best = i;
      this.bestSquare = square;
    }
  }
}
