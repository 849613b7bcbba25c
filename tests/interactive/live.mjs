// What live figures show: node live.mjs FRONT_END.mjs < jobs.json > answers.json
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { MODELS, unpackedArrays } = await import(pathToFileURL(process.argv[2]));

const { figures } = JSON.parse(readFileSync(0, "utf8"));
const answers = figures.map(({ model, data, moves }) => {
  const answer = MODELS[model](unpackedArrays(data));
  return moves.map((values) => {
    const { panels, numbers } = answer(...values);
    const marks = panels.map((each) =>
      Object.fromEntries(each.marks.map(([kind, data]) => [kind, Array.from(data)])),
    );
    return { panels: marks, numbers: Object.fromEntries(numbers) };
  });
});
process.stdout.write(JSON.stringify({ models: Object.keys(MODELS), answers }));
