//! Writes the modelDescription.xml of FMI 3.0 from the table of variables. In the layout with scalars the variables have the
//! names of FMI 2.0; in the layout with arrays each entry of the table is one variable. The independent variable and the
//! event indicators, which are not variables in FMI 2.0, follow after the table's variables.

use std::collections::BTreeSet;
use std::path::PathBuf;

use runtime::Model;
use runtime::table::{Layout, Scalar};
use runtime::unit::UNITS;
use runtime::v3::arrays::{self, Arrays};
use runtime::v3::{Fmi3, extra_names, has_intermediate_update, time_reference};
use runtime::variable::{Causality, Dimension, Kind, Variable};
use runtime::version::Version;

use crate::element::Element;
use crate::{
    List, Long, Own, default_experiment, folder, items, log_categories, root, state_of, text,
    type_definitions, unit, unknown, unknowns, variability, with_type_attributes,
};

pub fn path<M: Model>(layout: Layout) -> PathBuf {
    folder::<M>().join(match layout {
        Layout::Scalars => "fmi3/modelDescription.xml",
        Layout::Arrays => "fmi3-arrays/modelDescription.xml",
    })
}

pub fn xml<M: Model>(layout: Layout) -> Result<String, xml::writer::Error> {
    description::<M>(layout).document()
}

fn description<M: Model>(layout: Layout) -> Element {
    let table = M::table();
    let used: Vec<_> = table.units().map(|unit| unit.name).collect();
    let units = UNITS.iter().filter(|unit| unit.name == TIME_UNIT || used.contains(&unit.name));
    let variables = Element::new("ModelVariables");
    // CasADi 3.8 cannot read an entry of ModelStructure without dependencies.
    let all_unknowns = |list, name| {
        unknowns::<M>(list, name, "valueReference", Long::Dependencies, |s| reference(layout, s))
    };
    root::<M>("3.0", "instantiationToken", Fmi3::token::<M>(layout))
        .holding([
            interface::<M>("ModelExchange")
                .with("needsCompletedIntegratorStep", true)
                .with("providesEvaluateDiscreteStates", false),
            interface::<M>("CoSimulation")
                .with("canHandleVariableCommunicationStepSize", true)
                .with("maxOutputDerivativeOrder", 1)
                .with("providesIntermediateUpdate", true)
                .with("mightReturnEarlyFromDoStep", true)
                .with("canReturnEarlyAfterIntermediateUpdate", true)
                .with("hasEventMode", true)
                .with("providesEvaluateDiscreteStates", false),
            Element::new("UnitDefinitions").holding(units.map(unit)),
        ])
        .holding(type_definitions::<M>(|of| {
            Element::new("EnumerationType")
                .with("name", of.name)
                .with("description", of.description)
                .holding(items(of))
        }))
        .holding([
            log_categories::<M, Fmi3>(),
            default_experiment(),
            match layout {
                Layout::Scalars => variables.holding(table.scalars.iter().map(variable)),
                Layout::Arrays => variables.holding(table.variables.iter().map(array)),
            }
            .holding(extra::<M>(layout)),
            Element::new("ModelStructure")
                .holding(all_unknowns(List::Outputs, "Output"))
                .holding(all_unknowns(List::Derivatives, "ContinuousStateDerivative"))
                .holding(all_unknowns(List::Initial, "InitialUnknown"))
                .holding(event_indicators::<M>(layout)),
        ])
}

fn interface<M: Model>(name: &'static str) -> Element {
    Element::new(name)
        .with("modelIdentifier", M::table().about.model)
        .with("needsExecutionTool", false)
        .with("canBeInstantiatedOnlyOncePerProcess", false)
        .with("canGetAndSetFMUState", true)
        .with("canSerializeFMUState", true)
        .with("providesDirectionalDerivatives", true)
        .with("providesAdjointDerivatives", true)
        .with("providesPerElementDependencies", true)
}

const TIME_UNIT: &str = "s";
const TIME: &str = "time";

fn variable<M: Model>(scalar: &Scalar<M>) -> Element {
    let v = scalar.variable;
    let own = Own {
        start: scalar.start().map(text),
        derivative: state_of(v, scalar.element).map(Fmi3::reference),
    };
    entry_element(Layout::Scalars, v, (scalar.name(), Fmi3::reference(scalar)), v.description, own)
}

fn array<M: Model>(v: &'static Variable<M>) -> Element {
    let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
    let mut starts: Vec<_> = elements(v)
        .into_iter()
        .filter_map(|element| v.start(&mut parameters, &mut inputs, element))
        .map(text)
        .collect();
    // In FMI 3.0 a single start value applies to all elements of an array.
    if starts.iter().all(|start| *start == starts[0]) {
        starts.truncate(1);
    }
    let size = |dimension: &Dimension| {
        let element = Element::new("Dimension");
        match dimension {
            Dimension::Fixed(length) | Dimension::Used(_, length) => element.with("start", length),
            Dimension::Sized(name, _) => {
                element.with_some("valueReference", entry::<M>(name).map(arrays::reference))
            }
        }
    };
    let own = Own {
        start: Some(starts.join(" ")).filter(|starts| !starts.is_empty()),
        derivative: state_of(v, 0).map(|state| arrays::reference(state.variable)),
    };
    let description = v.description.replace("[]", "");
    let named = (v.array_name(), arrays::reference(v));
    entry_element(Layout::Arrays, v, named, &description, own).holding(v.shape.iter().map(size))
}

fn entry<M: Model>(name: &str) -> Option<&'static Variable<M>> {
    M::table().variables.iter().find(|v| v.name == name)
}

/// Returns which elements of the largest possible array exist if all structural parameters have
/// their start values. The elements are indices in row-major order.
fn elements<M: Model>(v: &Variable<M>) -> Vec<usize> {
    let all = Arrays::new::<M>(&M::table().starts());
    let scalars = all.scalars(arrays::reference(v)).unwrap_or_default().iter();
    scalars.map(|reference| M::table().scalars[*reference as usize - 1].element).collect()
}

fn entry_element<M: Model>(
    layout: Layout,
    v: &Variable<M>,
    (name, reference): (String, u32),
    description: &str,
    own: Own,
) -> Element {
    let is_structural = layout == Layout::Arrays && M::table().is_structural(v);
    let (causality, initial) = match v.causality {
        // `initial="exact"` is the default of an input and is left out, because CasADi does not accept it there.
        Causality::Input => ("input", None),
        Causality::Output => ("output", Some("calculated")),
        Causality::Local => ("local", Some("calculated")),
        Causality::Parameter if is_structural => ("structuralParameter", Some("exact")),
        Causality::Parameter => ("parameter", Some("exact")),
        Causality::CalculatedParameter => ("calculatedParameter", Some("calculated")),
    };
    let kind = match v.kind {
        Kind::Real(_) => "Float64",
        Kind::Integer { .. } if is_structural => "UInt64",
        Kind::Integer { .. } => "Int32",
        Kind::Boolean => "Boolean",
        Kind::Enumeration(_) => "Enumeration",
    };
    let element = Element::new(kind)
        .with("name", name)
        .with("valueReference", reference)
        .with("description", description)
        .with("causality", causality)
        .with("variability", variability(v))
        .with_some("initial", initial)
        .with_some("intermediateUpdate", has_intermediate_update(v).then_some(true));
    with_type_attributes(element, v, own)
}

fn extra<M: Model>(layout: Layout) -> Vec<Element> {
    let indicators = M::table().about.event_indicators;
    let one = |(reference, name): (u32, String)| {
        let is_time = name == TIME;
        let element = Element::new("Float64").with("name", name).with("valueReference", reference);
        let of_all = |description, causality| {
            element
                .with("description", description)
                .with("causality", causality)
                .with("variability", "continuous")
        };
        match is_time {
            true => of_all("Simulation time", "independent").with("unit", TIME_UNIT),
            false => of_all("Crosses zero at events; positive between them", "local")
                .with("initial", "calculated"),
        }
    };
    match layout {
        Layout::Scalars => (time_reference::<M>()..).zip(extra_names::<M>()).map(one).collect(),
        Layout::Arrays => {
            let time = arrays::time::<M>();
            let size = Element::new("Dimension").with("start", indicators);
            let array = one((time + 1, arrays::INDICATORS.into())).holding([size]);
            let some = (indicators > 0).then_some(array);
            [one((time, TIME.into()))].into_iter().chain(some).collect()
        }
    }
}

fn reference<M: Model>(layout: Layout, scalar: &Scalar<M>) -> u32 {
    match layout {
        Layout::Scalars => Fmi3::reference(scalar),
        Layout::Arrays => arrays::reference(scalar.variable),
    }
}

/// Returns the event indicators as elements of ModelStructure. Each is declared to depend on all
/// inputs and states, because the real dependencies change with the contacts and with the limits of
/// the model that apply.
fn event_indicators<M: Model>(layout: Layout) -> impl Iterator<Item = Element> {
    let is_known = |s: &&'static Scalar<M>| {
        s.variable.causality == Causality::Input || s.variable.state.is_some()
    };
    let known = M::table().scalars.iter().filter(is_known);
    let known: BTreeSet<u32> = known.map(|scalar| reference(layout, scalar)).collect();
    let count = M::table().about.event_indicators as u32;
    let references = match layout {
        Layout::Scalars => time_reference::<M>() + 1..=time_reference::<M>() + count,
        Layout::Arrays => arrays::time::<M>() + 1..=arrays::time::<M>() + count.min(1),
    };
    references.map(move |n| unknown("EventIndicator", "valueReference", n, &known))
}
