//! The rules for FMUs 3.0, by the text of FMI 3.0.2. Those of the archive and of reading XML are shared with FMI 2.0.

use crate::findings::Severity::{Error, Warning};
use crate::rule::Check::{Archive, Binaries, Calls3, Description};
use crate::rule::{Rule, rule};
use crate::v3::{archive, calls, steps, variables as variables3};
use crate::{definitions, life, log, portable, reading, schema, structure, variables};

#[rustfmt::skip]
pub static RULES: &[Rule] = &[
    rule("zip.readable", Error, "the file is a complete zip archive; every file in it can be unpacked, and its checksum, its sizes and its two headers agree", "2.5", Archive(crate::archive::readable)),
    rule("zip.methods", Error, "files are stored or deflated, not encrypted", "2.5", Archive(crate::archive::methods)),
    rule("zip.names", Error, "names of files are relative paths with `/` between the parts, which do not lead out of the archive", "2.5", Archive(crate::archive::names)),
    rule("zip.windows_names", Error, "Windows can store the names of all files", "hosts that unpack on Windows", Archive(portable::windows_names)),
    rule("zip.path_length", Warning, "paths have at most 160 characters, their parts at most 255 bytes", "Windows opens 259 characters, temporary folder included", Archive(portable::path_length)),
    rule("zip.file_and_folder", Error, "no file has the name of a folder", "no host can unpack both", Archive(portable::file_and_folder)),
    rule("zip.links", Error, "the archive contains no symbolic links", "2.5", Archive(crate::archive::links)),
    rule("zip.duplicates", Error, "no two names differ only in capitals, in full stops and spaces at the end, or in the text after a colon", "Windows and macOS keep one of them", Archive(crate::archive::duplicates)),
    rule("zip.description", Error, "modelDescription.xml is at the root of the archive", "2.5.1", Archive(crate::archive::description)),
    rule("zip.folders", Warning, "the root of the archive contains only files and folders that FMI 3.0 defines", "2.5.1", Archive(archive::folders)),
    rule("zip.licenses", Error, "documentation/licenses, if it exists, contains license.spdx, license.txt or license.html", "2.5.1.1.1", Archive(archive::licenses)),
    rule("zip.pictures", Error, "for icon.svg and for diagram.svg there is a .png file of the same name", "2.5.1", Archive(archive::pictures)),
    rule("zip.terminals", Error, "terminalsAndIcons.xml is well-formed and has the fmiVersion of modelDescription.xml", "2.4.9", Archive(archive::terminals)),
    rule("zip.extra", Warning, "the folders in extra/ have names in reverse domain notation", "2.5.1.6", Archive(archive::extra)),
    rule("zip.layered_standards", Error, "manifests of layered standards have name, version and description", "2.6", Archive(archive::layered_standards)),

    rule("xml.well_formed", Error, "modelDescription.xml is well-formed XML in UTF-8", "2.4", Archive(definitions::well_formed)),
    rule("xml.encoding", Error, "the first line of modelDescription.xml declares UTF-8", "2.4", Archive(reading::utf8)),
    rule("xml.size", Error, "modelDescription.xml does not exceed the limits of the rule xml.size for FMI 2.0", "hosts that read the tree by recursion", Archive(reading::size)),
    rule("xml.doctype", Error, "modelDescription.xml has no document type declaration and no entities of its own", "parsers refuse it, expand entities without bound or open other files", Archive(reading::doctype)),
    rule("xml.schema", Error, "elements and attributes are those of the schema, the elements in its order, and none is missing", "2.4, fmi3ModelDescription.xsd", Description(schema::structure)),
    rule("xml.values", Error, "values of attributes have the format of the schema", "2.4, fmi3ModelDescription.xsd", Description(schema::values)),
    rule("xml.fmi_version", Error, "fmiVersion is exactly 3.0", "2.4.1", Description(definitions::fmi_version)),
    rule("xml.token", Error, "the attribute instantiationToken is not empty", "2.4.1", Description(definitions::token)),
    rule("xml.interfaces", Error, "there is an element ModelExchange, CoSimulation or ScheduledExecution", "2.4.1", Description(definitions::interfaces)),
    rule("xml.model_identifier", Error, "modelIdentifier is an identifier of C", "2.4.2", Description(definitions::model_identifier)),
    rule("xml.capabilities", Error, "capability flags do not contradict each other", "2.4.2, 4.4", Description(definitions::capabilities)),
    rule("xml.default_experiment", Error, "times of the default experiment are finite, steps and tolerances above 0, the stop not before the start", "2.4.6", Description(definitions::default_experiment3)),
    rule("xml.unique", Error, "names of units, display units, types, items and log categories, and values of items, are unique", "2.4.3 to 2.4.5", Description(definitions::unique)),
    rule("xml.units", Error, "every unit and displayUnit is defined, factors are finite and not 0", "2.4.3, 2.4.7.5", Description(definitions::units_with_numbers)),
    rule("xml.types", Error, "every declaredType is defined and of the variable's type", "2.4.4, 2.4.7.5", Description(definitions::types)),
    rule("xml.names", Error, "every variable and every alias has a name, and no two names are equal", "2.4.7.3, 2.4.7.5.1", Description(variables::names)),
    rule("xml.structured_names", Error, "names follow the declared naming convention", "2.4.7.5.1", Description(variables::structured_names)),
    rule("xml.references", Error, "no two variables have the same value reference", "2.4.7.4", Description(variables3::references)),
    rule("xml.causality", Error, "the standard allows the combination of causality, variability and type", "2.4.7.4, table of variability and causality", Description(variables::causality)),
    rule("xml.initial", Error, "the standard allows the value of initial for the causality and variability", "2.4.7.5, table of initial", Description(variables::initial)),
    rule("xml.start", Error, "exactly the variables that need a start value have one, or one for each element", "2.4.7.5", Description(variables::start)),
    rule("xml.finite", Error, "start, min, max and nominal are finite, nominal is above 0", "2.4.7.5; no host can set NaN", Description(variables::finite)),
    rule("xml.range", Error, "min is not above max, and start is between them; the start value of an enumeration is one of its items", "2.4.7.5", Description(variables::range)),
    rule("xml.independent", Error, "there is exactly one independent variable, a floating-point number without start, min, max and initial", "2.4.7.4", Description(variables::independent)),
    rule("xml.flags", Error, "only inputs have canHandleMultipleSetPerTimeInstant, and only continuous variables have intermediateUpdate", "2.4.7.4", Description(variables3::flags)),
    rule("xml.clocks", Error, "the attributes clocks and previous name variables that the standard allows there", "2.4.7.4", Description(variables3::clocks)),
    rule("xml.dimensions", Error, "a Dimension has either start or the valueReference of a structural parameter or constant of type UInt64 with a start value above 0", "2.4.7.2, 2.4.7.4", Description(variables3::dimensions)),
    rule("xml.derivatives_of", Error, "the attribute derivative names another continuous floating-point variable of the same dimensions; only states have reinit", "2.4.7.5", Description(variables::derivatives_of)),
    rule("xml.outputs", Error, "ModelStructure lists every output once", "2.4.8", Description(structure::outputs)),
    rule("xml.derivatives", Error, "ContinuousStateDerivative lists variables with the attribute derivative, one for each state", "2.4.8", Description(structure::derivatives)),
    rule("xml.clocked_states", Error, "ClockedState lists every variable with the attribute previous", "2.4.8", Description(structure::clocked_states)),
    rule("xml.initial_unknowns", Error, "InitialUnknown lists exactly the variables that are computed at the start, each once", "2.4.8", Description(structure::initial_unknowns)),
    rule("xml.event_indicators", Error, "EventIndicator lists continuous floating-point numbers, each once", "2.4.8", Description(structure::event_indicators)),
    rule("xml.structure_references", Error, "value references in ModelStructure belong to variables", "2.4.8", Description(structure::references)),
    rule("xml.dependencies", Error, "each dependency is listed once and, if kinds are given, has a dependenciesKind that is allowed for the unknown", "2.4.8", Description(structure::dependencies)),
    rule("xml.dependencies_known", Error, "unknowns depend only on variables that the standard counts as knowns", "2.4.8", Description(structure::dependencies_known)),

    rule("bin.present", Error, "there are sources, or a library with the model's name in the folder of a platform tuple or of a vendor", "2.5", Binaries(crate::binaries::present)),
    rule("bin.tuples", Error, "folders of binaries have the names of platform tuples, not those of FMI 2.0", "2.5.1.4.1", Archive(archive::tuples)),
    rule("bin.name", Error, "the name of a library is modelIdentifier with the ending of the platform", "2.5.1.4", Binaries(crate::binaries::name)),
    rule("bin.format", Error, "libraries are for the platform whose folder they are in", "2.5.1.4.1", Binaries(crate::binaries::format)),
    rule("bin.symbols", Error, "all 75 functions are exported", "2.5", Binaries(crate::binaries::symbols)),
    rule("bin.this_platform", Warning, "there is a library for the platform of the check; without it the rules of calls are skipped", "a binary that cannot be called is not checked", Binaries(crate::binaries::this_platform)),

    rule("load.opens", Error, "the library for this platform can be loaded", "2.5.1.4", Calls3(life::opens)),
    rule("load.version", Error, "fmi3GetVersion returns 3.0", "2.2.5", Calls3(life::version)),
    rule("load.instance", Error, "the FMU creates instances for every use that it declares", "2.3.1", Calls3(life::instance)),
    rule("load.initialises", Error, "an instance can be initialised with the declared start values", "2.3.2, 2.3.3", Calls3(life::initialises)),

    rule("instantiate.token", Error, "for a wrong instantiationToken the FMU returns NULL and logs a message", "2.3.1", Calls3(calls::token)),
    rule("instantiate.callbacks", Error, "logMessage and intermediateUpdate may be NULL", "2.3.1, 4.2.2", Calls3(calls::callbacks)),
    rule("instantiate.free_null", Error, "fmi3FreeInstance(NULL) does nothing", "2.3.1", Calls3(life::free_null)),

    rule("life.deterministic", Error, "equal runs give bit-identical results, also while other instances run", "2.3.1; hosts that compare with a reference", Calls3(calls::deterministic)),
    rule("life.reset", Error, "after fmi3Reset a run is bit-identical to the run of a new instance", "2.3.1", Calls3(life::reset)),
    rule("life.terminate", Error, "fmi3Terminate returns fmi3OK, and values can be read after it", "2.3.6", Calls3(life::terminate)),

    rule("values.readable", Error, "every variable can be read after initialisation", "2.2.6.2", Calls3(calls::readable)),
    rule("values.start", Error, "variables with initial=exact start with the value in modelDescription.xml", "2.4.7.5", Calls3(calls::start)),
    rule("values.set", Error, "a value that is set before initialization is either read again, element by element, or refused with a message", "2.2.6.2, 2.2.6.1", Calls3(calls::set)),
    rule("values.type", Error, "calls of another type refuse a variable", "2.2.6.2", Calls3(calls::type_mismatch)),
    rule("values.unknown", Error, "a value reference that no variable has is refused", "2.2.6.2", Calls3(calls::unknown)),
    rule("values.counts", Error, "the FMU writes at most nValues values", "2.2.6.2", Calls3(calls::counts)),
    rule("values.booleans", Error, "Booleans are 0 or 1", "2.2.3", Calls3(calls::booleans)),
    rule("values.fixed", Warning, "a fixed parameter does not change after initialization", "2.4.7.4; hosts that set it by mistake", Calls3(calls::fixed)),

    rule("states.restore", Error, "after fmi3SetFMUState the values and the following run are bit-identical", "2.2.7.4", Calls3(calls::restore)),
    rule("states.serialize", Error, "a serialised state restores the same state; truncated bytes are refused", "2.2.7.4", Calls3(calls::serialize)),

    rule("log.environment", Error, "logMessage and intermediateUpdate receive the instanceEnvironment of the instance", "2.3.1, 4.2.2; hosts follow this pointer and crash", Calls3(calls::log_environment)),
    rule("log.categories", Error, "messages have a declared category", "2.3.1, 2.4.5", Calls3(log::categories)),
    rule("log.errors", Warning, "the FMU logs a message for every error", "2.2.3", Calls3(calls::log_errors)),

    rule("steps.run", Error, "an ordinary run succeeds in every declared use, and outputs are finite after each step", "3.2, 4.2", Calls3(steps::runs)),
    rule("steps.answers", Error, "fmi3DoStep writes its four results; it returns early and reports events only if the host allows this; lastSuccessfulTime is the time that the FMU has reached", "4.2.1", Calls3(steps::answers)),
    rule("steps.wrong", Warning, "a step of negative size is refused", "4.2.1", Calls3(steps::wrong)),

    rule("events.iteration", Error, "event iterations end, and the number of events in one step is finite", "2.3.5", Calls3(steps::iterates)),
    rule("events.answers", Error, "fmi3UpdateDiscreteStates writes its results; nextEventTime is later than the present time", "2.3.5", Calls3(steps::event_answers)),
    rule("events.idempotent", Error, "another fmi3UpdateDiscreteStates at the same instant changes nothing", "2.3.5", Calls3(steps::idempotent)),
    rule("events.discrete_held", Error, "if event mode is used, discrete variables change only in event mode", "2.4.7.4", Calls3(steps::discrete_held)),
    rule("events.same_trajectory", Warning, "event mode and early return change the times at which events are reported, but not the trajectory", "4.2; hosts without event mode", Calls3(steps::same_trajectory)),

    rule("intermediate.time", Error, "intermediateUpdate is called with times within the step that never go back, and with early return only if the host allows it", "4.2.2", Calls3(steps::intermediate_time)),
    rule("intermediate.early_return", Error, "the FMU returns early if it has offered this and the host requests it", "4.2.2", Calls3(steps::intermediate_early_return)),
    rule("intermediate.inputs", Error, "inputs that are set in intermediate update have an effect", "4.2.2", Calls3(steps::intermediate_inputs)),

    rule("exchange.counts", Error, "the numbers of states and event indicators that the FMU returns are those of ModelStructure", "2.4.8, 3.2.1", Calls3(calls::exchange_counts)),
    rule("exchange.vectors", Error, "the vectors of states, derivatives and event indicators are in the order of ModelStructure and equal the values of fmi3GetFloat64", "2.4.8, 3.2.1", Calls3(calls::exchange_vectors)),
    rule("exchange.states_set", Error, "states are read with the values that were set", "3.2.1", Calls3(calls::states_set)),
    rule("exchange.indicators", Error, "no event indicator is 0 after event mode", "3.1.1", Calls3(calls::indicators)),

    rule("derivatives.directional", Error, "directional derivatives agree with central differences", "2.2.12.1", Calls3(steps::directional)),
    rule("derivatives.adjoint", Error, "adjoint derivatives are the transpose of directional derivatives", "2.2.12.2", Calls3(steps::adjoint)),
    rule("dependencies.declared", Error, "outputs, derivatives and event indicators depend only on variables that are declared as their dependencies", "2.4.8", Calls3(steps::declared)),
    rule("dependencies.elements", Error, "dependencies that fmi3GetVariableDependencies returns are declared in modelDescription.xml", "2.2.9", Calls3(steps::elements)),
];
