// What the live figures compute: from the values of the sliders, panels of marks, and numbers.
//
// A model takes what Python gave and returns the function that its sliders ask. Points are flat
// arrays x0, y0, x1, y1, ... in metres; the kinds of marks stand in marks.js. `drag(values, from,
// to)` gives the values after a drag from one place to another, `curve` what is drawn beside the
// picture. The tests hold all of it to labkit.

import { align, centroid } from "./explorer/alignment.js";
import { icp } from "./explorer/icp.js";
import { NearestNeighbors } from "./explorer/neighbors.js";
import { sayDifference } from "./explorer/readouts.js";
import { prepareTarget } from "./explorer/scene.js";
import { DEGREE, apply, poseDifference, transform } from "./explorer/se2.js";

export const MODELS = {
  // The newer scan moved over the older one by hand: nearest points are paired, or, where weights
  // are given, row and row.
  turn({ source, target, weights }) {
    const search = new NearestNeighbors(target);
    const answer = (degrees, x, y) => {
      const moved = apply(transform(x, y, degrees * DEGREE), source);
      const partner = rows(moved).map((at, i) => (weights ? i : search.nearest(...at)));
      const distances = rows(moved).map(([x, y], i) => distanceTo(target, partner[i], x, y));
      const fit = weights
        ? distances.reduce((sum, distance, i) => sum + weights[i] * distance ** 2, 0)
        : median(distances);
      const pairs = rows(moved).flatMap((at, i) => [
        ...at,
        target[2 * partner[i]],
        target[2 * partner[i] + 1],
      ]);
      const [name, unit] = weights ? ["cost J", "m²"] : ["median distance", "m"];
      const pairLabel = weights ? "pair" : "to the nearest point";
      const marks = [
        ["pair", pairs, pairLabel],
        ["older", target, "older scan"],
        ["newer", moved, "newer scan, moved"],
      ];
      const curve = { title: `${name} [${unit}], as you move`, trail: fit };
      return { panels: [{ marks }], numbers: [[name, `${fit.toFixed(3)} ${unit}`]], curve };
    };
    answer.drag = ([degrees, x, y], from, to) => [
      degrees,
      x + to[0] - from[0],
      y + to[1] - from[1],
    ];
    return answer;
  },

  // Pairs seen from their centroids, one side turned: H as an ellipse that turns along, and the
  // cosine that its trace is.
  trace({ source, target, weights }) {
    const targetRows = rows(target);
    const traceAt = (degrees) => {
      const turned = rows(apply(transform(0, 0, degrees * DEGREE), source));
      const products = ([x, y], i) => [x, y].flatMap((p) => targetRows[i].map((q) => p * q));
      const sum = (k) => turned.reduce((sum, p, i) => sum + weights[i] * products(p, i)[k], 0);
      return { RH: [0, 1, 2, 3].map(sum), turned };
    };
    const spreads = weights.reduce((sum, weight, i) => {
      const [x, y, u, v] = [...rows(source)[i], ...targetRows[i]];
      return sum + weight * (x * x + y * y + u * u + v * v);
    }, 0);
    const { RH: H } = traceAt(0); // (2.4)
    const a = H[0] + H[3]; // (2.5)
    const b = H[1] - H[2]; // (2.6)
    const c = Math.hypot(a, b);
    const place = (degrees) => [
      degrees / 36,
      (4 * (a * Math.cos(degrees * DEGREE) + b * Math.sin(degrees * DEGREE))) / c,
    ];
    const turns = Array.from({ length: 73 }, (_, k) => 5 * k - 180);
    const cosine = turns.slice(1).flatMap((degrees, k) => [...place(turns[k]), ...place(degrees)]);
    const answer = (degrees) => {
      const { RH, turned } = traceAt(degrees);
      const ellipse = turns.flatMap((direction) => {
        const [x, y] = [Math.cos(direction * DEGREE), Math.sin(direction * DEGREE)];
        return [RH[0] * x + RH[1] * y, RH[2] * x + RH[3] * y].map((length) => (4 * length) / c);
      });
      const pairs = turned.flatMap((point, i) => [...point, ...targetRows[i]]);
      const marks = [
        ["view", ellipse, "RH of the unit circle, scaled"],
        ["pair", pairs, "pair"],
        ["older", target, "target"],
        ["newer", turned.flat(), "source, turned"],
      ];
      const cosineMarks = [
        ["wall", [-5, 0, 5, 0, 0, -4, 0, 4], "axes: turn and trace"],
        ["way", cosine, "the trace, from −180° to 180°"],
        ["after", place(Math.atan2(b, a) / DEGREE), "its top, at atan2(b, a)"],
        ["query", place(degrees), "here"],
      ];
      const trace = RH[0] + RH[3];
      const cost = spreads - 2 * trace;
      const entries = RH.map((entry) => entry.toFixed(1).replace("-", "−"));
      return {
        panels: [
          { name: "the pairs, seen from their centroids", marks },
          { name: "the trace over the turn", marks: cosineMarks, isPlane: false },
        ],
        numbers: [
          ["tr(RH)", `${trace.toFixed(1)} m²`],
          ["RH", `${entries[0]}, ${entries[1]}; ${entries[2]}, ${entries[3]} m²`],
          ["cost J", `${cost.toFixed(1)} m²`],
        ],
        curve: { title: "cost J [m²], as you move", trail: cost },
      };
    };
    return answer;
  },

  // Pairs, in one of which the target point was displaced, aligned with a weight for this one.
  outlier({ source, target, truth, row }) {
    const answer = (weight, metres) => {
      const spoilt = target.map((coordinate, i) =>
        i === 2 * row ? coordinate + metres : coordinate,
      );
      const weights = Float64Array.from(target.subarray(target.length / 2), (_, i) =>
        i === row ? weight : 1,
      );
      const T = align(source, spoilt, weights);
      const moved = apply(T, source);
      const targetRows = rows(spoilt);
      const pairs = rows(moved).map((point, i) => [...point, ...targetRows[i]]);
      const [centroidBefore, centroidAfter] = [target, spoilt].map((points) =>
        centroid(points, weights),
      );
      const marks = [
        ["pair", pairs.filter((_, i) => i !== row).flat(), "pair"],
        ["stray", pairs[row], "pair of the outlier"],
        ["older", spoilt, "target"],
        ["newer", moved, "source, moved"],
        [
          "pull",
          [
            ...centroidBefore,
            ...centroidAfter.map(
              (coordinate, k) => centroidBefore[k] + 5 * (coordinate - centroidBefore[k]),
            ),
          ],
          "its pull on the centroid, 5 times",
        ],
        ["after", centroidAfter, "centroid of the target"],
        ["before", centroidBefore, "where it was"],
      ];
      const numbers = [
        ["centroid moves", `${distanceTo(centroidBefore, 0, ...centroidAfter).toFixed(3)} m`],
        ["error of the motion", sayDifference(poseDifference(transform(...truth), T))],
      ];
      const curve = {
        title: "error of the motion [m], as you move",
        trail: poseDifference(transform(...truth), T)[0],
      };
      return { panels: [{ marks }], numbers, curve };
    };
    answer.drag = ([weight, metres], from, to) => [weight, metres + to[0] - from[0]];
    return answer;
  },

  // The cells of a KD-tree, and those that a query opens.
  cuts({ target }) {
    const points = rows(target);
    const search = new NearestNeighbors(target);
    const answer = (depth, x, y) => {
      const radius = distanceTo(target, search.nearest(x, y), x, y);
      const cells = cut(points, box(points), depth);
      const open = cells.filter(({ low, high }) => gap([x, y], low, high) <= radius);
      const looked = open.reduce((sum, { points }) => sum + points.length, 0);
      const cornersOf = (chosenCells) => chosenCells.flatMap(({ low, high }) => [...low, ...high]);
      const marks = [
        ["cell", cornersOf(cells), "cell"],
        ["open", cornersOf(open), "cell to open"],
        ["older", target, "older scan"],
        ["reach", [x, y, radius], "distance to its nearest point"],
        ["query", [x, y], "query"],
      ];
      const numbers = [
        ["cells", `${cells.length}`],
        ["to open", `${open.length}`],
        [
          "points in them",
          `${looked} of ${points.length} (${Math.round((100 * looked) / points.length)} %)`,
        ],
      ];
      return {
        panels: [{ marks }],
        numbers,
        curve: { title: "points to look at, as you move", trail: looked },
      };
    };
    answer.drag = ([depth], _, to) => [depth, ...to];
    return answer;
  },

  // Two metrics on the same scans, after as many steps.
  race({ source, target, normals, truth, parameters }) {
    const prepared = prepareTarget(target, normals);
    const runs = ["point_to_point", "point_to_line"].map((metric) => {
      const { history } = icp(source, prepared, transform(0, 0, 0), { ...parameters, metric });
      return {
        name: metric.replaceAll("_", "-"),
        poses: history.map((iteration) => iteration.T_target_source),
      };
    });
    const errors = runs.map(({ poses }) =>
      poses.map((T) => poseDifference(transform(...truth), T)[0]),
    );
    return (steps) => {
      const shown = runs.map(({ name, poses }) => ({
        name,
        T: poses[Math.min(steps, poses.length - 1)],
        last: poses.length - 1,
      }));
      const panels = shown.map(({ name, T }) => ({
        name,
        marks: [
          ["older", target, "older scan"],
          ["newer", apply(T, source), "newer scan, moved"],
        ],
      }));
      const errorText = (T) =>
        `${sayDifference(poseDifference(transform(...truth), T))} off the truth`;
      const endNote = (last) => (steps < last ? "" : `, the end after ${last} steps`);
      const numbers = shown.map(({ name, T, last }) => [name, errorText(T) + endNote(last)]);
      return {
        panels,
        numbers,
        curve: {
          title: "error [m] over the steps: — point-to-point, - - point-to-line",
          series: errors,
          shown: steps,
        },
      };
    };
  },
};

function rows(points) {
  return Array.from({ length: points.length / 2 }, (_, i) => [points[2 * i], points[2 * i + 1]]);
}

function distanceTo(points, i, x, y) {
  return Math.hypot(points[2 * i] - x, points[2 * i + 1] - y);
}

function median(values) {
  const sorted = Float64Array.from(values).sort();
  const half = sorted.length / 2;
  return (sorted[Math.ceil(half) - 1] + sorted[Math.floor(half)]) / 2;
}

// ---- a KD-tree as scipy cuts it, of which labkit.plotting draws the cells

// The corners about all points, with a margin.
function box(points) {
  const [low, high] = corners(points);
  const margin = 0.02 * Math.max(high[0] - low[0], high[1] - low[1]) || 0.5;
  return {
    low: low.map((coordinate) => coordinate - margin),
    high: high.map((coordinate) => coordinate + margin),
  };
}

function corners(points) {
  return [Math.min, Math.max].map((extreme) =>
    [0, 1].map((axis) => extreme(...points.map((point) => point[axis]))),
  );
}

// The cells of the points after so many cuts, each at the median and across the points' longer
// extent.
function cut(points, { low, high }, depth) {
  const [minimum, maximum] = corners(points);
  const extents = [0, 1].map((axis) => maximum[axis] - minimum[axis]);
  if (depth === 0 || points.length < 2 || Math.max(...extents) === 0)
    return [{ low, high, points }];
  const axis = extents[1] > extents[0] ? 1 : 0;
  const split = points.map((point) => point[axis]).sort((a, b) => a - b)[points.length >> 1];
  const isBelow =
    split > minimum[axis] ? (point) => point[axis] < split : (point) => point[axis] <= split;
  const at = (corner) => corner.map((coordinate, k) => (k === axis ? split : coordinate));
  return [
    ...cut(points.filter(isBelow), { low, high: at(high) }, depth - 1),
    ...cut(
      points.filter((point) => !isBelow(point)),
      { low: at(low), high },
      depth - 1,
    ),
  ];
}

// How far a point is from a cell; 0 inside it.
function gap(point, low, high) {
  return Math.hypot(
    ...point.map((coordinate, k) => Math.max(low[k] - coordinate, coordinate - high[k], 0)),
  );
}
