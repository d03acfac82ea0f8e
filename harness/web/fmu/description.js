// modelDescription.xml of FMI 2.0, as far as a host of Co-Simulation needs it, or one that linearises.

// The elements of an XML text in document order: name, attributes, depth. Enough for a description, whose data stand in
// attributes; comments, processing instructions and CDATA are passed over.
function* elements(xml) {
  const tags = /<!--[\s\S]*?-->|<\?[\s\S]*?\?>|<!\[CDATA\[[\s\S]*?\]\]>|<!DOCTYPE[^>]*>|<\/[^>]*>|<([\w:.-]+)((?:\s+[\w:.-]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*(\/?)>/g;
  let depth = 0;
  for (const [text, name, attributes, closed] of xml.matchAll(tags)) {
    if (text.startsWith("</")) depth -= 1;
    if (!name) continue;
    const of = {};
    for (const [, key, , a, b] of attributes.matchAll(/([\w:.-]+)\s*=\s*("([^"]*)"|'([^']*)')/g)) {
      of[key] = decoded(a ?? b);
    }
    yield { name, of, depth };
    if (!closed) depth += 1;
  }
}

const ENTITIES = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };

function decoded(text) {
  return text.replace(/&(#x[0-9a-fA-F]+|#\d+|\w+);/g, (all, entity) => {
    if (entity[0] !== "#") return ENTITIES[entity] ?? all;
    const code = entity[1] === "x" ? parseInt(entity.slice(2), 16) : parseInt(entity.slice(1), 10);
    return String.fromCodePoint(code);
  });
}

const TYPES = ["Real", "Integer", "Boolean", "String", "Enumeration"];

/**
 * Reads a model description.
 *
 * `variables` is a Map by name. Each has `reference` (value reference), `type` (Real, Integer, Boolean, String,
 * Enumeration), `causality`, `variability`, `description`, `unit`, `min`, `max`, `start` (numbers, texts or booleans
 * where the XML has them) and, if it is an enumeration, `items` (a Map from the item's name to its value).
 * `states` is a list of the names of the continuous states, each with that of its derivative.
 *
 * @param {string} xml the text of modelDescription.xml
 * @throws {Error} if it describes no FMU 2.0 for Co-Simulation
 */
export function readDescription(xml) {
  const found = { fmiVersion: "", modelName: "", guid: "", modelIdentifier: "", variables: new Map(), states: [], experiment: {} };
  const types = new Map(), derivatives = [];
  let type, variable, section;
  for (const { name, of } of elements(xml)) {
    if (name === "fmiModelDescription") {
      Object.assign(found, { fmiVersion: of.fmiVersion, modelName: of.modelName, guid: of.guid });
    } else if (name === "CoSimulation") {
      found.modelIdentifier = of.modelIdentifier;
      found.canGetAndSetState = of.canGetAndSetFMUstate === "true";
      found.canInterpolateInputs = of.canInterpolateInputs === "true";
    } else if (name === "DefaultExperiment") {
      for (const key of ["startTime", "stopTime", "tolerance", "stepSize"]) {
        if (of[key] !== undefined) found.experiment[key] = Number(of[key]);
      }
    } else if (name === "SimpleType") {
      types.set(of.name, (type = { items: new Map() }));
    } else if (name === "ScalarVariable") {
      variable = {
        name: of.name,
        reference: Number(of.valueReference),
        description: of.description ?? "",
        causality: of.causality ?? "local",
        variability: of.variability ?? "continuous",
      };
      found.variables.set(of.name, variable);
    } else if (name === "Item" && type) {
      type.items.set(of.name, Number(of.value));
    } else if (["Outputs", "Derivatives", "InitialUnknowns"].includes(name)) {
      section = name;
    } else if (name === "Unknown" && section === "Derivatives") {
      derivatives.push(Number(of.index));
    } else if (TYPES.includes(name) && variable && variable.type === undefined) {
      Object.assign(variable, typed(name, of, types.get(of.declaredType)));
    } else if (TYPES.includes(name) && !variable && type) {
      type.of = of;
    }
  }
  if (found.fmiVersion !== "2.0") {
    throw new Error(`the model description is of FMI ${found.fmiVersion || "no version"} (allowed: 2.0)`);
  }
  if (!found.modelIdentifier) throw new Error(`${found.modelName} has no Co-Simulation interface`);
  const all = [...found.variables.values()];
  found.states = derivatives.map((index) => {
    const { name, derivative } = all[index - 1];
    return { state: all[derivative - 1].name, derivative: name };
  });
  return found;
}

function typed(type, own, declared) {
  const of = { ...declared?.of, ...own };
  const read = type === "String" ? String : type === "Boolean" ? (text) => text === "true" || text === "1" : Number;
  const result = { type, unit: of.unit ?? "" };
  for (const key of ["start", "min", "max", "nominal", "derivative"]) if (of[key] !== undefined) result[key] = read(of[key]);
  if (type === "Enumeration") result.items = declared?.items ?? new Map();
  return result;
}
