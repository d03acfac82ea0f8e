// What the host of harness/web/fmu must do with an FMU of this project, beyond the bits that harness/platforms/compare
// compares: the committed reference result, errors with their texts, saved states, texts. Exit code 0 if all holds.
//
//   node check.mjs FMU FOLDER    # the folder with NAME_in.csv, NAME_ref.csv, NAME_ref.opt

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { FmiError, Fmu } from "./host.js";

const [path, folder] = process.argv.slice(2);
const fmu = await Fmu.open(readFileSync(path));
const { modelName, variables } = fmu.description;
const table = (name) => {
  const [head, ...rows] = readFileSync(`${folder}/${modelName}_${name}.csv`, "utf8").trim().split("\n");
  return { names: head.split(","), rows: rows.map((row) => row.split(",").map(Number)) };
};
const options = Object.fromEntries(readFileSync(`${folder}/${modelName}_ref.opt`, "utf8").trim().split("\n").map((line) => line.split(", ")));

const input = table("in"), reference = table("ref"), inputs = input.names.slice(1), outputs = reference.names.slice(1);
const instance = fmu.instantiate();
// the example begins at rest: its README
const rest = { HubSlosh: ["init.slosh_angle"], Spacecraft: ["init.omega[1]", "init.omega[3]"] }[modelName] ?? [];
instance.set(Object.fromEntries(rest.map((name) => [name, 0])));
const given = (row) => Object.fromEntries(inputs.map((name, n) => [name, input.rows[row][n + 1]]));
instance.setupExperiment({ tolerance: Number(options.RelTol) });
instance.set(given(0));
instance.enterInitializationMode();
instance.exitInitializationMode();
let compared = 0;
// every one of the nine digits that the reference has of each number
const compare = (time) => {
  const row = reference.rows.find((row) => Math.abs(row[0] - time) < 1e-9);
  if (!row) return;
  const digits = [...instance.reals(outputs)].map((value) => Number(value.toPrecision(9)) + 0);
  assert.deepEqual(digits, row.slice(1).map((value) => value + 0), `at ${time} s`);
  compared += 1;
};
compare(0);
for (let row = 0; row + 1 < input.rows.length; row += 1) {
  const time = input.rows[row][0], step = input.rows[row + 1][0] - time;
  instance.set(given(row));
  instance.setInputDerivatives(Object.fromEntries(inputs.map((name, n) => [name, (input.rows[row + 1][n + 1] - input.rows[row][n + 1]) / step])));
  instance.doStep(time, step);
  compare(input.rows[row + 1][0]);
}
assert.equal(compared, reference.rows.length);

// A state as bytes, in another instance.
const state = instance.getState(), bytes = instance.serializeState(state), before = [...instance.reals(outputs)];
const other = fmu.instantiate();
const restored = other.deserializeState(bytes);
other.setState(restored);
assert.deepEqual([...other.reals(outputs)], before);
other.freeState(restored);
instance.freeState(state);

// Refusals come with what the FMU says.
const is = (status, text) => (error) => error instanceof FmiError && error.status === status && error.message.includes(text);
assert.throws(() => instance.doStep(0, 0.01), is(3, "currentCommunicationPoint"));
assert.throws(() => instance.set({ [outputs[0]]: 1 }), is(3, outputs[0]));
const heard = [];
const third = fmu.instantiate({ logger: (...said) => heard.push(said) });
const ranged = [...variables.values()].find((v) => v.causality === "parameter" && v.type === "Real" && v.min === 0);
assert.throws(() => {
  third.set({ [ranged.name]: -1 });
  third.initialize();
}, is(3, ranged.name));
assert(heard.some(([status, , text]) => status === "fmi2Error" && text.includes(ranged.name)));
assert.throws(() => third.get("no such variable"), /has no variable/);
const choice = [...variables.values()].find((v) => v.type === "Enumeration" && v.causality === "parameter");
if (choice) {
  third.reset();
  const [item, value] = [...choice.items][0];
  third.set({ [choice.name]: item });
  assert.equal(third.get(choice.name), value);
  assert.throws(() => third.set({ [choice.name]: "no such item" }), /allowed: /);
}
const text = [...variables.values()].find((v) => v.type === "String");
if (text) assert.equal(third.get(text.name), text.start ?? "");
[instance, other, third].forEach((one) => one.free());
assert.throws(() => third.doStep(0, 1), is(4, "unusable"));

// Memory: neither steps nor states leave any behind. Four thousand times would be more than one page of 64 KiB.
const fourth = fmu.instantiate();
fourth.initialize();
const size = () => fourth.memoryBytes;
const use = (count) => {
  for (let n = 0; n < count; n += 1) {
    const kept = fourth.getState();
    fourth.serializeState(kept);
    fourth.setState(kept);
    fourth.freeState(kept);
    fourth.set(Object.fromEntries(inputs.map((name) => [name, 0])));
    fourth.get(outputs);
  }
};
use(100);
const used = size();
use(4000);
assert.equal(size(), used);
console.log(`${modelName}: ${compared} rows of the reference digit by digit, states, refusals, ${used} bytes of memory`);
