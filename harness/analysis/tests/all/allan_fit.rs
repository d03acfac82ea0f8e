use analysis::allan::{Covariance, Estimate, FLICKER, Fit, Noise, Octaves, Point, Term, variances};
use analysis::random::Random;
use fourier::{Forward, Inverse};

const STEP: f64 = 0.1;

/// Returns samples of flicker noise with the bias instability 1. White noise is filtered with
/// (1 − z⁻¹)^(−1/2), whose impulse response is a recursion (N. J. Kasdin, *Discrete simulation
/// of colored noise and stochastic processes and 1/f^α power law noise generation*, Proc. IEEE
/// 83, 1995). The first half is dropped, because the filter starts there.
fn flicker(count: usize, random: &mut Random) -> Vec<f64> {
    let length = 4 * count;
    let white = (0..2 * count).map(|_| random.normal()).chain(vec![0.0; 2 * count]).collect();
    let mut response = vec![1.0];
    for k in 1..2 * count {
        response.push(response[k - 1] * (k as f64 - 0.5) / k as f64);
    }
    response.resize(length, 0.0);
    let forward = Forward::new(length);
    let (a, b) = (forward.transform(white), forward.transform(response));
    let filtered = Inverse::new(length).transform(a.iter().zip(&b).map(|(a, b)| a * b).collect());
    filtered[count..2 * count].iter().map(|value| value / length as f64).collect()
}

fn record(noise: &Noise, count: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed, 7);
    let slow = match noise.flicker {
        0.0 => vec![0.0; count],
        _ => flicker(count, &mut random),
    };
    let keep = (-STEP / noise.bias_time).exp();
    let spread = noise.bias_instability / FLICKER;
    let (mut walk, mut bias) = (0.0, spread * random.normal());
    (slow.iter().enumerate())
        .map(|(k, slow)| {
            let white = noise.arw / STEP.sqrt() * random.normal();
            let value = white + noise.flicker * slow + walk + bias + noise.ramp * k as f64 * STEP;
            walk += noise.rrw * STEP.sqrt() * random.normal();
            bias = keep * bias + spread * (1.0 - keep * keep).sqrt() * random.normal();
            value
        })
        .collect()
}

const ALL: Noise = Noise {
    arw: 1e-4,
    flicker: 3.4e-5,
    rrw: 2.8e-6,
    ramp: 0.0,
    bias_instability: 0.0,
    bias_time: 100.0,
};
const COUNT: usize = 1 << 16;

/// Returns the true value of the quantity that the fit estimates for `term`.
fn size(noise: &Noise, term: Term) -> f64 {
    match term {
        Term::White => noise.arw,
        Term::Flicker => noise.flicker,
        Term::Walk => noise.rrw,
        Term::Ramp => noise.ramp,
        Term::Markov => noise.bias_instability,
    }
}

/// Fits `draws` simulated records of `noise`. Returns the number of records whose interval
/// contains the true value, separately for N, B and K, and the number of records whose fit
/// passes its test.
fn covered(noise: &Noise, draws: u64) -> ([u64; 3], u64) {
    let (mut held, mut described) = ([0; 3], 0);
    for seed in 0..draws {
        let fit = Octaves::from_samples(STEP, &record(noise, COUNT, seed)).describe().unwrap();
        described += u64::from(fit.fits && fit.bias_time.is_none());
        for (held, (term, estimate)) in held.iter_mut().zip(&fit.terms) {
            let truth = size(noise, *term);
            *held += u64::from((estimate.low..=estimate.high).contains(&truth));
        }
    }
    (held, described)
}

#[test]
fn intervals_of_the_allan_fit_contain_the_simulated_noise() {
    // with 95 % intervals, fewer than 33 of 40 would contain the true value with a probability of 1 in 3,000
    let (held, described) = covered(&ALL, 40);
    assert!(held.iter().all(|count| *count >= 33) && described >= 37, "{held:?} {described}");
}

#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn allan_intervals_contain_the_true_value_in_95_of_100_records() {
    let white = Noise { flicker: 0.0, rrw: 0.0, ..ALL };
    let walk = Noise { flicker: 0.0, ..ALL };
    let plateau = Noise { rrw: 0.0, ..ALL };
    for noise in [ALL, white, walk, plateau] {
        let (held, described) = covered(&noise, 400);
        println!("{noise:?}: {held:?} of 400, {described} described");
        // 400 draws determine a fraction of 0.95 with a standard deviation of 0.011
        assert!(held.iter().all(|count| *count >= 366) && described >= 384, "{held:?} {described}");
    }
}

fn median(mut widths: Vec<f64>) -> f64 {
    widths.sort_by(f64::total_cmp);
    widths.get(widths.len() / 2).copied().unwrap_or(f64::NAN)
}

#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn the_allan_fit_detects_the_noise_terms_that_exist_and_contains_their_true_values() {
    let white = Noise { flicker: 0.0, rrw: 0.0, ..ALL };
    let bias = Noise { bias_instability: 5e-5, bias_time: 5.0, ..white };
    let basic = [Term::White, Term::Flicker, Term::Walk];
    let with_bias = [Term::White, Term::Markov, Term::Walk];
    // relative widths of the intervals: N is known to 1 % in 1600 s, B to 30 % in 330 correlation times
    for (noise, terms, shown, widths) in [
        (white, basic, vec![Term::White], [0.04, 0.0]),
        (bias, with_bias, vec![Term::White, Term::Markov], [0.06, 1.5]),
    ] {
        let draws = 100;
        let fits: Vec<Fit> = (0..draws)
            .map(|seed| Octaves::from_samples(STEP, &record(&noise, 1 << 14, seed)).fit(&terms, 0))
            .map(Option::unwrap)
            .collect();
        for (place, term) in terms.iter().enumerate() {
            let found: Vec<Estimate> = fits.iter().map(|fit| fit.terms[place].1).collect();
            let truth = size(&noise, *term);
            let held = found.iter().filter(|e| (e.low..=e.high).contains(&truth)).count();
            // with 95 % intervals, fewer than 87 of 100 would contain the true value with a probability of 1 in 1,000
            assert!(held >= 87, "{term:?}: {held} of {draws}");
            assert!(found.iter().all(|e| e.low < e.high), "{term:?}: an interval is a point");
            let tiny = found.iter().filter(|e| e.low > 0.0 && e.low < 0.01 * e.value);
            assert!(tiny.count() <= 1, "{term:?}: lower ends of a search that found none");
            if *term == Term::Markov {
                let times = fits.iter().filter_map(|fit| fit.bias_time);
                let held = times.filter(|t| (t.low..=t.high).contains(&noise.bias_time)).count();
                println!("correlation time: {held} held");
                assert!(held >= 87, "correlation time: {held} of {draws}");
            }
            if let Some(k) = shown.iter().position(|t| t == term) {
                let significant = found.iter().filter(|e| e.low > 0.0).count();
                let width = median(found.iter().map(|e| (e.high - e.low) / truth).collect());
                println!("{term:?}: {held} held, {significant} significant, width {width:.3}");
                assert!(significant >= 90 + 10 * usize::from(k == 0), "{term:?} {significant}");
                assert!(width < widths[k], "{term:?}: {width}");
            }
        }
    }
}

#[test]
fn the_predicted_covariance_of_allan_variances_equals_the_scatter_over_300_records() {
    // 300 records determine the variance of an octave to √(2/300) = 8 %, and less accurately if its χ² has
    // few degrees of freedom
    // every fourth averaging time, so that the averages are longer by a factor of about two
    let records: Vec<Vec<Point>> = (0..300)
        .map(|seed| {
            let points = variances(STEP, &record(&ALL, 1 << 12, seed));
            points.into_iter().step_by(4).collect()
        })
        .collect();
    let factors: Vec<usize> =
        records[0].iter().map(|point| (point.tau / STEP).round() as usize).collect();
    let terms = [Term::White, Term::Flicker, Term::Walk];
    let tables = Covariance::new(STEP, 1 << 12, &factors, &terms, 1.0);
    let expected = tables.matrix(&terms.map(|term| size(&ALL, term).powi(2)));
    let mean = |k: usize| records.iter().map(|record| record[k].variance).sum::<f64>() / 300.0;
    let covariance = |i: usize, j: usize| {
        let (mean_i, mean_j) = (mean(i), mean(j));
        let products = records
            .iter()
            .map(|record| (record[i].variance - mean_i) * (record[j].variance - mean_j));
        products.sum::<f64>() / 299.0
    };
    for i in 0..factors.len() {
        let ratio = covariance(i, i) / expected[(i, i)];
        assert!((0.7..1.4).contains(&ratio), "{i}: {ratio}");
        for j in 0..i {
            let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
            // 300 records determine a correlation to 6 %
            let off = (covariance(i, j) - expected[(i, j)]) / size;
            assert!(off.abs() < 0.25, "{i}, {j}: {off}");
        }
    }
}

#[test]
fn the_allan_fit_extends_its_model_or_leaves_out_times_or_reports_a_misfit() {
    let bias = Noise { bias_instability: 1e-4, bias_time: 40.0, ..ALL };
    let bias = Noise { flicker: 0.0, rrw: 0.0, ..bias };
    let fit = Octaves::from_samples(STEP, &record(&bias, 1 << 17, 1)).describe().unwrap();
    let Some(time) = fit.bias_time else { panic!("{fit:?}") };
    // 13,000 s are 330 correlation times
    assert!(fit.fits && (time.low..time.high).contains(&40.0), "{fit:?}");
    let ramp = Noise { ramp: 1e-6, ..ALL };
    let fit = Octaves::from_samples(STEP, &record(&ramp, COUNT, 2)).describe().unwrap();
    assert!(fit.fits && (fit.noise.ramp / 1e-6 - 1.0).abs() < 0.1, "{fit:?}");
    // a sine with a period of 100 s, which is no term of the noise model
    let mut sine = record(&ALL, COUNT, 3);
    for (k, value) in sine.iter_mut().enumerate() {
        *value += 1e-4 * (0.0628 * STEP * k as f64).sin();
    }
    let fit = Octaves::from_samples(STEP, &sine).describe().unwrap();
    assert!(!fit.fits && (10.0..200.0).contains(&fit.worst.tau), "{fit:?}");
    // means of two neighbouring samples, as a filter of the gyro computes them
    let smooth: Vec<f64> =
        record(&ALL, COUNT, 4).windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let fit = Octaves::from_samples(STEP, &smooth).describe().unwrap();
    assert!(fit.fits && fit.from > STEP && fit.bias_time.is_none(), "{fit:?}");
    assert!((fit.noise.arw / ALL.arw - 1.0).abs() < 0.03, "{fit:?}");
    // a record without any noise
    assert_eq!(Octaves::from_samples(STEP, &[0.0; 1000]).describe(), None);
    assert_eq!(Octaves::from_samples(STEP, &[1.0, 2.0]).describe(), None);
}
