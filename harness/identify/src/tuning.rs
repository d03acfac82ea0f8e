//! Tuning constants of the identification, grouped by the file that uses them. The constants of the engine are in
//! `engine/mod.rs`. Each group lists tests that depend on its constants.
//!
//! A constant without a unit is a ratio, unless its description gives another unit. "Standard deviations" are standard deviations
//! of the noise, and sums of squares are in units of the noise's variance. Coefficients of formulas, orders of tables and names
//! stay with their code.

// Signals on clocks of their own: `input/clocks.rs`.
// Tests: `readings_of_a_slow_gyro_are_interpolated_and_measured_rows_are_marked`, `a_band_limited_torque_of_10_hz_is_interpolated_accurately_between_its_samples`.
/// Spacing of the points of a band-limited torque, between which the torque is linear, s. A much larger spacing would add
/// images of its spectrum.
pub const FINE_TORQUE: f64 = 0.02;
/// Largest deviation of a row's time from an even grid, relative to the usual time between rows, at which the rows still
/// count as evenly spaced.
pub const UNEVEN: f64 = 0.02;
/// Half the length of the kernel that interpolates a coarsely sampled torque, in samples of the torque.
pub const KERNEL_HALF: isize = 24;

// Gaps of the torque: `input/gaps.rs`.
// Tests: `lost_samples_of_a_sweep_are_predicted_and_lost_samples_of_noise_are_not`, `lost_rows_of_a_sweep_are_interpolated_and_lost_rows_of_noise_split_the_recording`.
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
/// Number of places at which samples of known torque are predicted as if they were missing, to estimate the error of the
/// prediction.
pub const GAP_TRIALS: usize = 12;
/// Largest change of the hub's rate that the errors of all filled gaps may cause, relative to the gyro's noise.
pub const GAP_KICK: f64 = 0.1;
/// Largest number of gaps at which a recording is cut; with more gaps the parts would be too short.
pub const FEW_GAPS: usize = 5;

// Plausibility of a recording: `input/plausible.rs`.
// Tests: `a_wheel_that_does_not_give_the_commanded_torque_is_reported`.
/// Length of the windows, s, in which the change of the wheel's speed is compared with the torque.
pub const WHEEL_WINDOW: f64 = 0.1;

// Reading: `input/reading.rs`.
// Tests: `each_fault_of_a_recording_is_named_in_its_error`, `twenty_spikes_are_reported_and_left_out`.
/// If the hub already moves when a part of a recording begins, no sensor is fitted during this time, s: a delayed sensor
/// then shows motion that torque before the part has caused.
pub const LATE_SENSOR: f64 = 0.1;
/// Largest number of rows of a free decay. The limit is needed because the spectrum of the residual
/// takes 400 sines for each row.
pub const DECAY_ROWS: usize = 1_000_000;
/// Ratio of the rate's standard deviation to its noise above which the hub counts as moving; the drift of a gyro alone
/// makes a smaller ratio.
pub const MOVING_SPREAD: f64 = 2.0;

// Recordings of any FMU: `input/record.rs`.
// Tests: `any_fmu_refuses_records_out_of_range`.
/// Smallest number of measured values of an output that is enough for an estimate.
pub const FEWEST_VALUES: usize = 10;

// Recordings of the bench: `input/recording.rs`.
// Tests: `each_fault_of_a_recording_is_named_in_its_error`, `a_gyro_slower_than_the_rows_is_recognised_by_repeated_values`, `no_method_hangs_or_panics_on_values_out_of_range`.
/// Shortest recording that is accepted, s: about fifty periods of slosh at 2.4 Hz.
pub const SHORTEST_RECORDING: f64 = 20.0;
/// Length of a recording above which the verdict does not call it short, s. The half-power width of the slosh resonance of the
/// thesis's tank, 14 mHz, is resolved by 1/14 mHz = 70 s; its slosh decays within about 23 s (1/(ζω)). A shorter recording
/// contains less information about damping and mass, so that their intervals are wide.
pub const LONG_RECORDING: f64 = 120.0;
/// Largest fraction of rows with a new value of the gyro at which the gyro counts as slower than the recording. If a gyro is as
/// fast as the recording, its noise changes the value in nearly every row.
pub const SLOW_GYRO: f64 = 0.75;
/// Largest absolute value of a signal that is accepted. The sum of the squares over all rows then cannot overflow.
pub const LARGEST_VALUE: f64 = 1e100;
/// If at least this fraction of the changes of a gyro's value is in every n-th row of the recording, the gyro counts as
/// sampled n times more slowly than the recording.
pub const ON_CLOCK: f64 = 0.98;
/// Slowest gyro that is detected: the number of rows for each of its values.
pub const SLOWEST_GYRO: usize = 100;

// Sensor faults: `input/sensor_faults.rs`.
// Tests: `each_fault_of_a_sensor_is_reported`, `no_fault_is_found_in_a_sound_gyro`, `a_hub_at_rest_is_no_fault`, `clipping_at_one_end_of_the_range_is_also_assumed_at_the_other_end`.
/// Equal values at an end of the sensor's range are clipped if their number is at least the first number, and more than the
/// second number times the number that is expected from the values just inside the range.
pub const CLIPPED: (usize, f64) = (20, 4.0);
/// Width of the zone just inside an end of the sensor's range, relative to the sensor's noise.
pub const CLIPPED_INSIDE: f64 = 3.0;
/// A sensor is clipped at both ends of its range if the values next to both ends are more than this number of resolution
/// steps away from the ends.
pub const FAULT_STEPS: f64 = 2.0;
/// If a run of equal values has at most this probability of being chance, the sensor counts as frozen.
pub const FROZEN_CHANCE: f64 = 1e-6;
/// Smallest number of equal values in a row at which the sensor may count as frozen.
pub const FROZEN_RUN: usize = 5;
/// Repeated values are reported if their number is at least the first number, and if the mean square of their deviations
/// from the neighbouring values is more than the second number times the usual squared deviation.
pub const REPEATS: (usize, f64) = (10, 3.0);
/// Largest rounding error of a sensor's value, relative to its largest absolute value.
pub const SENSOR_ROUNDING: f64 = 1e-9;

// Spikes: `input/spikes.rs`.
// Tests: `single_and_adjacent_spikes_are_found_and_noise_is_not_a_spike`, `deviating_values_are_no_spikes_if_they_are_more_than_one_in_a_hundred`, `a_step_of_the_torque_makes_no_spike`.
/// Largest fraction of the values that is left out as spikes. If more values deviate from their neighbours, they are noise of
/// another kind, and none is left out.
pub const SPIKE_SHARE: f64 = 0.01;
/// Number of rows before and after a step of the torque in which a value that deviates from its neighbours may be a motion of the
/// hub instead of a spike.
pub const SPIKE_NEAR_STEP: usize = 3;
/// Change of the torque from one row to the next, relative to its peak, that counts as a step.
pub const TORQUE_STEP: f64 = 0.5;
/// Number of rows on each side of a row. The usual deviation at this row is the median of the deviations in these rows.
pub const SPIKE_AROUND: usize = 50;

// Tolerances: `input/tolerance.rs`.
// Tests: `intervals_contain_the_true_values_if_the_torque_is_wrong_within_its_tolerance`.
/// Share of a known value's tolerance in the variance of an estimate above which the verdict mentions the tolerance.
pub const REPORTED_SHARE: f64 = 0.2;

// Unknowns of any FMU: `model/unknown.rs`.
// Tests: `tolerances_of_known_values_widen_the_intervals`.
/// Plausible size of a scale error if neither bounds nor a prior state it.
pub const SCALE_REACH: f64 = 0.1;
/// Plausible distance of a known value from its mean, standard deviations. It is so large that the effect of a finite difference
/// exceeds the solver's errors.
pub const KNOWN_REACH: f64 = 5.0;

// Runs of any FMU: `model/simulate.rs`.
// Tests: `the_hosts_solver_and_the_fmus_give_the_same_estimates`, `a_smooth_input_is_followed_by_an_fmu_that_cannot_interpolate`.
/// Largest number of steps of the host's solver from one row to the next in a run that only checks the FMU's own solver.
pub const COMPARED_STEPS: usize = 1000;
/// Tolerance of the host's solver in runs that check the FMU's own solver, if the FMU suggests no tolerance.
pub const COMPARED_TOLERANCE: f64 = 1e-8;
/// Factor by which the tolerance is smaller in a run that checks the FMU's own solver. It multiplies the tolerance that is
/// set or, if none is set, the tolerance that the FMU suggests.
pub const COMPARED_FACTOR: f64 = 1e-2;
/// Number of steps from row to row in which a linear input is held constant if the FMU takes no slopes. The held value is the
/// value in the middle of a step: the input then differs from the line by a sawtooth of an eighth of the change from row to row,
/// and has no delay.
pub const HELD_STEPS: usize = 4;
/// Communication step sizes, s, with which the effect of an input's slope on the outputs is tested.
pub const SLOPE_PROBES: [f64; 3] = [1e-2, 1e-3, 1e-4];

// Effects outside the FMU: `bench/effect.rs`.
// Tests: `a_lag_changes_a_sine_as_its_frequency_response_predicts`.
/// Smallest and largest number of lines that replace the curve of a lagged torque from knot to knot. At 2.4 Hz and 50 knots a
/// second, the effect of the lines differs from the effect of the curve by at most 1e-3.
pub const LAG_PARTS: (f64, f64) = (3.0, 8.0);

// The bench as it is set up: `bench/nominal.rs`.
// Tests: `each_fault_of_a_recording_is_named_in_its_error`.
/// Largest mean time between rows of a recording from the ground, s: slosh at 2.4 Hz needs more than two rows a period.
pub const COARSEST: f64 = 0.2;

// Runs of the bench: `bench/simulate.rs`.
// Tests: `the_simulation_of_the_fit_reproduces_a_twin_with_a_delay_or_a_smooth_torque`, `a_simulation_that_would_take_too_long_is_refused`.
/// Two instants closer than this, s, count as the same.
pub const SAME_INSTANT: f64 = 1e-9;
/// Largest number of internal steps of our FMUs in a communication step: the first number, plus the second number for each second
/// of the step. A fit usually takes some 100 steps a second. If a search tries values that would take millions of steps, the run
/// fails, and the search tries other values.
pub const MOST_INTERNAL_STEPS: (f64, f64) = (200.0, 2e4);

// Starts from data: `bench/start.rs`.
// Tests: `the_bench_follows_from_poles_and_zeros_of_its_exact_response`.
/// Damping ratios that are tried for the slosh mode when the start of a search is computed from the torque balance.
pub const DAMPINGS: [f64; 5] = [0.0015, 0.003, 0.006, 0.015, 0.04];
/// Relative step between the slosh frequencies that are tried. The half-power width at the smallest damping of [`DAMPINGS`] is
/// three times as large.
pub const FREQUENCY_FINENESS: f64 = 1e-3;

// Design of experiments: `bench/design.rs`.
// Tests: `d_optimal_power_is_near_the_slosh_frequency_and_reduces_uncertainty`, `a_multisine_has_only_odd_lines_and_the_given_peak`.
/// Number of neighbouring odd lines of a multisine, of which one line is left out to detect distortion.
pub const LINE_GROUP: usize = 4;
/// Fraction of the power that is always spread evenly over all lines. It excites the resonance of a slightly different plant, and
/// makes distortion visible at all frequencies.
pub const SPREAD_POWER: f64 = 0.25;
/// Number of bisections in the search for the largest torque that keeps the slosh angle within its limit.
pub const ANGLE_ROUNDS: usize = 12;

// Page: `words/page.rs`.
// Tests: `the_report_of_a_fit_is_a_complete_page`.
/// Number of points of a curve on a page. More points than a screen has pixels cannot be seen.
pub const PAGE_POINTS: usize = 700;

// Output error: `methods/output_error.rs`.
// Tests: `starts_forty_percent_off_lead_to_the_same_minimum_as_starts_from_the_data`, `no_model_fits_a_torque_that_is_clipped`.
/// Fractions of a recording, from its beginning, that are fitted if no model fits the whole recording.
pub const BEGINNINGS: [f64; 2] = [0.35, 0.5];

// Friction runs: `methods/friction.rs`.
// Tests: `friction_fits_of_three_sets_of_runs_end_in_no_false_minimum`, `recordings_that_show_no_friction_are_refused_with_advice`, `friction_that_depends_on_angle_and_direction_is_distinguished_from_noise`.
/// Length of the blocks of rows that are averaged for the measured friction, s.
pub const BLOCK: f64 = 0.01;
/// Smallest number of blocks in the recording of a friction run.
pub const FEWEST_BLOCKS: usize = 100;
/// Number of intervals of the rate over which the measured friction is averaged, and the smallest
/// number of rows in an interval.
pub const FRICTION_BINS: (usize, usize) = (160, 3);
/// Largest torque, relative to the largest torque of the recording, at which the hub counts as free of torque.
pub const FREE_TORQUE: f64 = 1e-3;
/// Smallest speed in a free decay that is used, relative to the largest speed. At smaller speeds noise makes the sign
/// of the rate uncertain.
pub const MOVING_SPEED: f64 = 0.05;
