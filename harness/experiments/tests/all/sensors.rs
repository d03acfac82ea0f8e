//! Sensors that are recorded in a run.

use experiments::plan::Plan;
use experiments::profile::Torque;
use experiments::run::{Run, TORQUE};
use experiments::sensors::{Sensor, Sensors};
use host::fmu::Fmu;
use pack::packed_for_tests;
use signals::table::Table;

const STEP: f64 = 0.02;

fn settings(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect()
}

fn record(set: &[(&str, &str)], sensors: &[&str], columns: &[&str], seconds: f64) -> Table {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let profile = format!("lin-sweep:amplitude=0.1,f0=2,f1=3,duration={seconds}");
    let run = Run {
        settings: settings(set),
        input: Some(TORQUE.into()),
        torque: Torque::Profile(profile.parse().unwrap()),
        others: Vec::new(),
        step: STEP,
        sample: STEP,
        stop: seconds,
        tolerance: None,
        hold: false,
    };
    let sensors: Vec<Sensor> = sensors.iter().map(|text| text.parse().unwrap()).collect();
    let sensors = Sensors::new(&sensors, fmu.description(), &run.settings, STEP).unwrap();
    let mut all = columns.to_vec();
    all.extend(sensors.required_variables().into_iter().filter(|name| !columns.contains(name)));
    let mut instance = run.initialise(&fmu).unwrap();
    let table = run.drive(&mut instance, &all, |_| {}).unwrap();
    sensors.read(table, "run", STEP).unwrap()
}

fn column<'t>(table: &'t Table, name: &str) -> &'t [f64] {
    table.column(name).unwrap()
}

/// The two gauges measure the components of the wave, so that the root of the sum of their squares equals the FMU's output
/// `wave_height`.
#[test]
fn two_wave_gauges_at_right_angles_measure_the_wave_of_every_slosh_model() {
    for model in ["linear", "planar", "spherical", "liquid"] {
        let set =
            [("slosh.model", model), ("slosh.modes", "3"), ("init.slosh_angle_radial", "0.1")];
        let gauges = ["out=gauge:angle=0", "along=gauge:angle=90deg"];
        let table = record(&set, &gauges, &["wave_height"], 20.0);
        let [out, along, wave] = ["out", "along", "wave_height"].map(|name| column(&table, name));
        let mut largest = 0.0f64;
        for ((out, along), wave) in out.iter().zip(along).zip(wave) {
            // the limit is the rounding error of the arcsines, in the harness and in the FMU
            assert!((out.hypot(*along) - wave).abs() < 1e-14, "{model}: {out}, {along}, {wave}");
            largest = largest.max(*wave);
        }
        assert!(largest > 5e-3, "{model}: there is a wave, {largest}");
    }
}

/// The integral of the pressure over the wall, with the cosine of the angle as weight, must equal the output
/// `F_tangential`. Both are computed without damping. In both, the liquid of modes that are not simulated moves with
/// the tank.
#[test]
fn pressures_on_the_wall_add_up_to_the_force_on_the_tank() {
    // Gauss–Legendre quadrature with five points in each of 8 parts of the height
    let x = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    let w = [0.568_888_888_888_888_9, 0.478_628_670_499_366_5, 0.236_926_885_056_189_1];
    let points: Vec<(f64, f64)> =
        [(0, 1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)].map(|(i, s)| (s * x[i], w[i])).into();
    let (h, radius, parts) = (0.1, 0.0815, 8);
    let heights: Vec<(f64, f64)> = (0..parts)
        .flat_map(|k| {
            let half = 0.5 * h / f64::from(parts);
            let middle = (2.0 * f64::from(k) + 1.0) * half;
            points.iter().map(move |(x, w)| (middle + half * x, half * w))
        })
        .collect();
    for modes in ["1", "10"] {
        let set =
            [("slosh.modes", modes), ("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0")];
        let sensors: Vec<String> = heights
            .iter()
            .enumerate()
            .map(|(k, (z, _))| format!("p{k}=pressure:angle=90deg,height={z}"))
            .collect();
        let sensors: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let table = record(&set, &sensors, &["F_tangential", "g_axial"], 5.0);
        let force = column(&table, "F_tangential");
        for row in 0..table.rows() {
            // ∫ p cos φ R dφ dz with p = ρ g (h − z) + p_1 cos φ is π R ∫ p_1 dz
            let one = |(k, (z, w)): (usize, &(f64, f64))| {
                let at_rest = 1000.0 * 9.81 * (h - z);
                w * (column(&table, &format!("p{k}"))[row] - at_rest)
            };
            let sum: f64 = heights.iter().enumerate().map(one).sum();
            let sum = std::f64::consts::PI * radius * sum;
            // rounding of ρ g h = 1e3 Pa over the wall; the error of the quadrature is below 1e-12
            assert!((sum - force[row]).abs() < 1e-10, "{modes}, row {row}: {sum}, {}", force[row]);
        }
        assert!(force.iter().any(|f| f.abs() > 0.5), "there is a force");
    }
}

#[test]
fn a_camera_measures_a_tilted_plane_if_the_liquid_is_at_rest_on_a_tilted_bench() {
    // a tilted bench: at rest all modes have the angle of the specific force, and the surface is the plane perpendicular to it
    let tilt = 0.02_f64;
    let set = [
        ("slosh.modes", "10"),
        ("bench.tilt", "0.02"),
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.zeta", "0.5"),
        ("hub.I", "1e9"),
    ];
    let sensors = [
        "view=camera",
        "low=gauge:angle=0",
        "p=pressure:angle=0,height=0.04",
        "a=accelerometer:angle=0",
    ];
    let table = record(&set, &sensors, &["g_axial"], 20.0);
    let last = |name: &str| *column(&table, name).last().unwrap();
    let rise = 0.0815 * tilt.tan();
    // planar models move only tangentially: a radial specific force changes only the accelerometer and the pressure
    // of the rigid liquid
    assert!(last("view.plane_radial").abs() < 1e-15 && last("low").abs() < 1e-15);
    assert!((last("a") + 9.81 * tilt.tan()).abs() < 1e-9, "{}", last("a"));
    let set: Vec<_> = set.into_iter().chain([("slosh.model", "spherical")]).collect();
    let table = record(&set, &sensors, &["g_axial"], 20.0);
    let last = |name: &str| *column(&table, name).last().unwrap();
    // with ten modes 2e-6 of the plane is missing, because the sum Σ 8/(ξ²(ξ²−1)) = 1 is truncated; the angles differ from their
    // sines by the third power of the tilt
    assert!((last("view.plane_radial") / rise - 1.0).abs() < 3e-4, "{}", last("view.plane_radial"));
    // at the wall 2 % of the height is missing, because the sum Σ 2/(ξ²−1) = 1 is truncated
    assert!((last("low") / rise - 1.0).abs() < 0.025, "{}", last("low"));
    // hydrostatic pressure with the lateral specific force: ρ (g (h − z) + g tan(tilt) R); the modes that are left out contribute
    // nothing at the wall
    let hydrostatic = 1000.0 * 9.81 * (0.06 + rise);
    assert!((last("p") - hydrostatic).abs() < 1e-3 * 1000.0 * 9.81 * rise, "{}", last("p"));
}

#[test]
fn sensors_have_the_requested_noise_bias_scale_quantisation_rate_and_delay() {
    let noises = [
        ("gauge", "", 2e-4),
        ("pressure", "height=0.03,", 5.0),
        ("camera", "", 1e-3),
        ("force", "", 0.01),
        ("accelerometer", "radius=0.3,", 2e-3),
        ("encoder", "", 1e-4),
        ("variable", "of=slosh_rate,", 0.02),
    ];
    for (kind, own, noise) in noises {
        let errors = format!("rate=25,noise={noise},bias={},scale=1.02,delay=0.06", 3.0 * noise);
        let sensors =
            [format!("s={kind}:{own}{errors}"), format!("t={kind}:{}", own.trim_end_matches(','))];
        let sensors: Vec<&str> = sensors.iter().map(String::as_str).collect();
        let table = record(&[], &sensors, &[], 200.0);
        let channel = if kind == "camera" { ".mode_tangential[1]" } else { "" };
        let [read, truth] = ["s", "t"].map(|name| column(&table, &format!("{name}{channel}")));
        let mut errors = Vec::new();
        for row in 0..table.rows() {
            // a sample is taken in every second row, and its reading arrives three rows later
            let arrives = row >= 3 && (row - 3) % 2 == 0;
            assert_eq!(!read[row].is_nan(), arrives, "{kind}: row {row}");
            if arrives {
                errors.push(read[row] - 1.02 * truth[row - 3] - 3.0 * noise);
            }
        }
        let n = errors.len() as f64;
        assert!(n > 4990.0);
        let mean = errors.iter().sum::<f64>() / n;
        let std = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        // four standard errors: noise/√n of the mean, 1/√(2 n) of the standard deviation, 1/√n of the
        // correlation between successive readings
        assert!(mean.abs() < 4.0 * noise / n.sqrt(), "{kind}: mean {mean}");
        assert!((std / noise - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{kind}: deviation {std}");
        let next: f64 = errors.windows(2).map(|e| (e[0] - mean) * (e[1] - mean)).sum();
        assert!((next / n / (std * std)).abs() < 4.0 / n.sqrt(), "{kind}: correlation {next}");
    }
    let table = record(&[], &["s=encoder:quantum=1e-3", "t=encoder"], &[], 20.0);
    for (read, truth) in column(&table, "s").iter().zip(column(&table, "t")) {
        assert!((read - truth).abs() <= 0.5e-3 + 1e-15, "within half a step");
        assert!((read / 1e-3 - (read / 1e-3).round()).abs() < 1e-9, "a multiple of the step");
    }
}

#[test]
fn noise_does_not_depend_on_other_sensors_and_differs_between_sensors_seeds_and_runs() {
    let one = record(&[], &["a=encoder:noise=1"], &[], 2.0);
    let two = record(
        &[],
        &["b=encoder:noise=1", "a=encoder:noise=1", "c=encoder:noise=1,seed=2"],
        &[],
        2.0,
    );
    assert_eq!(column(&one, "a"), column(&two, "a"));
    assert_ne!(column(&two, "a"), column(&two, "b"));
    assert_ne!(column(&two, "c"), column(&two, "b"));
}

/// The sensor takes 10 samples a second in a run with 50 rows a second. Rows without a reading are empty in CSV and null in
/// Parquet.
#[test]
fn missing_readings_of_a_sensor_are_empty_in_csv_and_null_in_parquet() {
    let table = record(&[], &["s=encoder:rate=10,noise=1e-3"], &["omega"], 1.0);
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("t.csv");
    table.write(&csv, &Default::default()).unwrap();
    let text = std::fs::read_to_string(&csv).unwrap();
    let empty = text.lines().skip(1).filter(|line| line.ends_with(',')).count();
    assert_eq!((empty, table.rows()), (40, 51), "11 readings at 10 Hz in a second of 50 Hz");
    let parquet = folder.path().join("t.parquet");
    table.write(&parquet, &Default::default()).unwrap();
    use signals::recording::{Between, Columns, Signal, Wanted, read};
    let signal = |name, between| Signal { name, required: true, between, unit: None };
    let signals = [signal("omega", Between::Line), signal("s", Between::Missing)];
    for path in [csv, parquet] {
        let columns = Columns::for_variables(std::iter::empty()).unwrap();
        let wanted = Wanted { signals: &signals, columns: &columns };
        let back = read(&path, &wanted, &mut |_| {}).unwrap();
        let there = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let kept = column(&table, "s").iter().map(|v| if v.is_nan() { f64::NAN } else { *v });
        let kept: Vec<f64> = kept.collect();
        assert_eq!(there(back.column("s").unwrap()), there(&kept), "{}", path.display());
    }
}

#[test]
fn the_error_of_a_wrong_sensor_option_says_what_is_allowed() {
    let said = |text: &str| format!("{:#}", text.parse::<Sensor>().unwrap_err());
    let cases = [
        ("gauge", "(allowed: NAME=KIND:key=value,…)"),
        ("1a=gauge", "a name has letters"),
        ("a=gage", "did you mean \"gauge\""),
        (
            "a=gauge:angle=x,noise=-1",
            "angle expects a number, not \"x\"; noise must not be negative",
        ),
        ("a=gauge:of=theta", "gauge does not read a variable"),
        ("a=variable", "of=NAME is required"),
        ("a=encoder:hight=1", "there is no parameter \"hight\""),
    ];
    for (text, words) in cases {
        assert!(said(text).contains(words), "{text}: {}", said(text));
    }
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let refused = |text: &str, set: &[(&str, &str)]| {
        let sensors = [text.parse().unwrap()];
        let new = Sensors::new(&sensors, fmu.description(), &settings(set), STEP);
        format!("{:#}", new.unwrap_err())
    };
    for (text, set, words) in [
        ("a=gauge", ("slosh.model", "frozen"), "no moving surface"),
        ("a=camera", ("slosh.source_kind", "2"), "only for an upright cylinder"),
        ("a=pressure:height=0.2", ("tank.h", "0.1"), "above the liquid at rest, tank.h = 0.1 m"),
        ("a=force:of=theta", ("tank.h", "0.1"), "unit rad (allowed: N)"),
        ("a=gauge:rate=30", ("tank.h", "0.1"), "not a multiple of the step, 0.02 s"),
        ("a=gauge:rate=100", ("tank.h", "0.1"), "not a multiple of the step"),
        ("theta=encoder", ("tank.h", "0.1"), "the FMU has a variable of this name"),
    ] {
        assert!(refused(text, &[set]).contains(words), "{text}: {}", refused(text, &[set]));
    }
    // names of elements of two-dimensional arrays contain commas
    assert!(refused("a=variable:of=p[1,2],noise=1", &[]).contains("no variable \"p[1,2]\""));
    let plan = "profile = \"sine\"\n[sensor]\nwave = \"gage\"\nload = 3\n";
    let error = format!("{:#}", Plan::parse(plan).unwrap_err());
    assert!(error.contains("line 3: sensor wave: there is no kind \"gage\""), "{error}");
    assert!(error.contains("line 4: [sensor] load expects a text in quotes"), "{error}");
}
