// A host of FMUs that are compiled to WebAssembly: FMI 2.0, Co-Simulation, in a page or in node; and of Model Exchange
// what it takes to linearise.
//
// It knows no model. An FMU "compiled so" is a core module for wasm32 that exports the functions of FMI 2.0 with C's
// calling convention, its `memory`, and its table of functions, which can grow (the linker's --export-table and
// --growable-table); it imports nothing. A pointer is a number of 32 bits, size_t too. What C passes after the dots of a
// variadic function lies in memory, and one pointer to it is passed.
//
//     const fmu = await Fmu.open(bytesOfTheFmu);              // or new Fmu(xml, await WebAssembly.compile(wasm))
//     const plant = fmu.instantiate();
//     plant.set({ "slosh.model": "spherical", "init.slosh_angle": 0.1 });
//     plant.initialize();
//     for (let n = 0; n < 100; n++) plant.doStep(0.01 * n, 0.01);
//     plant.get("slosh_angle");

import { readDescription } from "./description.js";
import { unzip } from "./unzip.js";

const STATUS = ["fmi2OK", "fmi2Warning", "fmi2Discard", "fmi2Error", "fmi2Fatal", "fmi2Pending"];
const OK = 0, WARNING = 1, DISCARD = 2, FATAL = 4;
const MODEL_EXCHANGE = 0, CO_SIMULATION = 1;
/** Where an FMU has its module. */
export const FOLDER = "binaries/wasm32";
const PAGE = 65536; // bytes
const encoder = new TextEncoder(), decoder = new TextDecoder();

/** A call that was not fmi2OK or fmi2Warning: `status` is its number, the message what the FMU logged. */
export class FmiError extends Error {
  constructor(call, status, said) {
    super(`${call}: ${STATUS[status] ?? status}${said ? `: ${said}` : ""}`);
    this.status = status;
  }
}

/** A description and its compiled module; makes instances. */
export class Fmu {
  /**
   * @param {string} xml the text of modelDescription.xml
   * @param {WebAssembly.Module} module
   */
  constructor(xml, module) {
    this.description = readDescription(xml);
    this.module = module;
    const wanted = WebAssembly.Module.imports(module);
    if (wanted.length) {
      const names = wanted.map(({ module, name }) => `${module}.${name}`).join(", ");
      throw new Error(`the module imports ${names} (allowed: nothing)`);
    }
    const there = new Set(WebAssembly.Module.exports(module).map(({ name }) => name));
    const lacking = ["memory", "__indirect_function_table", "fmi2Instantiate", "fmi2DoStep"].filter((n) => !there.has(n));
    if (lacking.length) throw new Error(`the module does not export ${lacking.join(", ")}`);
  }

  /**
   * Opens an FMU with a module in binaries/wasm32.
   * @param {Uint8Array} bytes the .fmu
   */
  static async open(bytes) {
    const files = await unzip(bytes, (name) => name === "modelDescription.xml" || name.startsWith(`${FOLDER}/`));
    const xml = files.get("modelDescription.xml");
    if (!xml) throw new Error("the archive has no modelDescription.xml");
    const text = decoder.decode(xml);
    const name = `${FOLDER}/${readDescription(text).modelIdentifier}.wasm`;
    const wasm = files.get(name);
    if (!wasm) throw new Error(`the FMU has no ${name}`);
    return new Fmu(text, await WebAssembly.compile(wasm));
  }

  /**
   * Makes an instance, with a memory of its own: one that crashes leaves the others alone.
   * @param {(status: string, category: string, message: string) => void} [options.logger] hears what the FMU logs
   */
  instantiate({ name = this.description.modelIdentifier, logger = () => {}, loggingOn = false } = {}) {
    return new Instance(this, CO_SIMULATION, name, logger, loggingOn);
  }

  /**
   * The matrices of x' = A x + B u, y = C x + D u where these values start it, by fmi2GetDirectionalDerivative of Model
   * Exchange: lists of rows. x are `description.states`, in their order.
   */
  linearize(values, inputs, outputs) {
    const instance = new Instance(this, MODEL_EXCHANGE, this.description.modelIdentifier, () => {}, false);
    try {
      instance.set(values);
      instance.initialize();
      return instance.jacobian(inputs, outputs);
    } finally {
      instance.free();
    }
  }
}

/** One instance. Values go by the variables' names; a list of names gives a list of values. */
export class Instance {
  #fmi; #memory; #arena; #component; #logger; #said = ""; #dead = false; #kept = new Map();

  constructor(fmu, type, name, logger, loggingOn) {
    this.description = fmu.description;
    this.#logger = logger;
    this.#fmi = new WebAssembly.Instance(fmu.module).exports;
    this.#memory = this.#fmi.memory;
    this.#arena = new Arena(this.#memory);
    this.#fmi._initialize?.(); // what a C compiler makes of constructors
    const functions = this.#arena.take(20);
    const callbacks = [
      pointer(this.#fmi, "iiiiii", "", (_, __, status, category, format, rest) => this.#log(status, category, format, rest)),
      pointer(this.#fmi, "ii", "i", (count, size) => this.#arena.take(count * size)),
      pointer(this.#fmi, "i", "", (address) => this.#arena.giveBack(address)),
      pointer(this.#fmi, "ii", "", () => {}), // fmi2StepFinished: no step is asynchronous
      0, // componentEnvironment
    ];
    new Uint32Array(this.#memory.buffer, functions, 5).set(callbacks);
    const texts = [name, fmu.description.guid, ""].map((text) => this.#text(text));
    this.#component = this.#fmi.fmi2Instantiate(texts[0], type, texts[1], texts[2], functions, 0, Number(loggingOn));
    texts.forEach((text) => this.#arena.giveBack(text)); // its callbacks it may keep
    if (!this.#component) throw new FmiError("fmi2Instantiate", 3, this.#said);
  }

  /** Sets variables: `{name: value}`. An enumeration takes the name of its item or its number. */
  set(values) {
    const groups = new Map();
    for (const [name, value] of Object.entries(values)) {
      const variable = this.#variable(name);
      const kind = cType(variable);
      if (!groups.has(kind)) groups.set(kind, { references: [], values: [] });
      groups.get(kind).references.push(variable.reference);
      groups.get(kind).values.push(asC(variable, value));
    }
    for (const [kind, { references, values }] of groups) {
      const count = references.length;
      const at = this.#arena.take(4 * count), to = this.#arena.take(8 * count);
      new Uint32Array(this.#memory.buffer, at, count).set(references);
      const texts = kind === "String" ? values.map((value) => this.#text(value)) : [];
      this.#array(kind, to, count).set(kind === "String" ? texts : values);
      try {
        this.#call(`fmi2Set${kind}`, at, count, to);
      } finally {
        [at, to, ...texts].forEach((address) => this.#arena.giveBack(address));
      }
    }
  }

  /** The value of a variable, or of each of a list: numbers, texts, booleans; of an enumeration its number. */
  get(names) {
    if (typeof names === "string") return this.get([names])[0];
    const values = new Array(names.length);
    for (const kind of ["Real", "Integer", "Boolean", "String"]) {
      const places = names.map((_, n) => n).filter((n) => cType(this.#variable(names[n])) === kind);
      if (!places.length) continue;
      const read = this.#read(kind, places.map((n) => names[n]));
      places.forEach((place, n) => {
        values[place] = kind === "Boolean" ? read[n] !== 0 : kind === "String" ? this.#textAt(read[n]) : read[n];
      });
    }
    return values;
  }

  /**
   * The values of Real variables, fast: for a loop. The array is the FMU's memory and holds until the next call.
   * @param {string[]} names the same array each time
   * @returns {Float64Array}
   */
  reals(names) {
    let kept = this.#kept.get(names);
    if (!kept) {
      const count = names.length;
      kept = { count, at: this.#arena.take(4 * count), to: this.#arena.take(8 * count) };
      const references = names.map((name) => this.#typed(name, "Real").reference);
      new Uint32Array(this.#memory.buffer, kept.at, count).set(references);
      this.#kept.set(names, kept);
    }
    this.#call("fmi2GetReal", kept.at, kept.count, kept.to);
    return new Float64Array(this.#memory.buffer, kept.to, kept.count);
  }

  /** The first derivatives of Real inputs: `{name: value per second}`, for the next step. */
  setInputDerivatives(slopes) {
    const names = Object.keys(slopes), count = names.length;
    const [at, orders, to] = [4, 4, 8].map((size) => this.#arena.take(size * count));
    new Uint32Array(this.#memory.buffer, at, count).set(names.map((name) => this.#typed(name, "Real").reference));
    new Int32Array(this.#memory.buffer, orders, count).fill(1);
    new Float64Array(this.#memory.buffer, to, count).set(Object.values(slopes));
    try {
      this.#call("fmi2SetRealInputDerivatives", at, count, orders, to);
    } finally {
      [at, orders, to].forEach((address) => this.#arena.giveBack(address));
    }
  }

  /** fmi2SetupExperiment and both ends of initialization mode. */
  initialize({ startTime = 0, stopTime, tolerance } = {}) {
    this.setupExperiment({ startTime, stopTime, tolerance });
    this.enterInitializationMode();
    this.exitInitializationMode();
  }

  setupExperiment({ startTime = 0, stopTime, tolerance } = {}) {
    const [toleranceDefined, stopDefined] = [tolerance, stopTime].map((value) => Number(value !== undefined));
    this.#call("fmi2SetupExperiment", toleranceDefined, tolerance ?? 0, startTime, stopDefined, stopTime ?? 0);
  }

  enterInitializationMode() { this.#call("fmi2EnterInitializationMode"); }
  exitInitializationMode() { this.#call("fmi2ExitInitializationMode"); }

  /** A, B, C and D of an initialized instance for Model Exchange: see `Fmu.linearize`. */
  jacobian(inputs, outputs) {
    const { states } = this.description, n = states.length;
    const info = this.#arena.take(32); // fmi2EventInfo: five fmi2Boolean and a double
    do this.#call("fmi2NewDiscreteStates", info); while (new Int32Array(this.#memory.buffer, info, 1)[0]);
    this.#call("fmi2EnterContinuousTimeMode");
    const unknown = [...states.map(({ derivative }) => derivative), ...outputs], known = [...states.map(({ state }) => state), ...inputs];
    const references = (names) => {
      const at = this.#arena.take(4 * names.length);
      new Uint32Array(this.#memory.buffer, at, names.length).set(names.map((name) => this.#typed(name, "Real").reference));
      return at;
    };
    const rows = references(unknown), one = this.#arena.take(8), column = this.#arena.take(8 * unknown.length);
    new Float64Array(this.#memory.buffer, one, 1)[0] = 1;
    const columns = known.map((name) => {
      const at = references([name]);
      this.#call("fmi2GetDirectionalDerivative", rows, unknown.length, at, 1, one, column);
      this.#arena.giveBack(at);
      return [...new Float64Array(this.#memory.buffer, column, unknown.length)];
    });
    [info, rows, one, column].forEach((address) => this.#arena.giveBack(address));
    const part = (first, last, from, to) => Array.from({ length: last - first }, (_, i) => columns.slice(from, to).map((c) => c[first + i]));
    const [all, wide] = [unknown.length, known.length];
    return { A: part(0, n, 0, n), B: part(0, n, n, wide), C: part(n, all, 0, n), D: part(n, all, n, wide) };
  }

  /** One communication step, both in s. */
  doStep(time, step) { this.#call("fmi2DoStep", time, step, 1); }

  terminate() { this.#call("fmi2Terminate"); }
  reset() { this.#call("fmi2Reset"); }

  /** A saved state, to be given to `setState`, `serializeState` and `freeState`. */
  getState() {
    const place = this.#arena.take(4);
    try {
      this.#call("fmi2GetFMUstate", place);
      return new Uint32Array(this.#memory.buffer, place, 1)[0];
    } finally {
      this.#arena.giveBack(place);
    }
  }

  setState(state) { this.#call("fmi2SetFMUstate", state); }

  freeState(state) { this.#withState(state, (place) => this.#call("fmi2FreeFMUstate", place)); }

  /** A saved state as bytes. */
  serializeState(state) {
    const place = this.#arena.take(4);
    this.#call("fmi2SerializedFMUstateSize", state, place);
    const size = new Uint32Array(this.#memory.buffer, place, 1)[0];
    const bytes = this.#arena.take(size);
    try {
      this.#call("fmi2SerializeFMUstate", state, bytes, size);
      return new Uint8Array(this.#memory.buffer, bytes, size).slice();
    } finally {
      [place, bytes].forEach((address) => this.#arena.giveBack(address));
    }
  }

  /** The saved state that the bytes are of. */
  deserializeState(bytes) {
    const from = this.#arena.take(bytes.length);
    new Uint8Array(this.#memory.buffer, from, bytes.length).set(bytes);
    try {
      return this.#withState(0, (place) => this.#call("fmi2DeSerializeFMUstate", from, bytes.length, place));
    } finally {
      this.#arena.giveBack(from);
    }
  }

  /** Frees the instance; nothing may be asked of it afterwards. */
  free() {
    if (!this.#dead) this.#fmi.fmi2FreeInstance(this.#component);
    this.#dead = true;
  }

  /** The size of the module's memory, bytes. */
  get memoryBytes() { return this.#memory.buffer.byteLength; }

  #withState(state, use) {
    const place = this.#arena.take(4);
    new Uint32Array(this.#memory.buffer, place, 1)[0] = state;
    try {
      use(place);
      return new Uint32Array(this.#memory.buffer, place, 1)[0];
    } finally {
      this.#arena.giveBack(place);
    }
  }

  #call(name, ...given) {
    if (this.#dead) throw new FmiError(name, FATAL, "the instance is unusable");
    if (!this.#fmi[name]) throw new FmiError(name, 3, "the module does not export it");
    this.#said = "";
    let status;
    try {
      status = this.#fmi[name](this.#component, ...given);
    } catch (trap) {
      // a panic cannot be caught in WebAssembly: it traps, and the instance's memory is in no known state
      this.#dead = true;
      throw new FmiError(name, FATAL, `the module trapped: ${trap.message}`);
    }
    if (status === FATAL) this.#dead = true;
    if (status !== OK && status !== WARNING) throw new FmiError(name, status, this.#said);
  }

  #read(kind, names) {
    const count = names.length;
    const at = this.#arena.take(4 * count), to = this.#arena.take(8 * count);
    try {
      new Uint32Array(this.#memory.buffer, at, count).set(names.map((name) => this.#variable(name).reference));
      this.#call(`fmi2Get${kind}`, at, count, to);
      return [...this.#array(kind, to, count)];
    } finally {
      [at, to].forEach((address) => this.#arena.giveBack(address));
    }
  }

  #array(kind, address, count) {
    const View = { Real: Float64Array, Integer: Int32Array, Boolean: Int32Array, String: Uint32Array }[kind];
    return new View(this.#memory.buffer, address, count);
  }

  #variable(name) {
    const variable = this.description.variables.get(name);
    if (!variable) throw new Error(`${this.description.modelName} has no variable ${name}`);
    return variable;
  }

  #typed(name, type) {
    const variable = this.#variable(name);
    if (variable.type !== type) throw new Error(`${name} is ${variable.type} (allowed: ${type})`);
    return variable;
  }

  #text(text) {
    const bytes = encoder.encode(text);
    const address = this.#arena.take(bytes.length + 1);
    new Uint8Array(this.#memory.buffer, address, bytes.length + 1).set([...bytes, 0]);
    return address;
  }

  #textAt(address) {
    if (!address) return "";
    const bytes = new Uint8Array(this.#memory.buffer, address);
    return decoder.decode(bytes.slice(0, bytes.indexOf(0)));
  }

  #log(status, category, format, rest) {
    const message = printf(this.#textAt(format), new DataView(this.#memory.buffer, rest), (at) => this.#textAt(at));
    if (status !== OK && status !== WARNING) this.#said = message;
    this.#logger(STATUS[status] ?? String(status), this.#textAt(category), message);
  }
}

// The C type that a variable goes by.
function cType({ type }) {
  return type === "Enumeration" ? "Integer" : type;
}

function asC({ name, type, items }, value) {
  const wrong = (allowed) => new Error(`${name}: ${JSON.stringify(value)} (allowed: ${allowed})`);
  if (type === "Enumeration" && typeof value === "string") {
    if (!items.has(value)) throw wrong([...items.keys()].join(", "));
    return items.get(value);
  }
  if (type === "String") return String(value);
  if (type === "Boolean") return Number(Boolean(value));
  if (typeof value !== "number" || (type !== "Real" && !Number.isInteger(value))) throw wrong(type === "Real" ? "a number" : "an integer");
  return value;
}

// Memory for what the host hands over, in pages of its own: a module's allocator takes pages too, and leaves those alone
// that it did not get. Sizes are rounded up to powers of 2; what comes back waits for the next of its size.
class Arena {
  #memory; #free = new Map(); #sizes = new Map(); #next = 0; #end = 0;

  constructor(memory) {
    this.#memory = memory;
  }

  // The address of so many bytes, all 0; 0 where there is no memory.
  take(bytes) {
    const size = Math.max(16, 2 ** Math.ceil(Math.log2(bytes || 1)));
    let address = this.#free.get(size)?.pop();
    if (address === undefined) {
      if (this.#next + size > this.#end) {
        const pages = Math.ceil(size / PAGE);
        try {
          this.#next = this.#memory.grow(pages) * PAGE;
        } catch {
          return 0;
        }
        this.#end = this.#next + pages * PAGE;
      }
      address = this.#next;
      this.#next += size;
      this.#sizes.set(address, size);
    }
    new Uint8Array(this.#memory.buffer, address, size).fill(0);
    return address;
  }

  giveBack(address) {
    const size = this.#sizes.get(address);
    if (!size) return; // NULL
    if (!this.#free.has(size)) this.#free.set(size, []);
    this.#free.get(size).push(address);
  }
}

// A C pointer to a function of JavaScript: its place in the module's table. A table takes functions of modules alone, so
// a small module imports the function and exports it with the signature: "i" for each parameter and result of 32 bits.
function pointer(exports, parameters, results, body) {
  const types = (letters) => [letters.length, ...[...letters].map(() => 0x7f)];
  const section = (id, bytes) => [id, bytes.length, ...bytes];
  const binary = new Uint8Array([
    0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0,
    ...section(1, [1, 0x60, ...types(parameters), ...types(results)]), // one type of functions
    ...section(2, [1, 1, 0x65, 1, 0x66, 0, 0]), // import e.f of that type
    ...section(7, [1, 1, 0x66, 0, 0]), // export it as f
  ]);
  const { f } = new WebAssembly.Instance(new WebAssembly.Module(binary), { e: { f: body } }).exports;
  const table = exports.__indirect_function_table;
  const place = table.grow(1);
  table.set(place, f);
  return place;
}

// C's printf, for the messages of loggers. `rest` is where the arguments lie, each aligned to its size.
function printf(format, rest, textAt) {
  let at = 0;
  const next = (size, read) => {
    at = Math.ceil(at / size) * size;
    const value = rest[read](at, true);
    at += size;
    return value;
  };
  return format.replace(/%[-+ #\d]*(?:\.(\d+))?(hh|h|ll|l|z|j|t|L)?([diuxXcsgGeEfFp%])/g, (_, digits, length, kind) => {
    const wide = length === "ll" || length === "j";
    const precision = digits === undefined ? 6 : Math.min(Number(digits), 100); // what toFixed allows
    switch (kind) {
      case "%": return "%";
      case "s": return textAt(next(4, "getUint32"));
      case "c": return String.fromCodePoint(next(4, "getUint32"));
      case "d": case "i": return String(wide ? next(8, "getBigInt64") : next(4, "getInt32"));
      case "u": return String(wide ? next(8, "getBigUint64") : next(4, "getUint32"));
      case "x": case "X": case "p": return (wide ? next(8, "getBigUint64") : next(4, "getUint32")).toString(16);
      case "e": case "E": return next(8, "getFloat64").toExponential(precision);
      case "f": case "F": return next(8, "getFloat64").toFixed(precision);
      default: return String(Number(next(8, "getFloat64").toPrecision(precision || 1)));
    }
  });
}
