//! Stepping takes no memory from the host's heap: no lock, no waiting, no leak,
//! however long the run.

use HubSlosh::calls::{GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use HubSlosh::instance::Instance;
use HubSlosh::table;
use HubSlosh::variable::Value;
use allocation_counter::measure;

fn reference(name: &str) -> u32 {
    table::find(name).unwrap()
}

#[test]
fn stepping_setting_and_getting_allocate_nothing() {
    for slosh_model in 1..=5 {
        for friction_model in 1..=4 {
            let mut instance = Instance::new();
            for (name, value) in [
                ("slosh.model", slosh_model),
                ("friction.model", friction_model),
                ("slosh.modes", 3),
            ] {
                instance.set(&SET_INTEGER, &[reference(name)], |_| Value::Integer(value)).unwrap();
            }
            for name in ["wheel.enabled", "imu.enabled"] {
                instance.set(&SET_BOOLEAN, &[reference(name)], |_| Value::Boolean(true)).unwrap();
            }
            instance.enter_initialization_mode().unwrap();
            instance.exit_initialization_mode().unwrap();
            let torque = [reference("tau_cmd")];
            let outputs = ["theta", "energy", "tank.m_liq", "tau_cmd", "hub.I"].map(reference);
            let count = measure(|| {
                for n in 0..100 {
                    let command = 0.1 * f64::from(n % 7 - 3);
                    instance.set(&SET_REAL, &torque, |_| Value::Real(command)).unwrap();
                    instance.do_step(f64::from(n) * 0.1, 0.1).unwrap();
                    for output in outputs {
                        instance.get(&GET_REAL, output).unwrap();
                    }
                }
            });
            assert_eq!(count.count_total, 0, "slosh {slosh_model}, friction {friction_model}");
        }
    }
}
