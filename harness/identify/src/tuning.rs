//! Tuning constants besides those of the engine, by the file that uses them, with tests that depend on them.
//!
//! A length without a unit is a ratio. "Deviations" are standard deviations of noise, and sums of squares are in its variances.
//! Coefficients of formulas, orders of tables and names stay with their code.

// Signals on clocks of their own: `input/clocks.rs`.
// Tests: `readings_of_a_slow_gyro_are_interpolated_and_measured_rows_are_marked`, `a_band_limited_torque_of_10_hz_is_known_between_its_samples`.
/// Time between the instants of a band-limited torque that lines join, s: over much longer times lines add images of its spectrum.
pub const FINE_TORQUE: f64 = 0.02;
/// Largest deviation of a row's time from an even grid, over the usual time between rows, at which
/// the rows still count as even.
pub const UNEVEN: f64 = 0.02;
/// Half the length of the kernel that interpolates a coarsely sampled torque, in samples of the
/// torque.
pub const KERNEL_HALF: isize = 24;

// Gaps of the torque: `input/gaps.rs`.
// Tests: `lost_samples_of_a_sweep_are_predicted`, `lost_rows_of_a_sweep_are_interpolated_and_lost_rows_of_noise_split_the_recording`.
/// Ratio of the spacing of two samples to the usual spacing above which samples between them must have been lost.
pub const LOST_SPACING: f64 = 1.75;
/// Longest gap of the torque that is filled by prediction, s.
pub const LONGEST_FILLED: f64 = 3.0;
/// Longest gap of the torque, s, that is bridged by a straight line if the recording cannot be cut
/// there.
pub const LONGEST_LINE: f64 = 0.25;
/// Order of the autoregressive model that predicts the torque in a gap. It is fitted to eight times
/// as many samples on each side of the gap.
pub const GAP_ORDER: usize = 32;
/// Number of places with known torque at which the filling of a gap is tried to learn its error.
pub const GAP_TRIALS: usize = 12;
/// Largest change of the hub's rate that the errors of all filled gaps may cause, over the gyro's
/// noise.
pub const GAP_KICK: f64 = 0.1;
/// Largest number of gaps at which a recording is cut; with more gaps the parts would be too short.
pub const FEW_GAPS: usize = 5;

// Plausibility of a recording: `input/plausible.rs`.
// Tests: `a_wheel_that_gives_its_torque_shows_its_inertia_and_one_that_does_not_is_doubted`.
/// Length of the windows, s, in which the change of the wheel's speed is compared with the torque.
pub const WHEEL_WINDOW: f64 = 0.1;

// Reading: `input/reading.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`, `twenty_spikes_are_reported_and_left_out`.
/// Time after the beginning of a part that is already moving in which no sensor is fitted, s: a sensor that is late shows
/// what happened before the part's first torque.
pub const LATE_SENSOR: f64 = 0.1;
/// Largest number of rows of a free decay. The limit is needed because the spectrum of the residual
/// takes 400 sines for each row.
pub const DECAY_ROWS: usize = 1_000_000;
/// Ratio of the spread of the rate to its noise above which the hub is moving; the drift of a gyro
/// makes a smaller ratio.
pub const MOVING_SPREAD: f64 = 2.0;

// Recordings of any FMU: `input/record.rs`.
// Tests: `any_fmu_refuses_records_out_of_range`.
/// Smallest number of values of an output from which anything is estimated.
pub const FEWEST_VALUES: usize = 10;

// Recordings of the bench: `input/recording.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`, `a_gyro_slower_than_the_rows_is_seen_by_its_repeats`, `no_method_hangs_or_panics_on_values_out_of_range`.
/// Shortest recording, s: it has some fifty periods of a slosh at 2.4 Hz.
pub const SHORTEST_RECORDING: f64 = 20.0;
/// A recording that is long for its slosh, s. A bare tank's slosh decays within some 23 s (1/(ζω) of the thesis's tank); its
/// half-power width of 14 mHz is resolved by 1/14 mHz = 70 s. A shorter recording says less of damping and mass, so that their
/// intervals are wide.
pub const LONG_RECORDING: f64 = 120.0;
/// Largest share of rows with a new value of the gyro at which the gyro counts as slower than the recording. Noise makes
/// a gyro that is as fast as the recording change in nearly every row.
pub const SLOW_GYRO: f64 = 0.75;
/// Largest value of a signal that is accepted; the sum of its squares over all rows is finite.
pub const LARGEST_VALUE: f64 = 1e100;
/// If at least this fraction of the changes of a gyro signal falls on the rows of a slower clock, the gyro counts as
/// held with this clock.
pub const ON_CLOCK: f64 = 0.98;
/// Slowest gyro that is detected: the number of rows for each of its values.
pub const SLOWEST_GYRO: usize = 100;

// Sensor faults: `input/sensor_faults.rs`.
// Tests: `each_fault_is_named`, `a_sound_gyro_has_no_faults`, `a_hub_at_rest_is_no_fault`, `clipping_at_one_end_of_the_range_is_also_assumed_at_the_other_end`.
/// Smallest number of equal values at an end of the sensor's range that count as clipped, and the
/// smallest ratio of their number to the number of equal values just inside the range.
pub const CLIPPED: (usize, f64) = (20, 4.0);
/// Width of the zone just inside an end of the sensor's range, over the sensor's noise.
pub const CLIPPED_INSIDE: f64 = 3.0;
/// Least step, in units of the sensor's resolution, with which values come back from both ends of the range if the sensor is
/// clipped at both.
pub const FAULT_STEPS: f64 = 2.0;
/// Largest probability that a run of equal values is chance at which the sensor counts as frozen.
pub const FROZEN_CHANCE: f64 = 1e-6;
/// Smallest number of equal values in a row at which the sensor may count as frozen.
pub const FROZEN_RUN: usize = 5;
/// Fewest repeats that are reported, and the least ratio of their mean square deviation from the neighbours to the mean square
/// deviation of other values.
pub const REPEATS: (usize, f64) = (10, 3.0);
/// Largest rounding error of a sensor's value, over its largest value.
pub const SENSOR_ROUNDING: f64 = 1e-9;

// Spikes: `input/spikes.rs`.
// Tests: `single_and_adjacent_spikes_are_found_and_noise_is_not_a_spike`, `more_than_one_value_in_a_hundred_is_no_spike`, `a_step_of_the_torque_makes_no_spike`.
/// Largest fraction of the values that is left out as spikes. If more values are off, they are
/// noise of another kind, and none is left out.
pub const SPIKE_SHARE: f64 = 0.01;
/// Number of rows on either side of a step of the torque in which a value that is off its
/// neighbours may be a motion of the hub instead of a spike.
pub const SPIKE_NEAR_STEP: usize = 3;
/// Change of the torque from one row to the next, relative to its peak, that counts as a step.
pub const TORQUE_STEP: f64 = 0.5;
/// Number of rows on each side whose median is the usual size of r around a row.
pub const SPIKE_AROUND: usize = 50;

// Tolerances: `input/tolerance.rs`.
// Tests: `a_torque_that_is_wrong_within_its_tolerance_leaves_the_truth_in_the_intervals`.
/// Share of a known value's tolerance in the variance of an estimate above which the verdict names
/// the tolerance.
pub const TOLD_SHARE: f64 = 0.2;

// Unknowns of any FMU: `model/unknown.rs`.
// Tests: `known_values_count_with_their_tolerances`.
/// Plausible distance of a scale's error from 0 if neither bounds nor a prior state it.
pub const SCALE_REACH: f64 = 0.1;
/// Plausible distance of a known value from its mean, standard deviations. It is large so that the effect of a difference exceeds
/// the solver's errors.
pub const KNOWN_REACH: f64 = 5.0;

// Runs of any FMU: `model/simulate.rs`.
// Tests: `the_hosts_solver_and_the_fmus_give_the_same_estimates`, `a_smooth_input_is_followed_by_an_fmu_that_cannot_interpolate`.
/// Largest number of steps of the host's solver from one row to the next in a run that is only compared with a run of the FMU's
/// own solver.
pub const COMPARED_STEPS: usize = 1000;
/// Tolerance of the solver with which the FMU's own solver is compared, if the FMU suggests none.
pub const COMPARED_TOLERANCE: f64 = 1e-8;
/// Ratio of the tolerance in the compared run to the tolerance that is used or that the FMU suggests.
pub const COMPARED_FACTOR: f64 = 1e-2;
/// Parts of the way from row to row over which an input that follows a line is held, where the FMU takes no slopes. Held at
/// the middle of each part, it differs from its line by a sawtooth of an eighth of its change from row to row, without a delay.
pub const HELD_STEPS: usize = 4;
/// Lengths of steps, s, over which the effect of an input's slope on the outputs is tested.
pub const SLOPE_PROBES: [f64; 3] = [1e-2, 1e-3, 1e-4];

// Effects outside the FMU: `bench/effect.rs`.
// Tests: `lags_of_a_sine_equal_those_of_its_frequency_response`.
/// Fewest and most parts into which the way from knot to knot is divided. At 2.4 Hz and 50 knots a second, lines between the
/// points of a lagged torque then act like its curve to 1e-3.
pub const LAG_PARTS: (f64, f64) = (3.0, 8.0);

// The bench as it is set up: `bench/nominal.rs`.
// Tests: `each_fault_has_a_sentence_of_its_own`.
/// Coarsest mean time between rows of any bench on the ground, s: slosh at 2.4 Hz needs more than two rows a period.
pub const COARSEST: f64 = 0.2;

// Runs of the bench: `bench/simulate.rs`.
// Tests: `the_fit_simulates_a_twin_with_a_delay_or_a_smooth_torque`, `a_run_that_would_not_end_is_refused`.
/// Two instants closer than this, s, count as the same.
pub const SAME_INSTANT: f64 = 1e-9;
/// Most internal steps of our FMUs in a communication step: the first number, plus the second number for each second of the step.
/// A fit's runs take some 100 steps a second. If a search tries values that would take millions, the run fails and the search
/// tries other values.
pub const MOST_INTERNAL_STEPS: (f64, f64) = (200.0, 2e4);

// Starts from data: `bench/start.rs`.
// Tests: `poles_and_zeros_of_the_exact_response_give_the_bench_back`.
/// Damping ratios of slosh that are tried when the slosh mode is searched from the balance of
/// torques.
pub const DAMPINGS: [f64; 5] = [0.0015, 0.003, 0.006, 0.015, 0.04];
/// Ratio of the step between tried slosh frequencies to the frequency. The half-power width at the
/// smallest tried damping is three times as much.
pub const FREQUENCY_FINENESS: f64 = 1e-3;

// Design of experiments: `bench/design.rs`.
// Tests: `d_optimal_power_is_near_the_slosh_frequency_and_reduces_uncertainty`, `a_multisine_has_only_odd_lines_and_the_given_peak`.
/// Number of odd lines of a multisine in a group, of which one line is left out for detecting
/// distortion.
pub const LINE_GROUP: usize = 4;
/// Share of the power that is always spread over all lines. It excites the resonance of a slightly different plant, and shows
/// distortion everywhere.
pub const SPREAD_POWER: f64 = 0.25;
/// Number of halvings in the search for the largest torque that keeps the slosh angle within its
/// limit.
pub const ANGLE_ROUNDS: usize = 12;

// Verdict: `bench/verdict.rs`.
// Tests: `a_search_that_would_leave_a_parameters_range_ends_at_the_bound_with_a_result`.
/// Newton decrement, in standard deviations, above which the verdict says that the search ended
/// before the minimum.
pub const TOLD_DECREMENT: f64 = 0.1;

// Page: `words/page.rs`.
// Tests: `the_report_of_a_fit_is_a_complete_page`.
/// Number of points of a curve on a page; more points than a screen has pixels cannot be seen.
pub const PAGE_POINTS: usize = 700;

// Output error: `methods/output_error.rs`.
// Tests: `starts_forty_percent_off_lead_to_the_same_minimum_as_starts_from_the_data`, `no_model_fits_a_torque_that_is_clipped`.
/// Beginnings that are tried where no model fits the whole recording, as fractions of its rows.
pub const BEGINNINGS: [f64; 2] = [0.35, 0.5];

// Friction runs: `methods/friction.rs`.
// Tests: `friction_of_three_sets_of_runs_ends_in_no_false_minimum`, `recordings_that_show_no_friction_are_refused_with_what_to_do`, `scatter_of_decays_is_not_a_preferential_direction_and_ten_per_cent_of_friction_is`.
/// Length of the blocks of rows that are averaged for the measured friction, s.
pub const BLOCK: f64 = 0.01;
/// Smallest number of blocks in the recording of a friction run.
pub const FEWEST_BLOCKS: usize = 100;
/// Number of intervals of the rate over which the measured friction is averaged, and the smallest
/// number of rows in an interval.
pub const FRICTION_BINS: (usize, usize) = (160, 3);
/// Torque, over the largest torque of the recording, up to which the hub counts as free of torque.
pub const FREE_TORQUE: f64 = 1e-3;
/// Smallest speed in a free decay that is used, over the largest; at smaller speeds noise makes the
/// sign of the rate uncertain.
pub const MOVING_SPEED: f64 = 0.05;
