//! Tests of the packed FMUs 3.0 with FMPy: it finds no fault in them, and gets the same results as from the FMUs 2.0.

use std::io::Read;
use std::process::Command;

use crate::common::{python, run};
use pack::{Fmi, MODELS, packed_model_for_tests, packed_version_for_tests};

/// With FMPy's own Co-Simulation the motion must be bit-identical to that of the FMU 2.0, with and without event mode and
/// early return. With Model Exchange and CVODE it must agree within the error of the tolerance 1e-9 over 20 s of stick and
/// slip.
const FMPY: &str = r#"
import sys
import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

name, two, three = sys.argv[1:]
problems = validate_fmu(three)
assert not problems, problems
start = {"HubSlosh": {"slosh.model": 4, "init.slosh_angle": 0.5, "init.slosh_angle_radial": 0.3}}.get(name, {})
outputs = {
    "HubSlosh": ["theta", "omega", "omega_dot", "slosh_angle", "slosh_angle_radial", "tau_friction", "omega_imu"],
    "Spacecraft": ["q[1]", "omega[1]", "omega[3]", "slosh_force[1]"],
    "SloshTank": ["force[1]", "force[3]", "torque[2]"],
}[name]


def run(fmu, kind, settings=start, more=(), **arguments):
    return simulate_fmu(
        fmu, fmi_type=kind, stop_time=20 if name == "HubSlosh" else 4, output_interval=0.02, start_values=settings,
        output=outputs + list(more), **arguments,
    )


def at(result, times):
    # an event repeats its time: the last row is what comes of it
    return result[np.searchsorted(result["time"], times + 1e-9) - 1]


gyro = [{}, {"imu.enabled": True, "imu.rate": 7.0, "wheel.enabled": True}] if name == "HubSlosh" else [{}]
for settings in gyro:
    settings = {**start, **settings}
    expected = run(two, "CoSimulation", settings)
    rows = []
    for event_mode in (False, True):
        for early_return in (False, True):
            result = run(three, "CoSimulation", settings, use_event_mode=event_mode, early_return_allowed=early_return)
            rows.append(len(result))
            same = at(result, expected["time"])
            for output in outputs:
                assert np.array_equal(same[output], expected[output]), (output, event_mode, early_return)
    assert rows[0] == rows[1] == len(expected), rows
    if name == "HubSlosh":
        assert rows[3] > rows[2] > rows[1] + 20, rows

more = {"HubSlosh": ["event_count"], "SloshTank": ["tank.p[1,1]"]}.get(name, [])
fine = run(three, "CoSimulation", more=more, relative_tolerance=1e-12)
if name == "HubSlosh":
    assert fine["event_count"][-1] > 20, fine["event_count"][-1]
mine = at(run(three, "ModelExchange", more=more, solver="CVode", relative_tolerance=1e-9), fine["time"])
# a tank's forces are its weight, 50 N, times angles: these are compared
for output in ["tank.p[1,1]"] if name == "SloshTank" else outputs:
    # what jumps at events is compared by its integrals
    if output in ("omega_dot", "tau_friction", "omega_imu"):
        continue
    error = np.max(np.abs(mine[output] - fine[output]))
    assert error < 1e-6 * max(1.0, np.max(np.abs(fine[output]))), (output, error)
    print(name, output, error)
"#;

#[test]
fn fmpy_finds_no_fault_in_fmi_3_and_gets_the_bits_of_fmi_2_in_every_event_configuration() {
    for model in &MODELS {
        let said = run(
            Command::new(python())
                .args(["-c", FMPY, model.name])
                .arg(packed_model_for_tests(model))
                .arg(packed_version_for_tests(model, Fmi::V3)),
            "FMPy does not drive the FMU 3.0 as it drives the FMU 2.0",
        );
        println!("{said}");
    }
}

/// Tests arrays as FMPy passes them, and array sizes that are set in configuration mode, which FMPy does not do by itself.
const FMPY_ARRAYS: &str = r#"
import shutil
import sys
import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

name, size, number, scalars, arrays = sys.argv[1:]
number = int(number)
problems = validate_fmu(arrays)
assert not problems, problems
description = read_model_description(arrays)
reference = {v.name: v.valueReference for v in description.modelVariables}[size]


def compare(mine, theirs, error):
    assert len(mine) == len(theirs)
    for output in mine.dtype.names:
        values = np.asarray(mine[output]).reshape(len(mine), -1)
        names = [output] if mine[output].ndim == 1 else [f"{output}[{n + 1}]" for n in range(values.shape[1])]
        for column, scalar in zip(values.T, names, strict=True):
            difference = np.max(np.abs(column - theirs[scalar]))
            assert difference <= error * max(1.0, np.max(np.abs(theirs[scalar]))), (scalar, difference)


settings = {"stop_time": 2, "output_interval": 0.02}
# Spacecraft and SloshTank rest unless something moves them
motion = {"Spacecraft": ("init.omega", [0.02, 0.0, 0.1]), "SloshTank": ("a", [0.1, 0.0, 9.8])}.get(name)
starts = {arrays: {motion[0]: motion[1]} if motion else {}}
starts[scalars] = {f"{motion[0]}[{i}]": x for i, x in enumerate(motion[1], 1)} if motion else {}
for kind, error in (("CoSimulation", 0.0), ("ModelExchange", 1e-6)):
    both = [
        simulate_fmu(fmu, fmi_type=kind, relative_tolerance=1e-9, start_values=starts[fmu], **settings)
        for fmu in (arrays, scalars)
    ]
    if kind == "ModelExchange":
        # it steps where its solver finds events
        times = np.arange(1, 100) * settings["output_interval"]
        both = [result[np.searchsorted(result["time"], times + 1e-9) - 1] for result in both]
        # what jumps at events is compared by its integrals
        if name == "HubSlosh":
            both = [result[["theta", "slosh_angle", "wave_height"]] for result in both]
    compare(*both, error)

unpacked = extract(arrays)
try:
    instance = instantiate_fmu(unpacked, description, fmi_type="CoSimulation")
    instance.enterConfigurationMode()
    instance.setUInt64([reference], [number])
    instance.exitConfigurationMode()
    mine = simulate_fmu(
        unpacked, model_description=description, fmu_instance=instance, start_values=starts[arrays], **settings
    )
finally:
    shutil.rmtree(unpacked)
theirs = simulate_fmu(scalars, start_values=starts[scalars] | {size: number}, fmi_type="CoSimulation", **settings)
compare(mine, theirs, 0.0)
plain = simulate_fmu(scalars, start_values=starts[scalars], fmi_type="CoSimulation", **settings)
assert any(not np.array_equal(theirs[output], plain[output]) for output in theirs.dtype.names), "the size is felt"
"#;

#[test]
fn fmpy_reads_arrays_and_sizes_them_in_configuration_mode() {
    let sizes = [("slosh.modes", "3"), ("tanks", "2"), ("tank.modes", "3")];
    for (model, (size, number)) in MODELS.iter().zip(sizes) {
        run(
            Command::new(python())
                .args(["-c", FMPY_ARRAYS, model.name, size, number])
                .arg(packed_version_for_tests(model, Fmi::V3))
                .arg(packed_version_for_tests(model, Fmi::V3Arrays)),
            "FMPy does not drive the FMU with arrays as it drives the FMU with scalars",
        );
    }
}

#[test]
fn an_fmu_3_has_the_platform_tuple_the_icon_and_the_list_of_its_references() {
    let file = std::fs::File::open(packed_version_for_tests(pack::HUBSLOSH, Fmi::V3)).unwrap();
    let mut archive = zip::ZipArchive::new(file).unwrap();
    let names: Vec<String> = archive.file_names().flatten().map(|name| name.into_owned()).collect();
    let binary = names.iter().find(|name| name.starts_with("binaries/")).unwrap();
    let tuple = binary.split('/').nth(1).unwrap();
    let (processor, system) = tuple.split_once('-').unwrap();
    assert!(["x86_64", "aarch64"].contains(&processor), "{binary}");
    assert!(["linux", "windows", "darwin"].contains(&system), "{binary}");
    let top =
        ["modelDescription.xml", "terminalsAndIcons/", "documentation/", "binaries/", "extra/"];
    for name in &names {
        assert!(top.iter().any(|top| name.starts_with(top)), "{name}");
    }
    for name in [
        "terminalsAndIcons/icon.png",
        "documentation/index.html",
        "documentation/licenses/license.txt",
    ] {
        assert!(names.iter().any(|there| there == name), "{name}");
    }
    // Every file that fmi-ls-manifest.xml lists exists.
    let mut manifest = String::new();
    let folder = "extra/org.fmi-standard.fmi-ls-ref";
    archive
        .by_name(&format!("{folder}/fmi-ls-manifest.xml"))
        .unwrap()
        .read_to_string(&mut manifest)
        .unwrap();
    let sources: Vec<_> =
        manifest.split("source=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(sources.len(), 3);
    for source in sources {
        assert!(names.contains(&format!("{folder}/{source}")), "{source}");
    }
}
