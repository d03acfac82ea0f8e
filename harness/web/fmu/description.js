// modelDescription.xml of FMI 2.0, as far as a host of Co-Simulation needs it, or one that linearises.

// Budgets of a description, those of harness/host/src/xml.rs.
const LONGEST_XML = 24 * 2 ** 20, MOST_ELEMENTS = 300000, MOST_ATTRIBUTES = 700000; // characters, elements, attributes

// What is passed over, by its begin and end.
const PASSED_OVER = [["<!--", "-->"], ["<?", "?>"], ["<![CDATA[", "]]>"], ["</", ">"]];

// The elements of an XML text in document order: name, attributes. Enough for a description, whose data stand in
// attributes. Looks at each character a bounded number of times: what does not end is an error.
function* elements(xml) {
  if (xml.length > LONGEST_XML) throw tooLarge(`${xml.length} characters`, LONGEST_XML);
  const names = /[^\s=<>"'/]+/y, attributes = /\s+([^\s=<>"'/]+)\s*=\s*(?:"([^"<]*)"|'([^'<]*)')/y, ends = /\s*(\/?)>/y;
  let count = 0, written = 0;
  const read = (pattern, at) => {
    pattern.lastIndex = at;
    return pattern.exec(xml);
  };
  for (let at = xml.indexOf("<"); at >= 0; at = xml.indexOf("<", at)) {
    const passed = PASSED_OVER.find(([begin]) => xml.startsWith(begin, at));
    if (passed) {
      const end = xml.indexOf(passed[1], at + passed[0].length);
      if (end < 0) throw illFormed(xml, at, `${passed[0]} without ${passed[1]}`);
      at = end + passed[1].length;
      continue;
    }
    if (xml.startsWith("<!", at)) throw new Error("the model description has a document type declaration (allowed: none)");
    const begin = at, name = read(names, at + 1)?.[0];
    if (!name) throw illFormed(xml, begin, "< without a name");
    at += 1 + name.length;
    const of = {};
    for (let found; (found = read(attributes, at)); at = attributes.lastIndex) {
      of[found[1]] = decoded(found[2] ?? found[3]);
      if ((written += 1) > MOST_ATTRIBUTES) throw tooLarge(`more than ${MOST_ATTRIBUTES} attributes`, MOST_ATTRIBUTES);
    }
    if (!read(ends, at)) throw illFormed(xml, begin, `<${name.slice(0, 60)} without >`);
    at = ends.lastIndex;
    if ((count += 1) > MOST_ELEMENTS) throw tooLarge(`more than ${MOST_ELEMENTS} elements`, MOST_ELEMENTS);
    yield { name, of };
  }
}

function tooLarge(what, most) {
  return new Error(`the model description has ${what} (allowed: ${most})`);
}

function illFormed(xml, at, what) {
  const line = xml.slice(0, at).split("\n").length;
  return new Error(`the model description is not well-formed XML: line ${line}: ${what}`);
}

const ENTITIES = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };

function decoded(text) {
  return text.replace(/&(#x[0-9a-fA-F]+|#[0-9]+|[a-z]+);/g, (all, entity) => {
    if (entity[0] !== "#") return ENTITIES[entity] ?? all;
    const code = entity[1] === "x" ? parseInt(entity.slice(2), 16) : parseInt(entity.slice(1), 10);
    if (code > 0x10ffff) throw new Error(`the model description has the character ${all.slice(0, 20)} (allowed: up to &#x10ffff;)`);
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
    const { name, derivative } = all[index - 1] ?? {};
    const state = all[derivative - 1];
    if (!state) throw new Error(`Derivatives of the model description list variable ${index}, which is the derivative of no variable`);
    return { state: state.name, derivative: name };
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
