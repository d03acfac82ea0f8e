//! The table of rules. The documentation shows it; a test compares the two.

use super::Severity::{Error, Warning};
use super::{
    Look, Rule, Severity, archive, binaries, dependencies, description, exchange, life, log,
    schema, states, steps, values,
};

const fn rule(
    id: &'static str,
    severity: Severity,
    title: &'static str,
    source: &'static str,
    look: Look,
) -> Rule {
    Rule { id, title, source, severity, look }
}

use Look::{Archive, Binaries, Calls, Description};

/// Every rule, group by group.
#[rustfmt::skip]
pub static RULES: &[Rule] = &[
    rule("zip.readable", Error, "the file is a whole zip archive; every file unpacks, checksums and both headers of each agree", "2.3", Archive(archive::readable)),
    rule("zip.methods", Error, "files are stored or deflated, not encrypted", "2.3", Archive(archive::methods)),
    rule("zip.names", Error, "names are relative, with `/` between the parts, and stay inside", "2.3; hosts that unpack on Linux", Archive(archive::names)),
    rule("zip.links", Error, "no symbolic links", "2.3; hosts that unpack on Windows", Archive(archive::links)),
    rule("zip.duplicates", Error, "no name twice, capitals aside", "Windows and macOS keep one of them", Archive(archive::duplicates)),
    rule("zip.description", Error, "modelDescription.xml is at the root", "2.3", Archive(archive::description)),
    rule("zip.description_first", Warning, "modelDescription.xml is the first entry", "hosts that read archives as streams", Archive(archive::description_first)),
    rule("zip.documentation", Warning, "documentation/index.html is there", "2.3", Archive(archive::documentation)),
    rule("zip.licenses", Warning, "documentation/licenses/ holds a licence", "2.3", Archive(archive::licenses)),
    rule("zip.folders", Warning, "only files and folders of FMI 2.0 at the top (and terminalsAndIcons, extra)", "2.3", Archive(archive::folders)),

    rule("xml.well_formed", Error, "modelDescription.xml is well-formed XML in UTF-8", "2.2", Archive(description::well_formed)),
    rule("xml.schema", Error, "elements and attributes are those of the schema, in its order, none missing", "2.2, fmi2ModelDescription.xsd", Description(schema::structure)),
    rule("xml.values", Error, "attributes are written as the schema says: whole numbers (exponents of BaseUnit too), decimal points, known words", "2.2, fmi2ModelDescription.xsd", Description(schema::values)),
    rule("xml.fmi_version", Error, "fmiVersion is exactly 2.0", "2.2.1", Description(description::fmi_version)),
    rule("xml.guid", Error, "there is a GUID", "2.2.1", Description(description::guid)),
    rule("xml.date", Warning, "generationDateAndTime is in UTC, like 2026-01-31T12:00:00Z", "2.2.1", Description(description::date)),
    rule("xml.interfaces", Error, "ModelExchange or CoSimulation is there", "2.2.1", Description(description::interfaces)),
    rule("xml.model_identifier", Error, "modelIdentifier is an identifier of C", "3.3.1, 4.3.1", Description(description::model_identifier)),
    rule("xml.capabilities", Error, "capability flags do not contradict each other", "3.3.1, 4.3.1", Description(description::capabilities)),
    rule("xml.state_capability", Warning, "states can be saved and serialised", "Simulink steps back and restarts fast only then; OMSimulator's adaptive masters refuse without", Description(description::state_capability)),
    rule("xml.default_experiment", Warning, "start, stop, tolerance and step of the default experiment make sense", "2.2.5", Description(description::default_experiment)),
    rule("xml.unique", Error, "names of units, display units, types, items and log categories, and values of items, are unique", "2.2.2 to 2.2.4", Description(description::unique)),
    rule("xml.units", Error, "every unit and displayUnit is defined and can be converted", "2.2.2, 2.2.7", Description(description::units)),
    rule("xml.types", Error, "every declaredType is defined, of the right type, and named like no variable", "2.2.3, 2.2.7", Description(description::types)),
    rule("xml.names", Error, "variables have names, each its own", "2.2.7", Description(description::names)),
    rule("xml.structured_names", Error, "names follow the declared naming convention", "2.2.9", Description(description::structured_names)),
    rule("xml.parameter_names", Warning, "names of parameters have at most 55 characters", "Simulink cuts them", Description(description::parameter_names)),
    rule("xml.flat_ports", Warning, "names of inputs and outputs have no points or brackets", "Simulink makes buses of them", Description(description::flat_ports)),
    rule("xml.causality", Error, "causality, variability and type go together", "2.2.7, table of variability and causality", Description(description::causality)),
    rule("xml.variability", Warning, "variability is written for all that is no Real", "2.2.7; the schema's default is continuous", Description(description::variability)),
    rule("xml.initial", Error, "initial is allowed with the causality and variability", "2.2.7, table of initial", Description(description::initial)),
    rule("xml.start", Error, "start values are there where they must be and nowhere else", "2.2.7", Description(description::start)),
    rule("xml.finite", Error, "start, min, max and nominal are finite, nominal is above 0", "2.2.7; no host can set NaN", Description(description::finite)),
    rule("xml.range", Error, "min is not above max, start is between them and an item of its enumeration", "2.2.7", Description(description::range)),
    rule("xml.aliases", Error, "variables that share a value reference may: one is set at most, same type and unit", "2.2.7", Description(description::aliases)),
    rule("xml.independent", Error, "one independent variable at most, a Real", "2.2.7", Description(description::independent)),
    rule("xml.multiple_set", Error, "canHandleMultipleSetPerTimeInstant belongs to inputs of Model Exchange", "2.2.7", Description(description::multiple_set)),
    rule("xml.states", Error, "derivatives and states are continuous Reals, one derivative each; reinit belongs to states", "2.2.7", Description(description::states)),
    rule("xml.outputs", Error, "ModelStructure lists every output once", "2.2.8", Description(description::outputs)),
    rule("xml.derivatives", Error, "ModelStructure lists every derivative once", "2.2.8", Description(description::derivatives)),
    rule("xml.initial_unknowns", Error, "InitialUnknowns are complete, ascending, each there once, and no others", "2.2.8", Description(description::initial_unknowns)),
    rule("xml.indices", Error, "indices of ModelStructure are places of variables, counted from 1", "2.2.8", Description(description::indices_in_range)),
    rule("xml.dependencies", Error, "each dependency is listed once, and has its kind", "2.2.8; two importers crash when the lengths differ", Description(description::dependencies)),
    rule("xml.dependencies_known", Warning, "dependencies are on inputs and states; of initial unknowns on inputs and what has initial=exact", "2.2.8", Description(description::dependencies_known)),
    rule("xml.dependencies_written", Warning, "every output says what it depends on", "Simulink and OMSimulator see algebraic loops else", Description(description::dependencies_written)),

    rule("bin.present", Error, "there is a binary of the model's name for a platform of FMI 2.0, or sources", "2.3", Binaries(binaries::present)),
    rule("bin.name", Error, "binaries are called modelIdentifier and the platform's ending", "2.3", Binaries(binaries::name)),
    rule("bin.format", Error, "binaries are for the platform whose folder they are in", "2.3", Binaries(binaries::format)),
    rule("bin.symbols", Error, "all functions of the declared interfaces are exported: 25, 9 for Co-Simulation, 10 for Model Exchange", "2.1; FMPy, fmusim and OMSimulator refuse", Binaries(binaries::symbols)),
    rule("bin.extra_symbols", Warning, "nothing but functions of FMI is exported", "on Linux two FMUs in one process can take each other's", Binaries(binaries::extra_symbols)),
    rule("bin.system", Warning, "binaries need only what every system has: glibc 2.17, no compiler's run-time library, both architectures on macOS", "hosts on old clusters, machines without development tools", Binaries(binaries::system)),

    rule("load.opens", Error, "the binary for this platform can be loaded", "2.3", Calls(life::opens)),
    rule("load.types_platform", Error, "fmi2GetTypesPlatform says default", "2.1.4", Calls(life::types_platform)),
    rule("load.version", Error, "fmi2GetVersion says 2.0", "2.1.4", Calls(life::version)),
    rule("load.instance", Error, "fmi2Instantiate gives an instance for the GUID in modelDescription.xml, and each interface", "2.1.5", Calls(life::instance)),
    rule("load.initialises", Error, "an instance initialises with the declared start values", "2.1.6", Calls(life::initialises)),
    rule("load.again", Error, "copies of the binary, loaded, unloaded and loaded again, run alike", "hosts that reload a model", Calls(life::again)),

    rule("instantiate.guid", Error, "another GUID, or none, is refused with NULL and a message", "2.1.5", Calls(life::guid)),
    rule("instantiate.arguments", Warning, "a missing resource location is fine, a missing name is refused with a message", "2.1.5; hosts that pass NULL", Calls(life::arguments_null)),
    rule("instantiate.callbacks", Warning, "callbacks may be NULL if canNotUseMemoryManagementFunctions is declared", "2.1.5; hosts without a logger", Calls(life::callbacks)),
    rule("instantiate.copies", Error, "the callbacks' struct may go after fmi2Instantiate", "2.1.5, clarified in 2.0.5", Calls(life::copies)),
    rule("instantiate.null", Warning, "fmi2FreeInstance(NULL) does nothing, other calls with NULL return fmi2Error", "2.1.5; hosts that clean up after errors", Calls(life::null)),

    rule("life.instances", Error, "instances in turn do what they do alone", "2.1.5", Calls(life::instances)),
    rule("life.deterministic", Error, "the same run gives the same bits", "hosts that compare with a reference", Calls(life::deterministic)),
    rule("life.reset", Error, "after fmi2Reset a run is that of a new instance to the last bit", "2.1.6", Calls(life::reset)),
    rule("life.reset_anywhere", Error, "fmi2Reset works from every state", "2.1.6, 3.2.3, 4.2.4", Calls(life::reset_anywhere)),
    rule("life.terminate", Error, "fmi2Terminate returns fmi2OK, and values can be read after it", "2.1.6, 4.2.4", Calls(life::terminate)),
    rule("life.order", Warning, "calls in the wrong state return fmi2Error and say so", "3.2.3, 4.2.4", Calls(life::order)),

    rule("host.silent", Warning, "nothing is printed; the logger is there for that", "hosts that read their own stdout", Calls(life::silent)),
    rule("host.untouched", Error, "floating-point control, locale, signal handlers, working directory, environment, threads and open files stay as they were", "the host's other models", Calls(life::untouched)),

    rule("log.percent", Error, "percent signs arrive as they are: the text is no format", "2.1.5; five exporters get it wrong, hosts crash", Calls(log::percent)),
    rule("log.categories", Error, "messages have declared categories", "2.1.5, 2.2.4", Calls(log::categories)),
    rule("log.text", Warning, "messages are UTF-8, not empty, without a line break at the end", "2.1.5; hosts that add their own", Calls(log::text)),
    rule("log.quiet", Warning, "an ordinary run logs nothing", "OMSimulator switches logging on for everybody", Calls(log::quiet)),
    rule("log.switch", Error, "fmi2SetDebugLogging takes no categories, for all, and each declared one", "2.1.5", Calls(log::switch)),

    rule("values.start", Error, "start values are the binary's, before and after initialisation", "2.2.7; Simulink writes those of the XML", Calls(values::start)),
    rule("values.readable", Error, "every variable can be read, one at a time, from initialization mode on, and is finite", "2.1.7, 4.2.4", Calls(values::readable)),
    rule("values.booleans", Warning, "Booleans read as 0 and 1; all but 0 is true", "2.1.7", Calls(values::booleans)),
    rule("values.round_trip", Error, "what is set can be read again; start values can be set when instantiated", "2.1.7, 4.2.4", Calls(values::round_trip)),
    rule("values.nothing", Error, "no variables and NULL pointers are fine", "2.1.7; hosts with empty lists", Calls(values::nothing)),
    rule("values.unknown", Error, "unknown value references are refused with a message", "2.1.7", Calls(values::unknown)),
    rule("values.wrong_type", Error, "value references of another type are refused with a message", "2.1.7", Calls(values::wrong_type)),
    rule("values.fixed", Warning, "fixed parameters are refused after initialisation", "2.2.7, 4.2.4", Calls(values::fixed)),
    rule("values.computed", Warning, "what is calculated cannot be set", "2.1.7, 2.2.7", Calls(values::computed)),
    rule("values.limits", Warning, "min and max are accepted, values beyond them refused by the end of initialisation", "2.2.7", Calls(values::limits)),
    rule("values.not_a_number", Warning, "parameters that are NaN or infinite are refused", "2.1.3: never fmi2OK with rubbish", Calls(values::not_a_number)),
    rule("values.no_warning", Warning, "an ordinary run returns no fmi2Warning", "OMSimulator takes it for a failure", Calls(values::no_warning)),

    rule("steps.run", Error, "200 steps with changing inputs return fmi2OK and finite values", "4.2.2; two hosts repeat a discarded step for ever", Calls(steps::run)),
    rule("steps.size", Warning, "steps that are 0, negative or not finite are refused and change nothing", "4.2.2", Calls(steps::size)),
    rule("steps.point", Warning, "a step from a time that is not reached is refused", "4.2.2", Calls(steps::point)),
    rule("steps.wobble", Error, "communication points may be off by rounding", "every host: n·h against t + h", Calls(steps::wobble)),
    rule("steps.start_time", Error, "any start time works", "2.1.6", Calls(steps::start_time)),
    rule("steps.stop_time", Warning, "the stop time is reached with rounding, and not passed", "2.1.6", Calls(steps::stop_time)),
    rule("steps.tolerance", Error, "a tolerance may be given or not", "2.1.6; OMSimulator gives one", Calls(steps::tolerance)),
    rule("steps.cut", Warning, "results do not depend on how time is cut, within the tolerance", "4.3.1, canHandleVariableCommunicationStepSize", Calls(steps::cut)),
    rule("steps.inputs", Warning, "inputs that are NaN are refused; derivatives of inputs are taken if declared", "4.2.1", Calls(steps::inputs)),
    rule("steps.output_derivatives", Warning, "derivatives of outputs are those of the outputs", "4.2.1, maxOutputDerivativeOrder", Calls(steps::output_derivatives)),

    rule("states.rollback", Error, "after a state is set again, values and steps are the same to the last bit", "2.1.8", Calls(states::rollback)),
    rule("states.handle", Error, "a handle can be used again; freeing NULL is fine", "2.1.8", Calls(states::handle)),
    rule("states.bytes", Error, "a serialised state goes on in another instance with the same bits, without setup or initialisation", "2.1.8; fmusim restores that way", Calls(states::bytes)),
    rule("states.garbage", Warning, "bytes that are no state are refused", "2.1.8", Calls(states::garbage)),
    rule("states.modes", Error, "a state can be saved and set when instantiated, in initialization mode and after fmi2Terminate", "2.1.8, 4.2.4", Calls(states::modes)),

    rule("dependencies.running", Error, "outputs and derivatives change with no input or state that is not declared", "2.2.8; hosts solve in the wrong order", Calls(dependencies::running)),
    rule("dependencies.feedthrough", Warning, "outputs change with every input that is declared", "2.2.8; Simulink and OMSimulator see algebraic loops", Calls(dependencies::feedthrough)),
    rule("dependencies.initial", Error, "initial unknowns change with no input or parameter that is not declared", "2.2.8", Calls(dependencies::initial)),
    rule("dependencies.directional", Error, "directional derivatives are those of differences", "2.1.9", Calls(dependencies::directional)),

    rule("exchange.run", Error, "Euler's method with events stays alive; event iteration ends", "3.2.2", Calls(exchange::run)),
    rule("exchange.vectors", Error, "states, derivatives and indicators are finite, nominals above 0", "3.2.2", Calls(exchange::vectors)),
    rule("exchange.lengths", Warning, "vectors of the wrong length are refused", "3.2.2", Calls(exchange::lengths)),
    rule("exchange.variables", Error, "states and derivatives read as variables are those of the vectors, in ModelStructure's order", "2.2.8, 3.2.2", Calls(exchange::variables)),
];
