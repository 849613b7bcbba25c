// What Drive computes: node drive.mjs FRONT_END.mjs < job.json > answers.json
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const {
  Odometry,
  Robot,
  cast,
  decoded,
  encoded,
  floats,
  generator,
  isDriven,
  isWrong,
  sayClosing,
  takeScan,
  toXYTheta,
  transform,
  wheelStep,
} = await import(pathToFileURL(process.argv[2]));

const { lidar, drives, steps, count, errors, walls } = JSON.parse(readFileSync(0, "utf8"));
const answers = drives.map(({ segments, poses, parameters, noise }) => {
  const odometry = new Odometry(poses[0]);
  const setting = { segments: floats(segments), lidar, noise, parameters };
  const ranges = poses.map((pose, k) => {
    takeScan(odometry, poses, setting);
    const sweep = cast(setting.segments, transform(...pose), lidar, generator(k));
    return Array.from(sweep.ranges, (range) => (Number.isFinite(range) ? range : null));
  });
  const believed = () => odometry.scans.map(({ T }) => toXYTheta(T));
  const before = believed();
  const recognised = odometry.recognise(parameters);
  return {
    ranges,
    before,
    recognised,
    after: believed(),
    again: decoded(encoded(poses), poses[0]),
    isDriven: isDriven(poses, 0.2),
  };
});
const random = generator(1);
const drawn = steps.map(({ step, noise }) =>
  Array.from({ length: count }, () => toXYTheta(wheelStep(transform(...step), noise, random))),
);
const closings = [
  [0, 1, 1],
  [1, 10.52, 10.521],
  [3, 2, 0.5],
  [2, 0.5, 2],
].map((closing) => sayClosing(...closing));
const wrong = errors.map(isWrong);
// How far a robot comes that drives along x for three seconds, beside or against a wall.
const reached = walls.map((wall) => {
  const robot = new Robot([0, 0, 0]);
  for (let k = 0; k < 180; k++) robot.move(1 / 60, { ahead: 1, left: 0 }, Float64Array.from(wall));
  return robot.pose;
});
process.stdout.write(JSON.stringify({ answers, drawn, closings, wrong, reached }));
