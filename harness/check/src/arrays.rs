//! Detects FMUs that write beyond the ends of the arrays that the host passes. Each call has the length of its
//! array as an argument (FMI 2.0.5, section 2.1.7).

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Session};
use host::description::{Type, Value};
use host::fmi2::guarded::Lists;

fn references(fmu: &FmuUnderTest, kinds: &[Type]) -> Vec<u32> {
    let all = fmu.variables().iter().filter(|v| kinds.contains(&v.kind));
    all.map(|v| v.reference).collect()
}

fn lists(session: &mut Session) -> Result<Lists> {
    let fmu = session.fmu;
    let d = fmu.description;
    let interface = session.using.interface;
    let mut lists = Lists {
        reals: references(fmu, &[Type::Real]),
        integers: references(fmu, &[Type::Integer, Type::Enumeration]),
        booleans: references(fmu, &[Type::Boolean]),
        strings: references(fmu, &[Type::String]),
        serializes: fmu.has_capability(interface, "canSerializeFMUstate"),
        ..Lists::default()
    };
    for v in &fmu.inputs {
        if let Value::Real(x) = session.get(v)? {
            lists.inputs.push((v.reference, x));
        }
    }
    if fmu.has_capability(interface, "providesDirectionalDerivative") {
        let unknowns = d.unknowns(d.words.outputs).filter_map(|u| d.variable_of(u));
        let unknowns = unknowns.filter(|v| v.is_continuous()).map(|v| v.reference);
        lists.unknowns = unknowns.collect();
        lists.knowns = lists.inputs.iter().map(|(reference, _)| *reference).collect();
        if interface == Interface::ModelExchange {
            for (derivative, state) in fmu.states() {
                lists.unknowns.push(derivative.reference);
                lists.knowns.push(state.reference);
            }
        }
        if lists.knowns.is_empty() {
            lists.unknowns.clear();
        }
    }
    match interface {
        Interface::CoSimulation => {
            let order =
                d.interface("CoSimulation").and_then(|i| i.number("maxOutputDerivativeOrder"));
            if order.is_some_and(|order| order >= 1.0) {
                lists.outputs = fmu.outputs.iter().map(|v| v.reference).collect();
            }
        }
        Interface::ModelExchange => {
            let (states, indicators) = session.sizes()?;
            (lists.states, lists.indicators) = (Some(states), Some(indicators));
        }
    }
    Ok(lists)
}

pub fn arrays(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        let mut session = fmu.running(interface)?;
        session.advance(3)?;
        if session.is_ended() {
            continue;
        }
        let lists = lists(&mut session)?;
        fmu.announce(format!("calls with margins around their arrays ({interface})"));
        for write in session.instance.find_stray_writes(&lists) {
            findings.at(format!("{}, {} ({interface})", write.call, write.array)).add(format!(
                "{} (allowed: to write as many values as the call requests, and only into arrays for results)",
                write.fault
            ));
        }
    }
    Ok(())
}
