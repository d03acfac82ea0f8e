//! The rules for FMUs 3.0, by the text of FMI 3.0.2. Those of the archive and of reading XML are shared with FMI 2.0.

use crate::findings::Severity::{Error, Warning};
use crate::rule::Check::{Archive, Binaries, Calls3, Description};
use crate::rule::{Rule, rule};
use crate::v3::{archive, calls, steps, variables as variables3};
use crate::{definitions, life, log, portable, reading, schema, structure, variables};

#[rustfmt::skip]
pub static RULES: &[Rule] = &[
    rule("zip.readable", Error, "the file is a whole zip archive; every file unpacks, checksums, sizes and both headers of each agree", "2.5", Archive(crate::archive::readable)),
    rule("zip.methods", Error, "files are stored or deflated, not encrypted", "2.5", Archive(crate::archive::methods)),
    rule("zip.names", Error, "names are relative, with `/` between the parts, and stay inside", "2.5", Archive(crate::archive::names)),
    rule("zip.windows_names", Error, "names can be written on Windows", "hosts that unpack on Windows", Archive(portable::windows_names)),
    rule("zip.path_length", Warning, "paths have at most 160 characters, their parts at most 255 bytes", "Windows opens 259 characters, temporary folder included", Archive(portable::path_length)),
    rule("zip.file_and_folder", Error, "no file is a folder as well", "no host can unpack both", Archive(portable::file_and_folder)),
    rule("zip.links", Error, "no symbolic links", "2.5", Archive(crate::archive::links)),
    rule("zip.duplicates", Error, "no two files have the same name, apart from capitals, full stops and spaces at the end, and what follows a colon", "Windows and macOS keep one of them", Archive(crate::archive::duplicates)),
    rule("zip.description", Error, "modelDescription.xml is at the root", "2.5.1", Archive(crate::archive::description)),
    rule("zip.folders", Warning, "only files and folders of FMI 3.0 at the top", "2.5.1", Archive(archive::folders)),
    rule("zip.licenses", Error, "documentation/licenses has license.spdx, license.txt or license.html", "2.5.1.1.1", Archive(archive::licenses)),
    rule("zip.pictures", Error, "icon.svg and diagram.svg come with a .png", "2.5.1", Archive(archive::pictures)),
    rule("zip.terminals", Error, "terminalsAndIcons.xml is well-formed and of the description's fmiVersion", "2.4.9", Archive(archive::terminals)),
    rule("zip.extra", Warning, "extra/ holds folders in reverse domain notation", "2.5.1.6", Archive(archive::extra)),
    rule("zip.layered_standards", Error, "manifests of layered standards have name, version and description", "2.6", Archive(archive::layered_standards)),

    rule("xml.well_formed", Error, "modelDescription.xml is well-formed XML in UTF-8", "2.4", Archive(definitions::well_formed)),
    rule("xml.encoding", Error, "the first line of modelDescription.xml declares UTF-8", "2.4", Archive(reading::utf8)),
    rule("xml.size", Error, "modelDescription.xml is within the budgets of a host", "hosts that read the tree by recursion", Archive(reading::size)),
    rule("xml.doctype", Error, "modelDescription.xml has no document type declaration and no entities of its own", "parsers refuse it, expand entities without bound or open other files", Archive(reading::doctype)),
    rule("xml.schema", Error, "elements and attributes are those of the schema, in its order, none missing", "2.4, fmi3ModelDescription.xsd", Description(schema::structure)),
    rule("xml.values", Error, "attributes are written as the schema says", "2.4, fmi3ModelDescription.xsd", Description(schema::values)),
    rule("xml.fmi_version", Error, "fmiVersion is exactly 3.0", "2.4.1", Description(definitions::fmi_version)),
    rule("xml.token", Error, "there is an instantiationToken", "2.4.1", Description(definitions::token)),
    rule("xml.interfaces", Error, "ModelExchange, CoSimulation or ScheduledExecution is there", "2.4.1", Description(definitions::interfaces)),
    rule("xml.model_identifier", Error, "modelIdentifier is an identifier of C", "2.4.2", Description(definitions::model_identifier)),
    rule("xml.capabilities", Error, "capability flags do not contradict each other", "2.4.2, 4.4", Description(definitions::capabilities)),
    rule("xml.default_experiment", Error, "times of the default experiment are finite, steps and tolerances above 0, the stop not before the start", "2.4.6", Description(definitions::default_experiment3)),
    rule("xml.unique", Error, "names of units, display units, types, items and log categories, and values of items, are unique", "2.4.3 to 2.4.5", Description(definitions::unique)),
    rule("xml.units", Error, "every unit and displayUnit is defined, factors are finite and not 0", "2.4.3, 2.4.7.5", Description(definitions::units_with_numbers)),
    rule("xml.types", Error, "every declaredType is defined and of the variable's type", "2.4.4, 2.4.7.5", Description(definitions::types)),
    rule("xml.names", Error, "variables and aliases have names, each its own", "2.4.7.3, 2.4.7.5.1", Description(variables::names)),
    rule("xml.structured_names", Error, "names follow the declared naming convention", "2.4.7.5.1", Description(variables::structured_names)),
    rule("xml.references", Error, "every variable has a value reference of its own", "2.4.7.4", Description(variables3::references)),
    rule("xml.causality", Error, "causality, variability and type go together", "2.4.7.4, table of variability and causality", Description(variables::causality)),
    rule("xml.initial", Error, "initial is allowed with the causality and variability", "2.4.7.5, table of initial", Description(variables::initial)),
    rule("xml.start", Error, "start values are there where they must be and nowhere else: one, or one for each element", "2.4.7.5", Description(variables::start)),
    rule("xml.finite", Error, "start, min, max and nominal are finite, nominal is above 0", "2.4.7.5; no host can set NaN", Description(variables::finite)),
    rule("xml.range", Error, "min is not above max, start is between them and an item of its enumeration", "2.4.7.5", Description(variables::range)),
    rule("xml.independent", Error, "exactly one independent variable, a floating-point number without start, min, max and initial", "2.4.7.4", Description(variables3::independent)),
    rule("xml.flags", Error, "canHandleMultipleSetPerTimeInstant belongs to inputs, intermediateUpdate to continuous variables", "2.4.7.4", Description(variables3::flags)),
    rule("xml.clocks", Error, "clocks and previous name variables that may be meant", "2.4.7.4", Description(variables3::clocks)),
    rule("xml.dimensions", Error, "a Dimension has start or valueReference, that of a structural parameter or constant of type UInt64 that starts above 0", "2.4.7.2, 2.4.7.4", Description(variables3::dimensions)),
    rule("xml.derivatives_of", Error, "derivative names another continuous floating-point number of the same dimensions; reinit belongs to states", "2.4.7.5", Description(variables3::derivatives_of)),
    rule("xml.outputs", Error, "ModelStructure lists every output once", "2.4.8", Description(structure::outputs)),
    rule("xml.derivatives", Error, "ContinuousStateDerivative lists variables with the attribute derivative, one for each state", "2.4.8", Description(structure::derivatives3)),
    rule("xml.clocked_states", Error, "ClockedState lists every variable with the attribute previous", "2.4.8", Description(structure::clocked_states)),
    rule("xml.initial_unknowns", Error, "InitialUnknown lists what is computed at the start, each once, and nothing else", "2.4.8", Description(structure::initial_unknowns)),
    rule("xml.event_indicators", Error, "EventIndicator lists continuous floating-point numbers, each once", "2.4.8", Description(structure::event_indicators)),
    rule("xml.structure_references", Error, "value references of ModelStructure are those of variables", "2.4.8", Description(structure::references)),
    rule("xml.dependencies", Error, "each dependency is listed once and has its kind, of those allowed for the unknown", "2.4.8", Description(structure::dependencies)),
    rule("xml.dependencies_known", Error, "dependencies are on knowns", "2.4.8", Description(structure::dependencies_known)),

    rule("bin.present", Error, "there is a library of the model's name for a platform tuple or in a vendor's folder, or sources", "2.5", Binaries(crate::binaries::present)),
    rule("bin.tuples", Error, "folders are platform tuples, not the names of FMI 2.0", "2.5.1.4.1", Archive(archive::tuples)),
    rule("bin.name", Error, "libraries are called modelIdentifier and the platform's ending", "2.5.1.4", Binaries(crate::binaries::name)),
    rule("bin.format", Error, "libraries are for the platform whose folder they are in", "2.5.1.4.1", Binaries(crate::binaries::format)),
    rule("bin.symbols", Error, "all 75 functions are exported", "2.5", Binaries(crate::binaries::symbols)),
    rule("bin.this_platform", Warning, "there is a library for the platform of the check; without it no calls are made", "what is not called is not checked", Binaries(crate::binaries::this_platform)),

    rule("load.opens", Error, "the library for this platform can be loaded", "2.5.1.4", Calls3(life::opens)),
    rule("load.version", Error, "fmi3GetVersion says 3.0", "2.2.5", Calls3(life::version)),
    rule("load.instance", Error, "instances are made for every declared use", "2.3.1", Calls3(life::instance)),
    rule("load.initialises", Error, "an instance initialises with the declared start values", "2.3.2, 2.3.3", Calls3(life::initialises)),

    rule("instantiate.token", Error, "another instantiationToken is refused with NULL and a message", "2.3.1", Calls3(calls::token)),
    rule("instantiate.callbacks", Error, "logMessage and intermediateUpdate may be NULL", "2.3.1, 4.2.2", Calls3(calls::callbacks)),
    rule("instantiate.free_null", Error, "fmi3FreeInstance(NULL) does nothing", "2.3.1", Calls3(life::free_null)),

    rule("life.deterministic", Error, "the same run gives the same bits, whatever other instances do", "2.3.1; hosts that compare with a reference", Calls3(calls::deterministic)),
    rule("life.reset", Error, "after fmi3Reset a run is that of a new instance to the last bit", "2.3.1", Calls3(life::reset)),
    rule("life.terminate", Error, "fmi3Terminate returns fmi3OK, and values can be read after it", "2.3.6", Calls3(life::terminate)),

    rule("values.readable", Error, "every variable can be read once it is initialised", "2.2.6.2", Calls3(calls::readable)),
    rule("values.start", Error, "what has initial=exact starts as modelDescription.xml says", "2.4.7.5", Calls3(calls::start)),
    rule("values.set", Error, "what was set before initialization is read, element by element, or refused with a message", "2.2.6.2, 2.2.6.1", Calls3(calls::set)),
    rule("values.type", Error, "a variable is refused by the calls of another type", "2.2.6.2", Calls3(calls::type_mismatch)),
    rule("values.unknown", Error, "a value reference that no variable has is refused", "2.2.6.2", Calls3(calls::unknown)),
    rule("values.counts", Error, "no more than nValues values are written", "2.2.6.2", Calls3(calls::counts)),
    rule("values.booleans", Error, "Booleans are 0 or 1", "2.2.3", Calls3(calls::booleans)),
    rule("values.fixed", Warning, "a fixed parameter does not change after initialization", "2.4.7.4; hosts that set it by mistake", Calls3(calls::fixed)),

    rule("states.restore", Error, "after fmi3SetFMUState values and the run from there are the same to the last bit", "2.2.7.4", Calls3(calls::restore)),
    rule("states.serialize", Error, "a serialised state is the state; bytes cut short are refused", "2.2.7.4", Calls3(calls::serialize)),

    rule("log.environment", Error, "logMessage and intermediateUpdate are given the instanceEnvironment of the instance", "2.3.1, 4.2.2; hosts follow that pointer and crash", Calls3(calls::log_environment)),
    rule("log.categories", Error, "messages have a declared category", "2.3.1, 2.4.5", Calls3(log::categories)),
    rule("log.errors", Warning, "an error comes with a message", "2.2.3", Calls3(calls::log_errors)),

    rule("steps.run", Error, "an ordinary run succeeds in every declared use, and outputs are finite after each step", "3.2, 4.2", Calls3(steps::runs)),
    rule("steps.answers", Error, "fmi3DoStep writes its four answers; no early return and no event where the host did not allow them; lastSuccessfulTime is where the FMU is", "4.2.1", Calls3(steps::answers)),
    rule("steps.wrong", Warning, "a step of negative size is refused", "4.2.1", Calls3(steps::wrong)),

    rule("events.iteration", Error, "an event iteration ends, and so do events in one step", "2.3.5", Calls3(steps::iterates)),
    rule("events.answers", Error, "fmi3UpdateDiscreteStates writes its answers; nextEventTime lies ahead", "2.3.5", Calls3(steps::event_answers)),
    rule("events.idempotent", Error, "another fmi3UpdateDiscreteStates at the same instant changes nothing", "2.3.5", Calls3(steps::idempotent)),
    rule("events.discrete_held", Error, "with event mode discrete variables change in event mode alone", "2.4.7.4", Calls3(steps::discrete_held)),
    rule("events.same_trajectory", Warning, "event mode and early return change when events are reported, not the trajectory", "4.2; hosts without event mode", Calls3(steps::same_trajectory)),

    rule("intermediate.time", Error, "intermediateUpdate is called within the step, never before a time that is finished, and without early return where that is not allowed", "4.2.2", Calls3(steps::intermediate_time)),
    rule("intermediate.early_return", Error, "an early return that was offered and asked for is made", "4.2.2", Calls3(steps::intermediate_early_return)),
    rule("intermediate.inputs", Error, "inputs set in intermediate update count", "4.2.2", Calls3(steps::intermediate_inputs)),

    rule("exchange.counts", Error, "numbers of states and event indicators are those of ModelStructure", "2.4.8, 3.2.1", Calls3(calls::exchange_counts)),
    rule("exchange.vectors", Error, "states, derivatives and indicators are in the order of ModelStructure, the same as by fmi3GetFloat64", "2.4.8, 3.2.1", Calls3(calls::exchange_vectors)),
    rule("exchange.states_set", Error, "states that are set are read", "3.2.1", Calls3(calls::states_set)),
    rule("exchange.indicators", Error, "no event indicator is 0 after event mode", "3.1.1", Calls3(calls::indicators)),

    rule("derivatives.directional", Error, "directional derivatives are those of central differences", "2.2.12.1", Calls3(steps::directional)),
    rule("derivatives.adjoint", Error, "adjoint derivatives are the transpose of directional ones", "2.2.12.2", Calls3(steps::adjoint)),
    rule("dependencies.declared", Error, "outputs, derivatives and indicators follow declared dependencies alone", "2.4.8", Calls3(steps::declared)),
    rule("dependencies.elements", Error, "dependencies that the FMU tells are among those declared", "2.2.9", Calls3(steps::elements)),
];
