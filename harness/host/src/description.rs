//! What an FMU says of itself: `modelDescription.xml` (FMI 2.0, section 2.2),
//! as far as a co-simulation host needs it.

use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// The root element `fmiModelDescription`.
#[derive(Clone, Debug, Deserialize)]
pub struct ModelDescription {
    /// FMI version; "2.0" for every FMU this host can drive.
    #[serde(rename = "@fmiVersion")]
    pub fmi_version: String,
    /// Name of the model.
    #[serde(rename = "@modelName")]
    pub model_name: String,
    /// Fingerprint that XML and binary must share.
    #[serde(rename = "@guid")]
    pub guid: String,
    /// Version of the model.
    #[serde(rename = "@version", default)]
    pub version: String,
    /// One sentence on the model.
    #[serde(rename = "@description", default)]
    pub description: String,
    /// The tool that wrote the FMU.
    #[serde(rename = "@generationTool", default)]
    pub generation_tool: String,
    /// Present if the FMU brings its own solver, as this host needs.
    #[serde(rename = "CoSimulation")]
    pub co_simulation: Option<CoSimulation>,
    /// Present if the host may integrate.
    #[serde(rename = "ModelExchange")]
    pub model_exchange: Option<ModelExchange>,
    /// Units, with those that people like to see them in.
    #[serde(rename = "UnitDefinitions", default)]
    pub units: UnitDefinitions,
    /// Named types; here the enumerations.
    #[serde(rename = "TypeDefinitions", default)]
    pub types: TypeDefinitions,
    /// Start, stop, tolerance and step the author suggests.
    #[serde(rename = "DefaultExperiment", default)]
    pub default_experiment: DefaultExperiment,
    /// The variables, in the order of the file.
    #[serde(rename = "ModelVariables")]
    pub variables: ModelVariables,
}

/// Element `CoSimulation`.
#[derive(Clone, Debug, Deserialize)]
pub struct CoSimulation {
    /// Name of the binary, without the platform's ending.
    #[serde(rename = "@modelIdentifier")]
    pub model_identifier: String,
}

/// Element `ModelExchange`.
#[derive(Clone, Debug, Deserialize)]
pub struct ModelExchange {
    /// Name of the binary, without the platform's ending.
    #[serde(rename = "@modelIdentifier")]
    pub model_identifier: String,
}

/// Element `DefaultExperiment`; times in s.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct DefaultExperiment {
    /// Start time, s.
    #[serde(rename = "@startTime")]
    pub start_time: Option<f64>,
    /// Stop time, s.
    #[serde(rename = "@stopTime")]
    pub stop_time: Option<f64>,
    /// Relative tolerance of the FMU's solver.
    #[serde(rename = "@tolerance")]
    pub tolerance: Option<f64>,
    /// Communication step, s.
    #[serde(rename = "@stepSize")]
    pub step_size: Option<f64>,
}

/// Element `UnitDefinitions`.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct UnitDefinitions {
    /// The units.
    #[serde(rename = "Unit", default)]
    pub list: Vec<Unit>,
}

/// Element `Unit`.
#[derive(Clone, Debug, Deserialize)]
pub struct Unit {
    /// Name used by variables.
    #[serde(rename = "@name")]
    pub name: String,
}

/// Element `TypeDefinitions`.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct TypeDefinitions {
    /// The types.
    #[serde(rename = "SimpleType", default)]
    pub list: Vec<SimpleType>,
}

/// Element `SimpleType`.
#[derive(Clone, Debug, Deserialize)]
pub struct SimpleType {
    /// Name used by variables as `declaredType`.
    #[serde(rename = "@name")]
    pub name: String,
    /// The items, if it is an enumeration.
    #[serde(rename = "Enumeration")]
    pub enumeration: Option<Enumeration>,
}

/// Element `Enumeration` of a type.
#[derive(Clone, Debug, Deserialize)]
pub struct Enumeration {
    /// The values it can take.
    #[serde(rename = "Item", default)]
    pub items: Vec<Item>,
}

/// One value of an enumeration.
#[derive(Clone, Debug, Deserialize)]
pub struct Item {
    /// Its name.
    #[serde(rename = "@name")]
    pub name: String,
    /// Its number.
    #[serde(rename = "@value")]
    pub value: i32,
}

/// Element `ModelVariables`.
#[derive(Clone, Debug, Deserialize)]
pub struct ModelVariables {
    /// The variables, in the order of the file.
    #[serde(rename = "ScalarVariable", default)]
    pub list: Vec<Variable>,
}

/// Element `ScalarVariable`.
#[derive(Clone, Debug, Deserialize)]
pub struct Variable {
    /// Name, unique in the FMU.
    #[serde(rename = "@name")]
    pub name: String,
    /// Number by which calls refer to it (within its type).
    #[serde(rename = "@valueReference")]
    pub reference: u32,
    /// input, output, parameter, calculatedParameter, local or independent.
    #[serde(rename = "@causality", default = "local_causality")]
    pub causality: String,
    /// constant, fixed, tunable, discrete or continuous.
    #[serde(rename = "@variability", default)]
    pub variability: String,
    /// What it means.
    #[serde(rename = "@description", default)]
    pub description: String,
    #[serde(rename = "Real")]
    real: Option<Attributes>,
    #[serde(rename = "Integer")]
    integer: Option<Attributes>,
    #[serde(rename = "Boolean")]
    boolean: Option<Attributes>,
    #[serde(rename = "String")]
    string: Option<Attributes>,
    #[serde(rename = "Enumeration")]
    enumeration: Option<Attributes>,
}

fn local_causality() -> String {
    "local".into()
}

/// What the typed child of a `ScalarVariable` carries.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Attributes {
    /// Start value, as written.
    #[serde(rename = "@start")]
    pub start: Option<String>,
    /// Unit in which values are exchanged.
    #[serde(rename = "@unit")]
    pub unit: Option<String>,
    /// Unit in which a person likes to read it.
    #[serde(rename = "@displayUnit")]
    pub display_unit: Option<String>,
    /// Smallest value, as written.
    #[serde(rename = "@min")]
    pub min: Option<String>,
    /// Largest value, as written.
    #[serde(rename = "@max")]
    pub max: Option<String>,
    /// Name of the `SimpleType`.
    #[serde(rename = "@declaredType")]
    pub declared_type: Option<String>,
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// 64-bit real.
    Real,
    /// 32-bit integer.
    Integer,
    /// True or false.
    Boolean,
    /// Text.
    String,
    /// An integer with named values.
    Enumeration,
}

/// A value of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of a Real.
    Real(f64),
    /// Of an Integer or an Enumeration.
    Integer(i32),
    /// Of a Boolean.
    Boolean(bool),
    /// Of a String.
    String(String),
}

impl Variable {
    /// Its type.
    pub fn kind(&self) -> Type {
        self.typed().0
    }

    /// Start, unit, bounds.
    pub fn attributes(&self) -> &Attributes {
        self.typed().1
    }

    fn typed(&self) -> (Type, &Attributes) {
        const NOTHING: &Attributes = &Attributes {
            start: None,
            unit: None,
            display_unit: None,
            min: None,
            max: None,
            declared_type: None,
        };
        [
            (Type::Real, &self.real),
            (Type::Integer, &self.integer),
            (Type::Boolean, &self.boolean),
            (Type::String, &self.string),
            (Type::Enumeration, &self.enumeration),
        ]
        .into_iter()
        .find_map(|(kind, child)| Some((kind, child.as_ref()?)))
        .unwrap_or((Type::Real, NOTHING))
    }
}

impl ModelDescription {
    /// Reads the XML text.
    pub fn from_xml(text: &str) -> Result<Self> {
        serde_xml_rs::from_str(text).context("modelDescription.xml cannot be understood")
    }

    /// The variable of that name; if there is none, the error names those that look alike.
    pub fn variable(&self, name: &str) -> Result<&Variable> {
        self.variables.list.iter().find(|v| v.name == name).with_context(|| {
            let names = self.variables.list.iter().map(|v| v.name.as_str());
            format!("the FMU has no variable \"{name}\"{}", did_you_mean(name, names))
        })
    }

    /// The values an enumeration variable can take.
    pub fn items(&self, variable: &Variable) -> &[Item] {
        let declared = variable.attributes().declared_type.as_deref();
        self.types
            .list
            .iter()
            .find(|t| Some(t.name.as_str()) == declared)
            .and_then(|t| t.enumeration.as_ref())
            .map_or(&[], |e| &e.items)
    }

    /// Reads a value of a variable from text.
    pub fn value(&self, variable: &Variable, text: &str) -> Result<Value> {
        let name = &variable.name;
        let text = text.trim();
        match variable.kind() {
            Type::Real => text
                .parse()
                .map(Value::Real)
                .ok()
                .with_context(|| format!("{name} wants a number, not \"{text}\"")),
            Type::Integer => text
                .parse()
                .map(Value::Integer)
                .ok()
                .with_context(|| format!("{name} wants a whole number, not \"{text}\"")),
            Type::Boolean => match text {
                "true" | "1" => Ok(Value::Boolean(true)),
                "false" | "0" => Ok(Value::Boolean(false)),
                _ => bail!("{name} wants true or false, not \"{text}\""),
            },
            Type::String => Ok(Value::String(text.into())),
            Type::Enumeration => {
                let items = self.items(variable);
                items
                    .iter()
                    .find(|i| i.name == text || i.value.to_string() == text)
                    .map(|item| Value::Integer(item.value))
                    .with_context(|| {
                        let all: Vec<_> =
                            items.iter().map(|i| format!("{} ({})", i.name, i.value)).collect();
                        format!("{name} wants one of {}, not \"{text}\"", all.join(", "))
                    })
            }
        }
    }
}

/// "; did you mean …?" with the (at most three) likeliest of `names`, or nothing.
pub fn did_you_mean<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> String {
    let mut near: Vec<(f64, &str)> = names
        .map(|name| (strsim::jaro_winkler(&wrong.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let near: Vec<String> = near.iter().take(3).map(|(_, name)| format!("\"{name}\"")).collect();
    match near.len() {
        0 => String::new(),
        _ => format!("; did you mean {}?", near.join(" or ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}" version="0.1" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="M" canHandleVariableCommunicationStepSize="true">
    <SourceFiles><File name="a.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
  <TypeDefinitions><SimpleType name="Model"><Enumeration><Item name="frozen" value="1"/><Item name="linear" value="2"/></Enumeration></SimpleType></TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="10.5" tolerance="1e-6"/>
  <ModelVariables>
    <!-- a comment -->
    <ScalarVariable name="omega" valueReference="3" causality="output" variability="continuous" initial="calculated"><Real unit="rad/s"/></ScalarVariable>
    <ScalarVariable name="slosh.model" valueReference="4" causality="parameter" variability="fixed" initial="exact"><Enumeration declaredType="Model" start="2"/></ScalarVariable>
    <ScalarVariable name="wheel.enabled" valueReference="5" causality="parameter" variability="fixed"><Boolean start="false"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>"#;

    #[test]
    fn names_types_and_enumerations_are_read() {
        let d = ModelDescription::from_xml(XML).unwrap();
        assert_eq!(d.co_simulation.as_ref().unwrap().model_identifier, "M");
        assert_eq!(d.default_experiment.stop_time, Some(10.5));
        let model = d.variable("slosh.model").unwrap();
        assert_eq!((model.kind(), model.reference), (Type::Enumeration, 4));
        assert_eq!(d.items(model)[1].name, "linear");
        assert_eq!(d.variable("omega").unwrap().attributes().unit.as_deref(), Some("rad/s"));
        assert_eq!(d.variable("wheel.enabled").unwrap().kind(), Type::Boolean);
    }

    #[test]
    fn a_misspelt_name_brings_suggestions() {
        let d = ModelDescription::from_xml(XML).unwrap();
        let error = d.variable("slosh.modle").unwrap_err().to_string();
        assert!(error.contains("did you mean \"slosh.model\""), "{error}");
    }
}
