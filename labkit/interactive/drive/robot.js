// The robot as it truly moves: its wheels, the walls that stop it, and a drive as text.

import { toXYTheta, transform } from "../explorer/se2.js";

const SPEED = 2.5, TURN = 1.7; // m/s and rad/s at most
const HASTE = 4; // m/s² and, three times it, rad/s²
const RADIUS = 0.28; // m

export class Robot {
  constructor(start) {
    Object.assign(this, { pose: start, speed: 0, turning: 0 });
  }

  atRest() {
    return Math.abs(this.speed) < 1e-3 && Math.abs(this.turning) < 1e-3;
  }

  // Go on for `dt` seconds; `ahead` and `left` in [-1, 1] are what the driver wants.
  move(dt, { ahead, left }, segments) {
    const toward = (now, wanted, most) => now + Math.max(-most, Math.min(most, wanted - now));
    this.speed = toward(this.speed, SPEED * ahead, HASTE * dt);
    this.turning = toward(this.turning, TURN * left, 3 * HASTE * dt);
    let [x, y, theta] = this.pose;
    theta += this.turning * dt;
    [x, y] = offWalls(x + this.speed * dt * Math.cos(theta), y + this.speed * dt * Math.sin(theta), segments);
    this.pose = [x, y, theta];
  }
}

// The nearest place at which the robot touches no wall.
function offWalls(x, y, segments) {
  for (let i = 0; i < segments.length; i += 4) {
    const [ax, ay, bx, by] = segments.subarray(i, i + 4), dx = bx - ax, dy = by - ay;
    const along = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
    const outX = x - ax - along * dx, outY = y - ay - along * dy, distance = Math.hypot(outX, outY);
    if (distance === 0 || distance >= RADIUS) continue;
    x += (outX / distance) * (RADIUS - distance);
    y += (outY / distance) * (RADIUS - distance);
  }
  return [x, y];
}

// What the wheels tell about a step, as wheel_increments of labkit.simulation does.
export function wheelStep(T_step, { along, across, turn, drift }, random) {
  const [x, y, theta] = toXYTheta(T_step), [a, b, c] = [random.normal(), random.normal(), random.normal()];
  const spread = Math.hypot(turn * theta, drift * Math.hypot(x, y));
  return transform(x + along * a * x - across * b * y, y + along * a * y + across * b * x, theta + spread * c);
}

// Poses [x, y, theta] to the millimetre and the milliradian, as what a link can hold.
export const rounded = (pose) => pose.map((each) => Math.round(1000 * each) / 1000);

// The changes of x, y and theta from one pose to the next, in thousandths, in the base of 36.
export function encoded(poses) {
  const steps = poses.slice(1).flatMap((pose, k) => pose.map((each, i) => Math.round(1000 * (each - poses[k][i]))));
  return steps.map((step) => step.toString(36)).join(".");
}

export function decoded(text, start) {
  const poses = [rounded(start)], steps = text.split(".").map((each) => parseInt(each, 36) / 1000);
  for (let k = 0; k + 2 < steps.length; k += 3) poses.push(rounded(poses.at(-1).map((each, i) => each + steps[k + i])));
  return poses;
}
