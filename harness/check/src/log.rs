//! Rules about the logger (FMI 2.0.5, section 2.1.5).

use std::collections::BTreeSet;

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, STEPS, Tested, UnderTest, skip};
use host::c_abi::foreign_environments;
use host::fmi2::{Fmi2, Instantiation, Message, Status};

pub fn percent(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let interface = fmu.first_interface()?;
    // An FMU that uses the text as a printf format prints some number for %d and one sign for %%; both are harmless.
    const TEXT: &str = "{a%db%%c}";
    let mut told = Vec::new();
    let place = format!("a message about {TEXT:?}");
    fmu.announce(&place);
    let with = Instantiation { name: Some(TEXT), guid: Some(TEXT), ..fmu.arguments(interface)? };
    if let Err(error) = fmu.instantiate(interface, &with)? {
        told.extend(error.messages);
    }
    let mut session = fmu.session(interface)?;
    if let Err(error) = session.instance.set_debug_logging(true, &[TEXT]) {
        told.extend(error.messages);
    }
    let echoes: Vec<_> = told.iter().filter(|m| m.text.contains("{a")).collect();
    for message in &echoes {
        if !message.text.contains(TEXT) {
            findings.at(&place).add(format!(
                "the logger receives {:?} (allowed: format \"%s\", the text as argument)",
                message.text
            ));
        }
    }
    if echoes.is_empty() {
        findings.skip("no message of the FMU repeats text that the host has passed");
    }
    Ok(())
}

pub fn categories<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    let declared: Vec<&str> =
        fmu.description.root.list("LogCategories").filter_map(|c| c.get("name")).collect();
    if declared.is_empty() {
        return skip("no categories are declared");
    }
    let (messages, uncategorised) = V::provoke_messages(fmu)?;
    if uncategorised > 0 {
        let all = declared.join(", ");
        findings
            .at("a message")
            .add(format!("the category of the message is NULL (declared: {all})"));
    }
    let named: BTreeSet<String> = messages.into_iter().map(|message| message.category).collect();
    let is_unknown = |c: &String| !c.is_empty() && !declared.contains(&c.as_str());
    for category in named.into_iter().filter(is_unknown) {
        let all = declared.join(", ");
        findings
            .at("a message")
            .add(format!("the category of the message is {category:?} (declared: {all})"));
    }
    Ok(())
}

pub fn text(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let (messages, _) = Fmi2::provoke_messages(fmu)?;
    if messages.is_empty() {
        findings.skip("the FMU logs nothing");
    }
    for message in messages {
        let text = &message.text;
        let fault = if text.trim().is_empty() {
            "the message is empty"
        } else if text.ends_with(['\n', '\r']) {
            "the message ends with a line break"
        } else if text.contains('\u{fffd}') {
            "the message is not UTF-8"
        } else {
            continue;
        };
        findings.at(format!("the message {text:?}")).add(fault);
    }
    Ok(())
}

/// Simulates an ordinary run with loggingOn and returns the logged messages. If `changing` is true, the inputs change
/// during the run; otherwise they keep their start values.
fn ordinary(fmu: &FmuUnderTest, interface: Interface, changing: bool) -> Result<Vec<Message>> {
    fmu.announce("fmi2Instantiate, loggingOn");
    let with = fmu.arguments(interface)?;
    let mut session = fmu.session_with(interface, &with)?;
    session.initialise()?;
    if changing {
        session.advance(STEPS)?
    } else {
        session.coast(STEPS)?
    }
    session.instance.terminate()?;
    Ok(session.instance.take_messages())
}

/// `log.quiet`: an ordinary run logs nothing. If the inputs change, warnings are allowed, because the inputs of the
/// check may lead a model out of its range.
pub fn quiet(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let runs = [("inputs as they start", false), ("inputs changing", true)];
    for (interface, (inputs, changing)) in
        fmu.interfaces().into_iter().flat_map(|i| runs.map(|run| (i, run)))
    {
        let mut messages = ordinary(fmu, interface, changing)?;
        messages.retain(|message| !changing || message.status == Status::Ok);
        if let Some(message) = messages.first() {
            findings
                .at(format!("an ordinary run, {inputs}, loggingOn ({interface})"))
                .add(format!("{} messages, the first {:?}", messages.len(), message.text));
        }
    }
    Ok(())
}

pub fn environment(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let provoke_messages = Fmi2::provoke_messages(fmu);
    let runs = fmu.interfaces().into_iter().map(|interface| ordinary(fmu, interface, true));
    let runs: Result<Vec<_>> = runs.collect();
    match foreign_environments() {
        0 if provoke_messages?.0.is_empty() & runs?.iter().all(Vec::is_empty) => {
            findings.skip("the FMU logs nothing");
        }
        0 => {}
        n => findings.at("the logger").add(format!(
                "{n} calls have another componentEnvironment than that given to fmi2Instantiate (allowed: the same \
                 pointer; fmi2Component is not it)"
            )),
    }
    Ok(())
}

pub fn switch(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.session(fmu.first_interface()?)?;
    let root = &fmu.description.root;
    let declared: Vec<&str> = root.list("LogCategories").filter_map(|c| c.get("name")).collect();
    let sets = declared.iter().map(std::slice::from_ref).chain([&[][..], &declared[..]]);
    for (set, on) in sets.flat_map(|set| [(set, true), (set, false)]) {
        let place = format!("fmi2SetDebugLogging({on}, {set:?})");
        fmu.announce(&place);
        if let Err(error) = session.instance.set_debug_logging(on, set) {
            findings.at(place).add(error.to_string());
        }
    }
    Ok(())
}
