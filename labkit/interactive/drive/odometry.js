// What the robot believes: each scan matched to the last one, the steps integrated, and a drive
// that closes where a place is recognised.

import { inlierCount } from "../explorer/correspondences.js";
import { observability, freeMotions } from "../explorer/degeneracy.js";
import { icp } from "../explorer/icp.js";
import { normalsAlongSweep } from "../explorer/normals.js";
import { failed } from "../explorer/result.js";
import { prepareTarget } from "../explorer/scene.js";
import { compose, invert, poseDifference, toXYTheta, transform } from "../explorer/se2.js";

const AWAY = 4; // m driven between two visits of a place
const WITHIN = 2; // m between what the robot takes for two places, which may be one
const APART = 0.4; // m driven between two scans that are looked at
const SHARE = 0.55; // of the points, with a partner: the same place

export class Odometry {
  constructor(start) {
    this.start = transform(...start);
    this.scans = []; // of each its points, T in the world, and how far the wheels went until there
  }

  // Take a scan; `wheels` is the step that they tell, or null. Returns the run, null for the first.
  add(points, wheels, metres, parameters) {
    const last = this.scans.at(-1), scan = { points, metres, T: this.start, step: transform(0, 0, 0) };
    this.scans.push(scan);
    if (!last) return null;
    const guess = wheels ?? transform(0, 0, 0), run = icp(points, targetOf(last), guess, parameters);
    scan.step = run.T_target_source ?? guess; // without a match it believes the wheels, or that it stands
    scan.T = renewed(compose(last.T, scan.step));
    return run;
  }

  // Match what was seen at two visits of a place, and let the drive close there, visit by visit.
  // Returns how many places were recognised.
  recognise(parameters) {
    const { scans } = this;
    let found = 0, fixed = 0, looked = 0;
    for (let i = 1; i < scans.length; i++) {
      if (scans[i].metres - scans[looked].metres < APART) continue;
      looked = i;
      const j = this.visited(i), T = j === null ? null : match(scans[i], scans[j], parameters);
      if (!T) continue;
      this.bend(Math.max(fixed, j), i, compose(scans[j].T, T));
      fixed = i;
      found++;
    }
    return found;
  }

  // The scan taken nearest to the i-th one, of those long before; null where all are far.
  visited(i) {
    const { scans } = this, cost = (k) => { const [d, turn] = poseDifference(scans[k].T, scans[i].T); return d + turn; };
    let best = null, least = WITHIN;
    for (let k = 0; scans[i].metres - scans[k].metres > AWAY; k++) if (cost(k) < least) (best = k), (least = cost(k));
    return best;
  }

  // Bend the drive from scan a to scan i so that it ends at T; what follows moves along.
  bend(a, i, T) {
    const { scans } = this, share = (k) => (k - a) / (i - a), turn = toXYTheta(compose(invert(scans[i].T), T))[2];
    for (let k = a + 1; k < scans.length; k++) {
      if (k <= i) scans[k].step = compose(scans[k].step, transform(0, 0, turn / (i - a)));
      scans[k].T = renewed(compose(scans[k - 1].T, scans[k].step));
    }
    const x = T.x - scans[i].T.x, y = T.y - scans[i].T.y;
    for (let k = a + 1; k < scans.length; k++) {
      const { T } = scans[k], s = Math.min(1, share(k));
      scans[k].T = { ...T, x: T.x + s * x, y: T.y + s * y };
    }
    for (let k = a + 1; k < scans.length; k++) scans[k].step = renewed(compose(invert(scans[k - 1].T), scans[k].T));
  }
}

export function targetOf(scan) {
  return (scan.target ??= prepareTarget(scan.points, normalsAlongSweep(scan.points)));
}

// The same motion without the rounding that would grow from one bend to the next.
const renewed = (T) => transform(...toXYTheta(T));

// The motion between two scans of one place; null where the match is in doubt.
function match(scan, older, parameters) {
  const guess = compose(invert(older.T), scan.T), wide = { ...parameters, max_correspondence_distance: 1, overlap_ratio: 0.8, approach: true };
  const run = icp(scan.points, targetOf(older), guess, wide), { pairs } = run.history.at(-1), seen = !failed(run.termination) && observability(pairs, older.target);
  const sure = seen && !freeMotions(seen).length && inlierCount(pairs) > SHARE * pairs.kept.length;
  return sure ? run.T_target_source : null;
}
