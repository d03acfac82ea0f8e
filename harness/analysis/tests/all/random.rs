use analysis::random::Random;

#[test]
fn a_seed_gives_the_same_random_numbers_on_every_machine() {
    // the expected numbers were computed from PCG's definition with Python's integers
    let mut random = Random::new(1, 2);
    let bits = [random.uniform(), random.normal()].map(f64::to_bits);
    assert_eq!(bits, [4607160018058674131, 13828960616544136822]);
}

#[test]
fn normal_numbers_have_the_moments_of_a_normal_distribution() {
    let mut random = Random::new(7, 0);
    let drawn: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
    let moment = |n: i32| drawn.iter().map(|x| x.powi(n)).sum::<f64>() / drawn.len() as f64;
    // five standard errors: sqrt(1, 2, 15, 96 / 100000) for the moments 1 to 4
    for (n, expected, error) in
        [(1, 0.0, 0.0032), (2, 1.0, 0.0045), (3, 0.0, 0.0123), (4, 3.0, 0.031)]
    {
        assert!((moment(n) - expected).abs() < 5.0 * error, "moment {n}: {}", moment(n));
    }
}

#[test]
fn random_streams_of_one_seed_differ() {
    let streams: Vec<Vec<f64>> = (0..4)
        .map(|stream| {
            let mut random = Random::new(1, stream);
            (0..20_000).map(|_| random.normal()).collect()
        })
        .collect();
    for a in 0..4 {
        for b in 0..a {
            let product: f64 = streams[a].iter().zip(&streams[b]).map(|(x, y)| x * y).sum();
            // five standard errors of the correlation of 20,000 independent pairs
            assert!((product / 20_000.0).abs() < 5.0 / 20_000_f64.sqrt(), "{a} and {b}");
        }
    }
}
