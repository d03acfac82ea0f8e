//! Spacecraft and SloshTank agree with the reference records, within the number of digits that each record states.

use std::collections::BTreeMap;

use craft::{Outputs, SloshTankOutputs};
use serde_json::Value;

use super::records::*;

#[derive(Default)]
struct Deviations(BTreeMap<String, (f64, f64)>);

impl Deviations {
    fn add(&mut self, record: &Value, sample: usize, signal: &str, got: &[f64]) {
        let samples = &record["samples"][signal];
        let Some(list) = samples.as_array() else { return };
        let largest = largest(record, signal);
        let want = numbers(&list[sample]);
        assert_eq!(want.len(), got.len(), "{signal}");
        let (worst, scale) = self.0.entry(signal.into()).or_insert((0.0, largest));
        for (got, want) in got.iter().zip(want) {
            // The condition is negated so that NaN counts as a deviation.
            let deviation = (got - want).abs();
            *worst = if deviation <= *worst { *worst } else { deviation };
        }
        assert_eq!(*scale, largest);
    }

    /// Returns a message for each signal that deviates from the reference record by more than the
    /// accuracy, in digits, that the record states for it. `digits_of` allows for the rounding of
    /// the record's numbers to 14 digits.
    fn excess(&self, record: &Value) -> Vec<String> {
        let name = record["name"].as_str().unwrap();
        let mut excess = Vec::new();
        let mut report = format!("{name} (digits)");
        for (signal, (worst, scale)) in &self.0 {
            if *scale == 0.0 {
                if *worst > 1e-20 {
                    excess.push(format!("{name} {signal}: {worst:e}, should be 0"));
                }
                continue;
            }
            let digits = number(record["digits_of"].get(signal).unwrap_or(&record["digits"]));
            let got = -f64::log10(worst / scale);
            report += &format!("  {signal} {got:.1}/{digits}");
            if got.is_nan() || got < digits {
                excess.push(format!("{name} {signal}: {got:.2} digits of {digits}"));
            }
        }
        println!("{report}");
        excess
    }
}

fn compare(d: &mut Deviations, record: &Value, sample: usize, out: &Outputs) {
    let mut add = |signal: &str, got: &[f64]| d.add(record, sample, signal, got);
    add("q", &out.q);
    add("w", &out.omega);
    add("w_dot", &out.omega_dot);
    add("a", &out.specific_force);
    add("r", &out.position);
    add("v", &out.velocity);
    add("P", &out.momentum);
    add("H", &out.angular_momentum);
    add("E", &[out.energy]);
    add("work", &[out.work]);
    add("heat", &[out.dissipated]);
    let tanks = record["tanks"].as_array().unwrap();
    let (mut p, mut p_dot, mut force, mut torque) = (vec![], vec![], vec![], vec![]);
    for (tank, out) in tanks.iter().zip(&out.tank) {
        force.extend(out.force);
        torque.extend(out.torque);
        for n in 0..tank["modes"].as_array().unwrap().len() {
            p.extend(out.p[n]);
            p_dot.extend(out.p_dot[n]);
        }
    }
    add("p", &p);
    add("p_dot", &p_dot);
    add("force", &force);
    add("torque", &torque);
}

#[test]
fn spacecraft_equals_the_reference_records() {
    let mut excess = Vec::new();
    for record in &records("craft") {
        let mut craft = spacecraft(record, 1e-13);
        let (last, every) = steps(record);
        let mut d = Deviations::default();
        compare(&mut d, record, 0, &craft.outputs(&inputs(record, 0)));
        for k in 0..last {
            let inputs = inputs(record, k);
            craft.step(&inputs, STEP).unwrap();
            if (k + 1).is_multiple_of(every) {
                compare(&mut d, record, (k + 1) / every, &craft.outputs(&at_end(&inputs)));
            }
        }
        excess.extend(d.excess(record));
    }
    assert!(excess.is_empty(), "{}", excess.join("\n"));
}

fn compare_tank(d: &mut Deviations, record: &Value, sample: usize, out: &SloshTankOutputs) {
    let modes = record["tank"]["modes"].as_array().unwrap().len();
    let mut add = |signal: &str, got: &[f64]| d.add(record, sample, signal, got);
    add("p", out.tank.p[..modes].as_flattened());
    add("p_dot", out.tank.p_dot[..modes].as_flattened());
    add("force", &out.tank.force);
    add("torque", &out.tank.torque);
    add("bias", &out.bias);
    add("M_a", &out.added_mass);
}

#[test]
fn slosh_tank_equals_the_reference_records() {
    let mut excess = Vec::new();
    for record in &records("tank") {
        let mut tank = slosh_tank(record, 1e-13);
        let (last, every) = steps(record);
        let mut now = motion(record, 0, numbers(&record["w0"]).try_into().unwrap());
        let mut d = Deviations::default();
        compare_tank(&mut d, record, 0, &tank.outputs(&now));
        for k in 0..last {
            now = motion(record, k, now.omega);
            tank.step(&now, STEP).unwrap();
            now = motion_at_end(&now);
            if (k + 1).is_multiple_of(every) {
                d.add(record, (k + 1) / every, "w", &now.omega);
                compare_tank(&mut d, record, (k + 1) / every, &tank.outputs(&now));
            }
        }
        excess.extend(d.excess(record));
    }
    assert!(excess.is_empty(), "{}", excess.join("\n"));
}
