//! Tests whether the verdict names the cause of a misfit. Identifies recordings of benches that differ from the fitted models in
//! one of ten ways. Prints the cause that each verdict names, and counts the right and the wrong ones.
//!
//! ```text
//! cargo run --release -p identify --features studies --example causes -- [KEY=VALUE ...]
//!   seeds=1-3           random benches of each way
//!   ways=lag,…          the ways in which benches differ, see [`WAYS`]
//!   say=false           true: prints the messages of every search
//! ```

#[path = "fmu_twin/mod.rs"]
#[allow(dead_code, reason = "others use the rest of it")]
mod fmu_twin;

use analysis::random::Random;
use analysis::statistics::peak;
use anyhow::{Context, Result, bail};
use fmu_twin::{SensorErrors, Twin, Unmodelled};
use host::fmu::Fmu;
use identify::bench::options::Options;
use identify::engine::Hold;
use identify::input::reading::prepare;
use identify::input::recording::Recording;
use identify::methods::output_error::identify;

/// One way in which a simulated bench differs from every fitted model, for example by a lag of the actuator.
struct Way {
    name: &'static str,
    effects: &'static [Unmodelled],
    settings: &'static [(&'static str, &'static str)],
    /// Torque profile with which the difference becomes visible.
    torque: &'static str,
    /// Changes the rates of the recording, for a fault of the gyro.
    gyro: fn(&mut Recording),
    /// Words with which the verdict or the notes must name the effect.
    named: &'static str,
}

const RATE: f64 = 25.0;

const fn way(name: &'static str, named: &'static str) -> Way {
    let torque = "lin-sweep:amplitude=0.1,duration=120,f0=1.5,f1=3.6";
    Way { name, effects: &[], settings: &[], torque, gyro: |_| {}, named }
}

const WAYS: [Way; 10] = [
    Way { effects: &[Unmodelled::ActuatorLag], ..way("lag", "an actuator that lags") },
    Way { effects: &[Unmodelled::GyroLag], ..way("filter", "a gyro with a low-pass filter") },
    Way {
        settings: &[
            ("friction.model", "lugre"),
            ("friction.sigma0", "10"),
            ("friction.sigma1", "0"),
        ],
        ..way("presliding", "presliding stiffness")
    },
    Way { effects: &[Unmodelled::Tilt], ..way("imbalance", "an imbalance on a tilted axis") },
    Way {
        torque: "lin-sweep:amplitude=0.1,duration=600,f0=1.5,f1=3.6",
        effects: &[Unmodelled::Warming],
        ..way("warming", "friction that drifts")
    },
    Way {
        effects: &[Unmodelled::Clipping],
        ..way("limit", "an actuator that reaches its largest")
    },
    Way {
        torque: "lin-sweep:amplitude=0.4,duration=200,f0=1.5,f1=3.6",
        effects: &[Unmodelled::Drag],
        ..way("drag", "the rate's square against the motion")
    },
    Way {
        settings: &[("slosh.zeta_amplitude", "0.02")],
        ..way("damping", "damping that grows with the amplitude")
    },
    Way {
        gyro: |recording| {
            let most = 0.7 * peak(&recording.rate);
            recording.rate.iter_mut().for_each(|w| *w = w.clamp(-most, most));
        },
        ..way("clipped", "omega is clipped")
    },
    Way {
        gyro: |recording| {
            for from in [0.3, 0.5, 0.7].map(|part| (part * recording.rate.len() as f64) as usize) {
                let value = recording.rate[from];
                recording.rate[from..from + 50].fill(value);
            }
        },
        ..way("frozen", "omega is frozen")
    },
];

fn twin(way: &Way, seed: u32) -> Twin {
    let mut random = Random::new(seed.into(), 21);
    let mut near = |value: f64| (value * (0.8 + 0.4 * random.uniform())).to_string();
    let mut settings: Vec<(String, String)> = [
        ("hub.I", near(0.322)),
        ("tank.d", near(0.163)),
        ("tank.h", near(0.1)),
        ("slosh.zeta", near(0.003)),
        ("friction.b", near(0.038)),
        ("friction.c", near(0.0035)),
        ("friction.d", near(0.0024)),
        ("slosh.zeta_from_correlation", "false".into()),
        ("slosh.model", "linear".into()),
    ]
    .into_iter()
    .map(|(name, value)| (name.to_string(), value))
    .collect();
    settings.extend(way.settings.iter().map(|(name, value)| (name.to_string(), value.to_string())));
    let sensor_errors = SensorErrors { delay: 0.0, gyro_scale: 1.005, gyro_bias: 2e-3 };
    Twin {
        settings,
        sensor_errors,
        unmodelled: way.effects.to_vec(),
        rate: RATE,
        ..Twin::default()
    }
}

fn main() -> Result<()> {
    let (mut seeds, mut say) = (1..=3, false);
    let mut some: Vec<String> = WAYS.iter().map(|way| way.name.into()).collect();
    for argument in std::env::args().skip(1) {
        let (key, value) =
            argument.split_once('=').with_context(|| format!("{argument}: KEY=VALUE"))?;
        match key {
            "seeds" => {
                let (from, to) = value.split_once('-').unwrap_or((value, value));
                seeds = from.parse()?..=to.parse()?;
            }
            "ways" => some = value.split(',').map(String::from).collect(),
            "say" => say = value == "true",
            _ => bail!("{key} is not asked for; see the head of examples/causes.rs"),
        }
    }
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let (mut count, mut named, mut wrong, mut accepted) = (0, 0, 0, 0);
    for seed in seeds {
        for way in WAYS.iter().filter(|way| some.iter().any(|name| *name == way.name)) {
            let torque = fmu_twin::torque(way.torque)?;
            let mut recording = twin(way, seed).record(&fmu, &torque, Some(seed))?;
            (way.gyro)(&mut recording);
            let options = Options {
                models: vec!["linear".into()],
                intersample: Some(Hold::FirstOrderHold),
                ..Options::default()
            };
            let mut notes = Vec::new();
            let coarsest = options.nominal(&fmu)?.coarsest();
            let parts = prepare(recording, coarsest, &mut |line| notes.push(line))?;
            let found = identify(&fmu, &parts, &options, &mut |news| {
                if say {
                    println!("  {}", news.line());
                }
            })?;
            let is_named = found.verdict.iter().chain(&notes).any(|line| line.contains(way.named));
            let cause = found.details.cause.as_ref();
            let is_wrong = cause.is_some_and(|cause| !cause.effect.contains(way.named));
            count += 1;
            named += usize::from(is_named);
            wrong += usize::from(is_wrong);
            accepted += usize::from(found.fits == Some(true));
            println!(
                "{} {seed}: {}{}, fits {:?}, {:.0} s, {:.0} simulations, cause {:?}",
                way.name,
                if is_named { "named" } else { "NOT NAMED" },
                if is_wrong { ", WRONG CAUSE" } else { "" },
                found.fits,
                found.details.seconds,
                found.details.fit.simulations,
                found.details.cause
            );
            if !is_named || is_wrong || say {
                notes.iter().chain(&found.verdict).for_each(|line| println!("  > {line}"));
                let gains = ["−2 ln L falls", "at first order"];
                let gains =
                    found.done.iter().filter(|line| gains.iter().any(|words| line.contains(words)));
                gains.for_each(|line| println!("  . {line}"));
            }
        }
    }
    println!("{named} of {count} named, {wrong} with a wrong cause; {accepted} fit");
    Ok(())
}
