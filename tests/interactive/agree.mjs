// Runs the explorer's loop: node agree.mjs FRONT_END.mjs < jobs.json > answers.json
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const {
  icp,
  inlierCount,
  inlierRmse,
  freeMotions,
  observability,
  prepareTarget,
  toXYTheta,
  transform,
} = await import(pathToFileURL(process.argv[2]));
const floats = (text) => new Float64Array(new Uint8Array(Buffer.from(text, "base64")).buffer);

const { pairs, runs } = JSON.parse(readFileSync(0, "utf8"));
const prepared = pairs.map(({ source, target, normals }) => ({
  source: floats(source),
  target: prepareTarget(floats(target), floats(normals)),
}));
const answers = runs.map(({ pair, guess, parameters }) => {
  const { source, target } = prepared[pair];
  const result = icp(source, target, transform(...guess), parameters);
  const last = result.history.at(-1);
  return {
    pose: toXYTheta(last.T_target_source),
    termination: result.termination,
    iterations: result.history.length - 1,
    kept: Array.from(last.pairs.kept, Number).join(""),
    unobservable: ((seen) => (seen ? freeMotions(seen) : []))(observability(last.pairs, target)),
    inlier_count: inlierCount(last.pairs),
    inlier_rmse: inlierRmse(last.pairs),
    first_index: Array.from(result.history[0].pairs.targetIndex),
    costs: result.history.map((each) => each.cost),
  };
});
process.stdout.write(JSON.stringify(answers));
