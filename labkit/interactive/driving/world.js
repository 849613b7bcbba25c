// A world of walls, the scanner that looks into it, and the robot that they stop; mirrors
// labkit/simulation/lidar.py. Segments are flat arrays ax, ay, bx, by, ... in metres.

import { toXYTheta, transform } from "../explorer/se2.js";

const MAX_SPEED_M_S = 2.5;
const MAX_TURN_RAD_S = 1.7; // m/s and rad/s at most
const ACCELERATION_M_S2 = 4; // m/s² and, three times it, rad/s²
export const ROBOT_RADIUS_M = 0.28; // m
const MIN_FREE_SHARE = 0.2; // of the way that it wants to go; below it, a wall stops the robot

// One sweep: the points in beam order, and the range of each beam; Infinity for a no-return.
export function cast(segments, T, { angles, range_min, range_max, noise_std }, random) {
  const noisy = firstHits(segments, T, angles).map((range) => range + noise_std * random());
  const ranges = noisy.map((range) => (range > range_min && range < range_max ? range : Infinity));
  const points = angles.flatMap((angle, k) =>
    ranges[k] < Infinity ? [ranges[k] * Math.cos(angle), ranges[k] * Math.sin(angle)] : [],
  );
  return { ranges, points: Float64Array.from(points) };
}

// The distance along each beam to the nearest segment that it crosses: of each end it is looked
// at how far ahead it lies, and how far to the left.
export function firstHits(segments, { c, s, x, y }, angles) {
  return Float64Array.from(angles, (angle) => {
    const bx = c * Math.cos(angle) - s * Math.sin(angle);
    const by = s * Math.cos(angle) + c * Math.sin(angle);
    let nearest = Infinity;
    for (let i = 0; i < segments.length; i += 4) {
      const ax = segments[i] - x;
      const ay = segments[i + 1] - y;
      const ex = segments[i + 2] - x;
      const ey = segments[i + 3] - y;
      const acrossA = bx * ay - by * ax;
      const acrossB = bx * ey - by * ex;
      if (acrossA < 0 === acrossB < 0) continue;
      const aheadA = bx * ax + by * ay;
      const aheadB = bx * ex + by * ey;
      const distance = aheadA + (acrossA / (acrossA - acrossB)) * (aheadB - aheadA);
      if (distance >= 0 && distance < nearest) nearest = distance;
    }
    return nearest;
  });
}

// Whether a robot can have driven so, with a scan each `seconds`; a link may tell anything.
export function isDriven(poses, seconds) {
  return poses.slice(1).every(([x, y, theta], k) => {
    const [x0, y0, theta0] = poses[k];
    const isNear = Math.hypot(x - x0, y - y0) < 1.1 * MAX_SPEED_M_S * seconds;
    return isNear && Math.abs(theta - theta0) < 1.1 * MAX_TURN_RAD_S * seconds;
  });
}

// Normal numbers by chance, the same ones for the same seed.
export const generator = (seed) => {
  const uniform = () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return (((t ^ (t >>> 14)) >>> 0) + 0.5) / 2 ** 32;
  };
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
};

// What the wheels tell about a step, as wheel_increments of labkit.simulation does.
export const wheelStep = (T_step, { along, across, turn, drift }, random) => {
  const [x, y, theta] = toXYTheta(T_step);
  const [a, b, c] = [along * random(), across * random(), random()];
  const spread = Math.hypot(turn * theta, drift * Math.hypot(x, y));
  return transform(x + a * x - b * y, y + a * y + b * x, theta + spread * c);
};

export class Robot {
  constructor(pose) {
    Object.assign(this, { pose, speed: 0, turning: 0, isBlocked: false });
  }

  // Go on for `dt` seconds; `ahead` and `left` in [-1, 1] are what the driver wants.
  move(dt, { ahead, left }, segments) {
    const toward = (now, target, maxStep) =>
      now + Math.max(-maxStep, Math.min(maxStep, target - now));
    this.speed = toward(this.speed, MAX_SPEED_M_S * ahead, ACCELERATION_M_S2 * dt);
    this.turning = toward(this.turning, MAX_TURN_RAD_S * left, 3 * ACCELERATION_M_S2 * dt);
    const [x0, y0, theta0] = this.pose;
    const theta = theta0 + this.turning * dt;
    const length = this.speed * dt;
    const freeX = x0 + length * Math.cos(theta);
    const freeY = y0 + length * Math.sin(theta);
    const [x, y] = offWalls(freeX, freeY, segments);
    this.pose = [x, y, theta];
    this.isBlocked = Math.hypot(x - x0, y - y0) < MIN_FREE_SHARE * Math.abs(length);
  }
}

// The nearest place at which the robot touches no wall.
function offWalls(x, y, segments) {
  for (let i = 0; i < segments.length; i += 4) {
    const [ax, ay, bx, by] = segments.subarray(i, i + 4);
    const dx = bx - ax;
    const dy = by - ay;
    const along = Math.max(
      0,
      Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)),
    );
    const outX = x - ax - along * dx;
    const outY = y - ay - along * dy;
    const distance = Math.hypot(outX, outY);
    if (distance > 0 && distance < ROBOT_RADIUS_M) {
      x += outX * (ROBOT_RADIUS_M / distance - 1);
      y += outY * (ROBOT_RADIUS_M / distance - 1);
    }
  }
  return [x, y];
}
