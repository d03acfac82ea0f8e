// Plays a list of FMI 2.0 calls to an FMU compiled to WebAssembly and prints the bits of what it answers: as
// harness/platforms/replay.c, which says what the calls are, does on other platforms.
//
//   node replay.mjs FMU < calls

import { readFileSync, writeFileSync } from "node:fs";
import { Fmu } from "./host.js";

const fmu = await Fmu.open(readFileSync(process.argv[2]));
const instance = fmu.instantiate({ logger: (status, _, text) => status === "fmi2OK" || process.stderr.write(`${status}: ${text}\n`) });
const names = new Map([...fmu.description.variables.values()].filter((v) => v.type !== "Boolean").map((v) => [v.reference, v.name]));
const named = (reference) => names.get(Number(reference));

const view = new DataView(new ArrayBuffer(8));
const number = (digits) => (view.setBigUint64(0, BigInt(`0x${digits}`)), view.getFloat64(0));
const hex = (value) => (view.setFloat64(0, value), view.getBigUint64(0).toString(16).padStart(16, "0"));

// FNV-1a over bytes, the 64 bits of the hash in four numbers of 16, the lowest first; the prime is 2^40 + 0x1b3
class Hash {
  #of = [0x2325, 0x8422, 0x9ce4, 0xcbf2];
  add(bytes) {
    let [a, b, c, d] = this.#of;
    for (const byte of bytes) {
      a ^= byte;
      const [p, q, r, s] = [a * 0x1b3, b * 0x1b3, c * 0x1b3 + (a << 8), d * 0x1b3 + (b << 8)];
      a = p & 0xffff;
      const carryB = q + Math.floor(p / 65536);
      b = carryB & 0xffff;
      const carryC = r + Math.floor(carryB / 65536);
      c = carryC & 0xffff;
      d = (s + Math.floor(carryC / 65536)) & 0xffff;
    }
    this.#of = [a, b, c, d];
    return this;
  }
  toString() {
    return [...this.#of].reverse().map((part) => part.toString(16).padStart(4, "0")).join("");
  }
}

const said = [], hash = new Hash();
let outputs = [], values = new Float64Array();
const calls = {
  real: (reference, digits) => instance.set({ [named(reference)]: number(digits) }),
  integer: (reference, value) => instance.set({ [named(reference)]: Number(value) }),
  slope: (reference, digits) => instance.setInputDerivatives({ [named(reference)]: number(digits) }),
  outputs: (...references) => (outputs = references.map(named)),
  start: (digits) => instance.initialize({ startTime: number(digits) }),
  step: (time, step) => {
    instance.doStep(number(time), number(step));
    values = instance.reals(outputs);
    hash.add(new Uint8Array(values.buffer, values.byteOffset, values.byteLength));
  },
  print: (name) => said.push(`${name} ${[...values].map(hex).join(" ")} hash ${hash}`),
  save: (file) => {
    const state = instance.getState(), bytes = instance.serializeState(state);
    instance.freeState(state);
    writeFileSync(file, bytes);
    said.push(`state of ${bytes.length} bytes, hash ${new Hash().add(bytes)}`);
  },
  load: (file) => {
    const state = instance.deserializeState(readFileSync(file));
    instance.setState(state);
    instance.freeState(state);
  },
};
for (const line of readFileSync(0, "utf8").split("\n").filter(Boolean)) {
  const [call, ...rest] = line.split(" ");
  calls[call](...rest);
}
instance.terminate();
instance.free();
process.stdout.write(`${said.join("\n")}\n`);
