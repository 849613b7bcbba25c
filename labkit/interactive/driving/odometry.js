// What the robot believes: each scan matched to the last one, and the drive closed where a place is
// recognised.

import { inlierCount } from "../explorer/correspondences.js";
import { freeMotions, observability } from "../explorer/degeneracy.js";
import { icp } from "../explorer/icp.js";
import { fitLines } from "../explorer/normals.js";
import { failed } from "../explorer/result.js";
import { prepareTarget } from "../explorer/scene.js";
import { compose, invert, poseDifference, toXYTheta, transform } from "../explorer/se2.js";
import { cast, generator, wheelStep } from "./world.js";

const MIN_LOOP_M = 4;
const MAX_LOOP_GAP_M = 2; // m driven between two visits of a place, and how far apart they may seem
const SCAN_SPACING_M = 0.9; // m driven between two scans that are looked at
const MIN_PARTNER_SHARE = 0.55; // of the points, with a partner: the same place

function targetOf(scan) {
  if (!scan.target) {
    const { points, normals } = fitLines(scan.points);
    scan.target = prepareTarget(points, normals);
  }
  return scan.target;
}

const renewed = (T) => transform(...toXYTheta(T)); // without the rounding that would grow

export class Odometry {
  constructor(start) {
    this.start = transform(...start);
    // Of each its points, its pose T, the step to it and how the match of that ended, the motions
    // that its pairs do not show, and the metres driven until there
    this.scans = [];
  }

  // Take a scan; `wheels` is the step that they tell, or null. Without a match the robot believes
  // the wheels, or that it stands.
  add(points, wheels, metres, parameters) {
    const lastScan = this.scans.at(-1);
    if (!lastScan) {
      this.scans.push({ points, metres, step: transform(0, 0, 0), T: this.start, ending: null });
      return;
    }
    const guess = wheels ?? transform(0, 0, 0);
    const run = icp(points, targetOf(lastScan), guess, parameters);
    const step = run.T_target_source ?? guess;
    const T = renewed(compose(lastScan.T, step));
    this.scans.push({
      points,
      metres,
      step,
      T,
      ending: run.termination,
      unseen: unseenBy(run, lastScan),
    });
  }

  // Match what was seen at two visits of a place, and let the drive close there, visit by visit.
  // Returns how many scans were recognised.
  recognise(parameters) {
    const { scans } = this;
    let recognisedCount = 0;
    let fixed = 0;
    let looked = 0;
    for (let i = 1; i < scans.length; i++) {
      if (scans[i].metres - scans[looked].metres < SCAN_SPACING_M) continue;
      looked = i;
      const j = this.visited(i);
      const T = j === null ? null : match(scans[i], scans[j], parameters);
      if (!T) continue;
      this.bend(Math.max(fixed, j), i, compose(scans[j].T, T));
      fixed = i;
      recognisedCount++;
    }
    return recognisedCount;
  }

  // The scan taken nearest to the i-th one, of those long before; null where all are far.
  visited(i) {
    const { scans } = this;
    let nearest = null;
    let leastDistance = MAX_LOOP_GAP_M;
    for (let k = 0; scans[i].metres - scans[k].metres > MIN_LOOP_M; k++) {
      const [metres, turn] = poseDifference(scans[k].T, scans[i].T);
      if (metres + turn < leastDistance) {
        nearest = k;
        leastDistance = metres + turn;
      }
    }
    return nearest;
  }

  // Bend the drive from scan a to scan i so that it ends at T; what follows moves along.
  bend(a, i, { c, s, x, y }) {
    const { scans } = this;
    const turn = toXYTheta(compose(invert(scans[i].T), { c, s, x, y }))[2] / (i - a);
    for (let k = a + 1; k < scans.length; k++) {
      const step = k > i ? scans[k].step : compose(scans[k].step, transform(0, 0, turn));
      scans[k].T = renewed(compose(scans[k - 1].T, step));
    }
    const dx = (x - scans[i].T.x) / (i - a);
    const dy = (y - scans[i].T.y) / (i - a);
    for (let k = a + 1; k < scans.length; k++) {
      const { T } = scans[k];
      const passed = Math.min(k, i) - a;
      scans[k].T = { ...T, x: T.x + passed * dx, y: T.y + passed * dy };
      scans[k].step = renewed(compose(invert(scans[k - 1].T), scans[k].T));
    }
  }
}

// The motions that the last pairs of a run do not show, in words.
function unseenBy({ history, termination }, older) {
  const information = failed(termination)
    ? null
    : observability(history.at(-1).pairs, older.target);
  return information ? freeMotions(information) : [];
}

// Take the next scan of a drive, from the world as its scanner and its wheels see it. Chance is the
// same for the same scan of a drive, so that a link repeats it.
export function takeScan(odometry, poses, { segments, lidar, noise, parameters }) {
  const k = odometry.scans.length;
  const T = transform(...poses[k]);
  const random = generator(k);
  const { points } = cast(segments, T, lidar, random);
  if (!k) return odometry.add(points, null, 0, parameters);
  const step = compose(invert(transform(...poses[k - 1])), T);
  const metres = odometry.scans.at(-1).metres + Math.hypot(step.x, step.y);
  return odometry.add(points, noise ? wheelStep(step, noise, random) : null, metres, parameters);
}

// How far off the robot believes to be [m], of the pose where it is.
export function distanceOff(odometry, [x, y]) {
  const { T } = odometry.scans.at(-1);
  return Math.hypot(T.x - x, T.y - y);
}

// The motion between two scans of one place; null where the match is in doubt.
function match(scan, older, parameters) {
  const looseParameters = {
    ...parameters,
    max_correspondence_distance: 1,
    overlap_ratio: 0.8,
    approach: true,
  };
  const run = icp(scan.points, targetOf(older), compose(invert(older.T), scan.T), looseParameters);
  const { pairs } = run.history.at(-1);
  const information = failed(run.termination) ? null : observability(pairs, older.target);
  const sure =
    information &&
    !freeMotions(information).length &&
    inlierCount(pairs) > MIN_PARTNER_SHARE * pairs.kept.length;
  return sure ? run.T_target_source : null;
}
