//! Steps allocate no memory on the host's heap, so that they never wait for the allocator's lock, and long runs do not leak.

use crate::common::items;
use HubSlosh::Instance;
use HubSlosh::table::TABLE;
use allocation_counter::measure;
use plant::{INDICATORS, STATES};
use runtime::call::Interface;
use runtime::v2::{GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use runtime::variable::Value;

fn reference(name: &str) -> u32 {
    TABLE.find(name).unwrap()
}

fn initialised(interface: Interface, slosh_model: i32, friction_model: i32) -> Instance {
    let mut instance = HubSlosh::instance(interface);
    for (name, value) in
        [("slosh.model", slosh_model), ("friction.model", friction_model), ("slosh.modes", 3)]
    {
        instance.set(&SET_INTEGER, &[reference(name)], |_| Value::Integer(value)).unwrap();
    }
    for name in ["wheel.enabled", "imu.enabled"] {
        instance.set(&SET_BOOLEAN, &[reference(name)], |_| Value::Boolean(true)).unwrap();
    }
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

#[test]
fn making_steps_and_setting_and_getting_values_allocate_no_memory() {
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            let mut instance = initialised(Interface::CoSimulation, slosh_model, friction_model);
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

#[test]
fn calls_of_model_exchange_allocate_no_memory() {
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            let mut instance = initialised(Interface::ModelExchange, slosh_model, friction_model);
            let torque = [reference("tau_cmd")];
            let outputs = ["theta", "energy", "der(omega)", "slosh.v_radial[2]"].map(reference);
            let count = measure(|| {
                let (mut x, mut derivatives) = ([0.0; STATES], [0.0; STATES]);
                let (mut indicators, mut time) = ([0.0; INDICATORS], 0.0);
                for n in 0..100 {
                    instance.new_discrete_states().unwrap();
                    instance.enter_continuous_time_mode().unwrap();
                    instance.continuous_states(&mut x).unwrap();
                    for _ in 0..10 {
                        instance.derivatives(&mut derivatives).unwrap();
                        for (x, rate) in x.iter_mut().zip(&derivatives) {
                            *x += 1e-4 * rate;
                        }
                        time += 1e-4;
                        instance.set_time(time).unwrap();
                        instance.set_continuous_states(&x).unwrap();
                        instance.event_indicators(&mut indicators).unwrap();
                        instance.completed_integrator_step().unwrap();
                    }
                    for output in outputs {
                        instance.get(&GET_REAL, output).unwrap();
                    }
                    let mut answer = [0.0];
                    instance
                        .directional_derivative(&outputs[2..3], &torque, &[1.0], &mut answer)
                        .unwrap();
                    instance.enter_event_mode().unwrap();
                    let command = 0.1 * f64::from(n % 7 - 3);
                    instance.set(&SET_REAL, &torque, |_| Value::Real(command)).unwrap();
                }
            });
            assert_eq!(count.count_total, 0, "slosh {slosh_model}, friction {friction_model}");
        }
    }
}
