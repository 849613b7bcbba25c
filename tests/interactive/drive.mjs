// What Drive computes: node drive.mjs FRONT_END.mjs < job.json > answers.json
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const {
  Odometry,
  cast,
  decoded,
  encoded,
  floats,
  generator,
  isDriven,
  sayClosing,
  takeScan,
  toXYTheta,
  transform,
  wheelStep,
} = await import(pathToFileURL(process.argv[2]));

const { lidar, drives, steps, count } = JSON.parse(readFileSync(0, "utf8"));
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
process.stdout.write(JSON.stringify({ answers, drawn, closings }));
