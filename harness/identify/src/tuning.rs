//! Tuning constants besides those of the engine, by the file that uses them, with tests that depend on them.
//!
//! A length without a unit is a ratio. "Deviations" are standard deviations of noise, and sums of squares are in its variances.
//! Coefficients of formulas, orders of tables and names stay with their code.

// Signals on clocks of their own: `input/clocks.rs`.
// Tests: `a_slow_gyro_is_completed_and_its_own_rows_are_known`, `a_band_limited_torque_of_10_hz_is_known_between_its_samples`.
/// Spacing of values, in usual ones, up to which a cubic joins them.
pub const CUBIC_SPACING: f64 = 2.5;
/// Rows of a torque that are wider apart than this, s, do not describe a band-limited torque by lines between them: lines leave images of it.
pub const COARSE_TORQUE: f64 = 0.035;
/// Time between the instants that a coarse torque gets, s, at most.
pub const FINE_TORQUE: f64 = 0.02;
/// Half the length of the kernel that interpolates a coarse torque, in its samples.
pub const KERNEL_HALF: isize = 24;
/// Shape of its Kaiser window: side lobes of 80 dB.
pub const KERNEL_SHAPE: f64 = 7.9;

// Gaps of the torque: `input/gaps.rs`.
// Tests: `lost_samples_of_a_sweep_are_predicted`, `lost_rows_of_a_sweep_are_interpolated_and_lost_rows_of_noise_split_the_recording`.
/// Spacing of the torque's samples, in usual ones, from which on some were lost.
pub const LOST_SPACING: f64 = 1.75;
/// Longest gap that is filled, s.
pub const LONGEST_FILLED: f64 = 3.0;
/// Longest gap that a line may join where the recording cannot be cut, s.
pub const LONGEST_LINE: f64 = 0.25;
/// Samples on either side of a gap that the model is fitted to.
pub const GAP_SIDE: usize = 250;
/// Order of that model.
pub const GAP_ORDER: usize = 32;
/// Places at which a filling is tried.
pub const GAP_TRIALS: usize = 12;
/// Kick of the hub by the errors of all fillings, over the gyro's noise.
pub const GAP_KICK: f64 = 0.1;
/// Gaps that are too few to make small parts of a recording.
pub const FEW_GAPS: usize = 5;
/// Part of the usual step by which samples may be off an even grid.
pub const EVEN_GRID: f64 = 0.02;

// Plausibility of a recording: `input/plausible.rs`.
// Tests: `a_wheel_that_gives_its_torque_shows_its_inertia_and_one_that_does_not_is_doubted`.
/// Time over which wheel speed and torque are compared, s.
pub const WHEEL_WINDOW: f64 = 0.1;

// Reading: `input/reading.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`, `twenty_spikes_are_reported_and_left_out`.
/// Time after the beginning of a part that is already moving in which no sensor is fitted, s: a sensor that is late shows
/// what happened before the part's first torque.
pub const LATE_SENSOR: f64 = 0.1;
/// Rows of a free decay: the spectrum of its residual takes 400 sines a row.
pub const DECAY_ROWS: usize = 1_000_000;
/// Number of spikes whose times are listed.
pub const LISTED_SPIKES: usize = 8;
/// Spread of the rate over its noise beyond which the hub moves; a gyro's drift makes less.
pub const MOVING_SPREAD: f64 = 2.0;

// Recordings of any FMU: `input/record.rs`.
// Tests: `any_fmu_refuses_records_out_of_range`.
/// Values of an output below which nothing is estimated from them.
pub const FEWEST_VALUES: usize = 10;

// Recordings of the bench: `input/recording.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`, `a_gyro_slower_than_the_rows_is_seen_by_its_repeats`, `no_method_hangs_or_panics_on_values_out_of_range`.
/// Shortest recording, s: in it, of slosh at 2.4 Hz, some fifty periods.
pub const SHORTEST_RECORDING: f64 = 20.0;
/// A recording that is long for its slosh, s. A bare tank's slosh decays within some 23 s (1/(ζω) of the
/// thesis's tank); its half-power width of 14 mHz is resolved by 1/14 mHz = 70 s. A shorter one says less of
/// damping and mass, and its intervals are as wide as that.
pub const LONG_RECORDING: f64 = 120.0;
/// Largest share of rows with a new value of the gyro at which the gyro counts as slower than the recording. Noise makes
/// a gyro that is as fast as the recording change in nearly every row.
pub const SLOW_GYRO: f64 = 0.75;
/// Largest value of a signal: the squares of all rows have a finite sum.
pub const LARGEST_VALUE: f64 = 1e100;
/// Part of the changes of a held gyro that fall on the rows of its own clock.
pub const ON_CLOCK: f64 = 0.98;
/// Slowest gyro that is looked for, in rows a value.
pub const SLOWEST_GYRO: usize = 100;

// Sensor faults: `input/sensor_faults.rs`.
// Tests: `each_fault_is_named`, `a_sound_gyro_has_no_faults`, `a_hub_at_rest_is_no_fault`, `a_clipping_limit_at_one_end_of_the_range_holds_at_the_other`.
/// Fewest values at an end of the range that are clipped, and how many times as many they are as equal values just inside it.
pub const CLIPPED: (usize, f64) = (20, 4.0);
/// Width of that inside, in units of the noise.
pub const CLIPPED_INSIDE: f64 = 3.0;
/// Step, in units of the noise, that a value takes when it comes back from being clipped or frozen.
pub const FAULT_LEAVES: f64 = 5.0;
/// The same in units of the sensor's resolution, where it is at both ends.
pub const FAULT_STEPS: f64 = 2.0;
/// First step of an angle that leaves its rest over the second, at most: it starts with zero rate, and its acceleration does not fall.
pub const FROM_REST: f64 = 1.0 / 3.0;
/// Probability that a run of equal values is chance.
pub const FROZEN_CHANCE: f64 = 1e-6;
/// Fewest values in a frozen run.
pub const FROZEN_RUN: usize = 5;
/// Fewest repeats, and how much larger their mean square off the neighbours is than that of other values.
pub const REPEATS: (usize, f64) = (10, 3.0);
/// Part of the largest value that rounding may make.
pub const SENSOR_ROUNDING: f64 = 1e-9;

// Spikes: `input/spikes.rs`.
// Tests: `single_and_adjacent_spikes_are_found_and_noise_is_not_a_spike`, `more_than_one_value_in_a_hundred_is_no_spike`, `a_step_of_the_torque_makes_no_spike`.
/// Deviations of r beyond which a value is a spike; of 135,000 rows of noise none is in 10¹⁴ recordings.
pub const SPIKE_BEYOND: f64 = 10.0;
/// Spikes at most, of all values: more are noise of another kind, which no row should be left out for.
pub const SPIKE_SHARE: f64 = 0.01;
/// Rows on either side of a step of the torque in which r may be the hub's own motion.
pub const SPIKE_NEAR_STEP: usize = 3;
/// Part of the torque's peak that is a step from one row to the next.
pub const TORQUE_STEP: f64 = 0.5;
/// Rows on either side whose median is what is usual around a row.
pub const SPIKE_AROUND: usize = 50;

// Tolerances: `input/tolerance.rs`.
// Tests: `a_torque_that_is_wrong_within_its_tolerance_leaves_the_truth_in_the_intervals`.
/// Share of the variance above which the verdict names it.
pub const TOLD_SHARE: f64 = 0.2;

// Unknowns of any FMU: `model/unknown.rs`.
// Tests: `known_values_count_with_their_tolerances`.
/// Plausible distance of a scale's error from 0, where neither bounds nor a prior say it.
pub const SCALE_REACH: f64 = 0.1;
/// Plausible distance of a known value from its mean, standard deviations: differences have to show more than the solver's errors.
pub const KNOWN_REACH: f64 = 5.0;

// Runs of any FMU: `model/simulate.rs`.
// Tests: `the_hosts_solver_and_the_fmus_give_the_same_estimates`, `a_smooth_input_is_followed_by_an_fmu_that_cannot_interpolate`.
/// Steps of the host's solver from one row to the next where it is only compared with.
pub const COMPARED_STEPS: usize = 1000;
/// Tolerance of a solver that the FMU's own is compared with, where the FMU suggests none.
pub const COMPARED_TOLERANCE: f64 = 1e-8;
/// Factor by which that is finer than the one that the FMU suggests.
pub const COMPARED_FACTOR: f64 = 1e-2;
/// Parts of the way from row to row over which an input that follows a line is held, where the FMU takes no slopes. Held at
/// the middle of each part, it differs from its line by a sawtooth of an eighth of its change from row to row, without a delay.
pub const HELD_STEPS: usize = 4;
/// Steps whose effects of an input's slope are compared, s.
pub const SLOPE_PROBES: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// The finest tolerance of the host's solver.
pub const FINEST_TOLERANCE: f64 = 1e-13;

// Effects outside the FMU: `bench/effect.rs`.
// Tests: `lags_of_a_sine_equal_those_of_its_frequency_response`.
/// Fewest and most parts of the way from knot to knot: lines between points of a lagged torque act as the curve does to 1e-3 at 2.4 Hz
/// and 50 knots a second.
pub const LAG_PARTS: (f64, f64) = (3.0, 8.0);

// The bench as it is set up: `bench/nominal.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`.
/// Coarsest mean time between rows of any bench on the ground, s: slosh at 2.4 Hz needs more than two rows a period.
pub const COARSEST: f64 = 0.2;

// Runs of the bench: `bench/simulate.rs`.
// Tests: `a_twin_with_a_delay_or_a_smooth_torque_is_what_the_fit_simulates`, `a_run_that_would_not_end_is_refused`.
/// Instants closer than this are the same, s.
pub const SAME_INSTANT: f64 = 1e-9;
/// Most internal steps of our FMUs in a communication step: so many, and so many a second. A fit's runs take some 100 a second. A
/// search may try values that take millions: it cannot judge them, and tries others.
pub const MOST_INTERNAL_STEPS: (f64, f64) = (200.0, 2e4);

// Starts from data: `bench/start.rs`.
// Tests: `poles_and_zeros_of_the_exact_response_give_the_bench_back`.
/// Damping ratios that are tried.
pub const DAMPINGS: [f64; 5] = [0.0015, 0.003, 0.006, 0.015, 0.04];
/// Steps of the slosh frequency over the band, relatively: half the half-power width of the least damping.
pub const FREQUENCY_FINENESS: f64 = 1e-3;
/// Longest delay that the balance of power may show, s.
pub const LATEST_DELAY: f64 = 0.05;

// Design of experiments: `bench/design.rs`.
// Tests: `d_optimal_power_is_near_the_slosh_frequency_and_reduces_uncertainty`, `a_multisine_has_only_odd_lines_and_the_given_peak`.
/// Odd lines in a group, of which one is left out.
pub const LINE_GROUP: usize = 4;
/// Share of the power that is always spread over all lines. It excites the resonance of a slightly different plant, and shows
/// distortion everywhere.
pub const SPREAD_POWER: f64 = 0.25;
/// Rounds of `within_angle`.
pub const ANGLE_ROUNDS: usize = 20;
/// Part of the limit with which `within_angle` ends.
pub const ANGLE_ENOUGH: f64 = 0.97;

// Verdict: `bench/verdict.rs`.
// Tests: `a_search_that_would_leave_the_fmus_range_ends_at_its_end_with_a_result`.
/// Newton decrement above which the verdict reports it.
pub const TOLD_DECREMENT: f64 = 0.1;

// Page: `words/page.rs`.
// Tests: `the_page_is_whole`.
/// Points of a curve: more than a screen has pixels are not seen.
pub const PAGE_POINTS: usize = 700;
/// Length of the stretch that is drawn row by row, s.
pub const PAGE_STRETCH: f64 = 8.0;
/// Longest lag of the autocorrelation, rows.
pub const PAGE_LAGS: usize = 200;

// Output error: `methods/output_error.rs`.
// Tests: `starts_forty_percent_off_end_at_the_minimum_of_the_datas_own`, `no_model_fits_a_torque_that_is_clipped`.
/// Beginnings that are tried where no model fits the whole recording, as fractions of its rows.
pub const BEGINNINGS: [f64; 2] = [0.35, 0.5];

// Friction runs: `methods/friction.rs`.
// Tests: `friction_of_three_sets_of_runs_ends_in_no_false_minimum`, `recordings_that_show_no_friction_are_refused_with_what_to_do`, `scatter_of_decays_is_not_a_preferential_direction_and_ten_per_cent_of_friction_is`.
/// Rows that are closer are taken together for the measured friction, s.
pub const BLOCK: f64 = 0.01;
/// Blocks of the shortest recording.
pub const FEWEST_BLOCKS: usize = 100;
/// Power of the rate's changes over that of the gyro's noise, below which the hub does not move.
pub const MOVING_POWER: f64 = 2.0;
/// Intervals of the rate over which the measured friction is averaged, and the fewest rows of one.
pub const FRICTION_BINS: (usize, usize) = (160, 3);
/// A rate nearer to zero than this many standard deviations of its noise may be that of a hub that sticks.
pub const STILL: f64 = 4.0;
/// Torque below which nothing drives the hub, over the largest torque.
pub const FREE_TORQUE: f64 = 1e-3;
/// Speeds of free decay: above this part of the fastest, or the sign is not sure.
pub const MOVING_SPEED: f64 = 0.05;
/// Points of a curve.
pub const FRICTION_POINTS: usize = 400;
/// Speeds of the second chart over the Stribeck speed.
pub const SLOW_CHART: f64 = 4.0;
