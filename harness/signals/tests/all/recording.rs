//! Recordings in every format that loggers write give the same values, and the error for a faulty recording names the
//! line and the column.

use std::path::{Path, PathBuf};

use signals::recording::{Between, Columns, Signal, Wanted, even, read, read_here};
use signals::table::Table;

const fn signal(name: &'static str, required: bool) -> Signal<'static> {
    Signal { name, required, between: Between::Held, unit: None }
}

/// Signals of the tests. The rows of a recording are the rows with a rate; the torque is held, and the angle is
/// interpolated linearly.
const SIGNALS: [Signal; 3] = [
    signal("omega", true),
    signal("tau_cmd", true),
    Signal { name: "theta", required: false, between: Between::Line, unit: None },
];

fn columns(text: &str) -> Columns {
    text.parse().unwrap()
}

fn read_file(path: &Path, columns: &Columns) -> Result<(Table, String), String> {
    let mut said = String::new();
    let table = read(path, &Wanted { signals: &SIGNALS, columns }, &mut |line| {
        said += &line;
        said += "\n";
    });
    table.map(|table| (table, said)).map_err(|error| format!("{error:#}"))
}

pub fn read_text(ending: &str, text: &[u8], of: &str) -> Result<(Table, String), String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(format!("a.{ending}"));
    std::fs::write(&path, text).unwrap();
    read_file(&path, &columns(of))
}

pub fn column<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    table.column(name).unwrap()
}

pub fn assert_close(found: &[f64], expected: &[f64], of: &str) {
    assert_eq!(found.len(), expected.len(), "{of}: {found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() <= 4e-16 * expected.abs().max(1e-3),
            "{of}: {found} {expected}"
        );
    }
}

const TIME: [f64; 3] = [0.0, 0.02, 0.04];
const TORQUE: [f64; 3] = [0.1, 0.25, -0.3];
const RATE: [f64; 3] = [0.0, std::f64::consts::PI / 180.0, -1.5 * std::f64::consts::PI / 180.0];

/// A table that contains only times is the schedule of an FMU without inputs.
#[test]
fn a_table_with_only_times_is_read() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    for text in ["time\n0\n0.02\n0.04\n", "time [s]\n0\n20e-3\n0.04", "\"time\"\n0\n0.02\n0.04\n"] {
        std::fs::write(&path, text).unwrap();
        let wanted = Wanted { signals: &[], columns: &columns("") };
        let mut said = Vec::new();
        let table = read(&path, &wanted, &mut |line| said.push(line)).unwrap();
        assert_eq!(column(&table, "time"), TIME, "{text}");
        assert!(said.iter().all(|line| !line.contains("separated")), "{said:?}");
    }
    let error = read_text("csv", b"time\n0\n0.02\n", "").unwrap_err();
    assert!(error.contains("no column omega") && error.contains("columns in it: time"), "{error}");
}

#[test]
fn a_recording_gives_equal_numbers_for_every_separator_decimal_mark_comment_and_unit() {
    let renamed = "time=t,tau_cmd=T_cmd,omega=gyro z";
    let given = "time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro z:deg/s";
    let cases: [(&str, &str, &str); 11] = [
        ("csv", "t,T_cmd,gyro z\n0,100,0\n20,250,1\n40,-300,-1.5\n", given),
        ("csv", "t;T_cmd;gyro z\r\n0;100;0\r\n20;250;1\r\n40;-300;-1,5\r\n", given),
        ("txt", "t\tT_cmd\tgyro z\n0\t100,0\t0,0\n20\t250,0\t1,0\n40\t-300,0\t-1,5\n", given),
        (
            "csv",
            "\"t\",\"T_cmd\",\"gyro z\"\n\"0\",\"100\",\"0\"\n\"20\",\"250\",\"1,0\"\n\"40\",\"-300\",\"-1,5\"",
            given,
        ),
        // units in a row, or in the names of columns
        ("csv", "t;T_cmd;gyro z\nms;mN·m;°/s\n0;100;0\n20;250;1\n40;-300;-1,5\n", renamed),
        ("csv", "t [ms],T_cmd (mN.m),gyro z [deg/s]\n0,100,0\n20,250,1\n40,-300,-1.5\n", renamed),
        (
            "csv",
            "# bench, 24 °C\n% again\nt [ms],T_cmd [mNm],gyro z [dps]\n// more\n0,100,0\n20,250,1\n# within\n\n40,-300,-1.5\n",
            renamed,
        ),
        // lines above the header, unused columns, a separator at the end of each line, and an incomplete last line
        (
            "csv",
            "Logger 3000\nSerial;17\nt;state;T_cmd;gyro z\nms;;mNm;deg/s\n0;0;100;0;\n20;0;250;1;\n40;1;-300;-1,5;\n60;1;3",
            renamed,
        ),
        // a header in a comment, as numpy writes it, and blanks between the columns
        (
            "dat",
            "# t T_cmd gyro\n0 100 0\n20 250 1\n  40  -300   -1.5\n",
            "time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro:deg/s",
        ),
        // a file without a header, whose columns are given by their numbers
        ("csv", "0,100,0\n20,250,1\n40,-300,-1.5\n", "time=#1:ms,tau_cmd=#2:mNm,omega=#3:deg/s"),
        // times that are dates with and without an offset from UTC
        (
            "csv",
            "t,T_cmd,gyro z\n2026-01-31T23:59:59.990Z,100,0\n2026-02-01T00:00:00.010Z,250,1\n2026-02-01T01:00:00.030+01:00,-300,-1.5\n",
            "time=t,tau_cmd=T_cmd:mNm,omega=gyro z:deg/s",
        ),
    ];
    for (ending, text, of) in &cases {
        let (table, said) = read_text(ending, text.as_bytes(), of).unwrap();
        assert_close(column(&table, "time"), &TIME, text);
        assert_close(column(&table, "tau_cmd"), &TORQUE, text);
        assert_close(column(&table, "omega"), &RATE, text);
        assert!(said.contains("columns used: time = "), "{said}");
    }
    let dates = read_text(cases[10].0, cases[10].1.as_bytes(), cases[10].2).unwrap().1;
    assert!(dates.contains("time counts from 2026-01-31T23:59:59.990+00:00"), "{dates}");
    let cut = read_text(cases[7].0, cases[7].1.as_bytes(), cases[7].2).unwrap().1;
    assert!(cut.contains("the last line, 8, is not complete and was left out"), "{cut}");
    assert!(cut.contains("line 4 was taken for a row of units"), "{cut}");
}

/// The file contains a torque at 10 Hz and a gyro at 50 Hz. The torque is held between its rows, and a row without a
/// rate is left out.
#[test]
fn a_slow_torque_is_held_and_lost_rows_are_left_out() {
    // the rows of the torque and of the gyro are separate; one rate is missing
    let mut text = String::from("time,tau_cmd,omega\n");
    for k in 0..=100 {
        let t = 0.02 * f64::from(k);
        if k % 5 == 0 {
            text += &format!("{},{},\n", t - 0.001, k);
        }
        text += &format!("{t},,{}\n", if k == 7 { "NaN".into() } else { format!("{k}") });
    }
    let (table, said) = read_text("csv", text.as_bytes(), "").unwrap();
    let (rate, torque) = (column(&table, "omega"), column(&table, "tau_cmd"));
    assert_eq!(rate.len(), 100);
    for (rate, torque) in rate.iter().zip(torque) {
        assert_eq!(*torque, (rate / 5.0).floor() * 5.0);
    }
    assert!(said.contains("22 of 122 rows have no omega and are left out"), "{said}");
    assert!(
        said.contains(
            "tau_cmd has a value in 21 of 122 rows, 0.1000 s apart; between these rows it is held"
        ),
        "{said}"
    );
    // on an even grid the missing rate is interpolated linearly
    let (step, grid) = even(table, &mut |_| {}).unwrap();
    assert!((step - 0.02).abs() < 1e-12 && grid.rows() == 101);
    assert!((column(&grid, "omega")[7] - 7.0).abs() < 1e-9);
}

#[test]
fn rows_in_which_the_torque_is_missing_for_long_are_left_out() {
    let mut text = String::from("time;tau_cmd;omega\n");
    for k in 0..300 {
        let torque = if (100..200).contains(&k) { String::new() } else { "0,5".into() };
        text += &format!("{};{torque};{k}\n", f64::from(k) * 20.0);
    }
    let (table, said) = read_text("csv", text.as_bytes(), "time=time:ms").unwrap();
    assert_eq!(table.rows(), 200);
    assert!(said.contains("100 rows in which tau_cmd is not known are left out"), "{said}");
    let error = even(table, &mut |_| {}).unwrap_err().to_string();
    assert!(
        error.contains("rows are missing for 2.0 of 6.0 s, in 1 gaps (allowed: 1 %)"),
        "{error}"
    );
}

fn stored(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/data")).join(name)
}

/// The files were written by several libraries (`data/make_parquet.py`).
#[test]
fn timestamps_of_a_parquet_file_become_seconds_since_the_first_row() {
    for name in ["ts_s", "ts_ms", "ts_us", "ts_ns", "pandas_ts", "polars_ts"] {
        let path = stored(&format!("{name}.parquet"));
        let step = if name == "ts_s" { 1.0 } else { 0.02 };
        let expected: Vec<f64> = (0..5).map(|k| f64::from(k) * step).collect();
        let (table, said) = read_file(&path, &columns("")).unwrap();
        assert_close(column(&table, "time"), &expected, name);
        assert_close(column(&table, "omega"), &[0.0, 0.5, 1.0, 1.5, 2.0], name);
        let origin = if name.starts_with("polars") { "1970" } else { "2026-01-01T00:00:00+00:00" };
        assert!(said.contains(&format!("time counts from {origin}")), "{said}");
        // a stated unit must agree with the unit of the type
        let error = read_file(&path, &columns("time=time:min")).unwrap_err();
        assert!(error.contains("states another unit, 60 s"), "{name}: {error}");
        // the file is also read by the reader of tables that `hubslosh run` has written
        let table = Table::read(&path, &["time", "omega"]).unwrap();
        assert_close(column(&table, "time"), &expected, name);
    }
    let (table, _) = read_file(&stored("plain.parquet"), &columns("time=time:ns")).unwrap();
    assert_close(
        column(&table, "time"),
        &[0.0, 0.02, 0.04, 0.06, 0.08],
        "integers of a stated unit",
    );
}

#[test]
fn parquet_columns_of_rare_types_are_refused_with_advice_to_use_the_python_package() {
    let signals = ["omega", "tau_cmd"].map(|name| signal(name, true));
    for (name, of) in [
        ("plain", ""),
        ("dur_s", ""),
        ("polars_td", ""),
        ("int96", ""),
        ("time_half_dec", ""),
        ("ts_ns", "time=omega,omega=time"),
    ] {
        let path = stored(&format!("{name}.parquet"));
        let columns = columns(of);
        let wanted = Wanted { signals: &signals, columns: &columns };
        assert!(read_here(&path, &path, &wanted, &mut |_| {}).unwrap().is_none(), "{name}");
    }
    let error = format!("{:#}", Table::read(&stored("dur_ms.parquet"), &["time"]).unwrap_err());
    assert!(error.contains("column time holds INT64 (allowed: timestamps, floating"), "{error}");
}

/// The unit of the column "t [ms]" is not applied to its dates, but the unit of the column "T [mNm]" is.
#[test]
fn the_unit_in_the_name_of_the_time_column_is_not_applied_to_other_columns() {
    // dates need no unit; the factor milli of the torque must not be lost, although the time has the same factor
    let text =
        "t [ms],T [mNm],omega\n2026-01-31T12:00:00.000Z,100,0\n2026-01-31T12:00:00.020Z,250,1\n";
    let (table, _) = read_text("csv", text.as_bytes(), "time=t,tau_cmd=T").unwrap();
    assert_close(column(&table, "tau_cmd"), &[0.1, 0.25], "torque");
}

#[test]
fn a_damaged_parquet_file_is_an_error_and_never_a_panic() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("damaged.parquet");
    let mut dice = fastrand::Rng::with_seed(1);
    for name in ["dur_ns.parquet", "polars_td.parquet", "time_half_dec.parquet"] {
        let whole = std::fs::read(stored(name)).unwrap();
        for _ in 0..100 {
            let mut bytes = whole.clone();
            for _ in 0..dice.usize(1..4) {
                let at = dice.usize(..bytes.len());
                bytes[at] = dice.u8(..);
            }
            std::fs::write(&path, bytes).unwrap();
            let wanted = Wanted { signals: &SIGNALS, columns: &Columns::default() };
            if let Err(error) = read_here(&path, &path, &wanted, &mut |_| {}) {
                assert!(error.to_string().contains("damaged.parquet"), "{error}");
            }
            drop(Table::read(&path, &["time", "omega"]));
        }
    }
}

#[test]
fn errors_in_a_recording_state_line_column_and_allowed_values() {
    let error = |text: &str, of: &str| read_text("csv", text.as_bytes(), of).unwrap_err();
    let cases = [
        (
            "time,tau_cmd,omega\n0,0,0\n1,x,0\n2,0,1e999\n",
            "",
            "line 3, column tau_cmd: \"x\" is not a number; line 4, column omega: \"1e999\" is not a number (allowed: finite numbers",
        ),
        (
            "time,tau_cmd,omega\n0,0,0\n1,0\n2,0,0\n",
            "",
            "line 3: 2 fields, where the others have 3",
        ),
        (
            "t,tau_cmd,omega\n0,0,0\n1,0,0\n",
            "",
            "no column time (columns in it: t, tau_cmd, omega; --columns",
        ),
        ("time,tau_cmd,omega\n0,0,0\n", "omega=w:deg/s,theta=a", "no column w; no column a"),
        (
            "time,tau_cmd,omega [V]\n0,0,0\n",
            "",
            "column omega: \"V\" is not a unit of a rate (allowed: rad/s, mrad/s,",
        ),
        (
            "time,tau_cmd,omega\n0,0,0\n",
            "force=omega",
            "--columns force is of no use here (allowed: time, omega, tau_cmd, theta)",
        ),
        ("time,omega,tau_cmd,omega\n0,0,0,0\n", "", "more than one column omega (#2 and others)"),
        ("time,tau_cmd,omega\n,0,0\n0.1,0,0\n", "", "row 1 of the values has no time"),
        (
            "time,tau_cmd,omega\n0,0,\n0.1,0,3\n",
            "",
            "omega has values in 1 rows (allowed: at least 2)",
        ),
        ("time,tau_cmd,omega\n0,02,0,1,0,3\n", "", "decimal commas need another separator"),
        ("nothing here\n", "", "line 1, \"nothing here\", is not a row of numbers"),
        ("", "", "the file is empty"),
        ("a\0b\n", "", "the file is neither text in columns nor Parquet"),
    ];
    for (text, of, words) in cases {
        let error = error(text, of);
        assert!(
            error.contains(words) && error.contains("a.csv cannot be used"),
            "{words}:\n{error}"
        );
    }
    let many: String = (0..9).map(|k| format!("{k},0,x\n")).collect();
    let error = error(&format!("time,tau_cmd,omega\n0,0,0\n{many}"), "");
    assert!(error.contains("; and 4 more (allowed"), "{error}");
}

/// An earlier version refused each of these files or read wrong values.
#[test]
fn files_of_loggers_and_spreadsheets_are_read_with_the_values_that_were_written() {
    let renamed = "time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro z:deg/s";
    let cases: [(&str, &str); 4] = [
        // rosbag exports and flight logs: a column of text and a column of Booleans
        (
            "t,state,armed,T_cmd,gyro z\n0,idle,false,100,0\n20,\"sweep, up\",true,250,1\n40,sweep,true,-300,-1.5\n",
            renamed,
        ),
        // a column of events, which has values in a few rows, the first row among them
        ("t,event,T_cmd,gyro z\n0,start,100,0\n20,,250,1\n40,,-300,-1.5\n", renamed),
        // a file that Excel writes in a country with decimal commas, and with a typographic minus
        (
            "\u{feff}sep=;\nt;T_cmd;gyro z\n0,0;100;0\n20,0;250;1\n40,0;\u{2212}300;\u{2212}1,5\n",
            renamed,
        ),
        // decimal commas in all columns, and a 1 in the row of units
        (
            "t;T_cmd;ok;gyro z\nms;mNm;1;deg/s\n0;100;1;0\n20;250;1;1\n40;-300;1;-1,5\n",
            "time=t,tau_cmd=T_cmd,omega=gyro z",
        ),
    ];
    for (text, of) in cases {
        let (table, _) =
            read_text("csv", text.as_bytes(), of).unwrap_or_else(|e| panic!("{text}\n{e}"));
        assert_close(column(&table, "time"), &TIME, text);
        assert_close(column(&table, "tau_cmd"), &TORQUE, text);
        assert_close(column(&table, "omega"), &RATE, text);
    }
    let said = read_text("csv", cases[0].0.as_bytes(), renamed).unwrap().1;
    assert!(said.contains("columns of text are skipped: state, armed"), "{said}");
}

#[test]
fn recordings_with_clock_times_or_dates_in_many_notations_are_read() {
    let rows = |stamps: [&str; 3]| stamps.map(|stamp| format!("{stamp};0,1;2\n")).concat();
    let cases = [
        // clock times that pass midnight
        ["23:59:59.990", "00:00:00.010", "0:00:00.03"],
        ["23:59:59,990", "24:00:00,010", "24:00:00,030"],
        [
            "2026-01-31 23:59:59.990+00:00",
            "2026-02-01 00:00:00.010+00:00",
            "2026-02-01 00:00:00.030+00:00",
        ],
        ["2026-01-31 23:59:59,990", "2026-02-01 00:00:00,010", "2026-02-01 00:00:00,030"],
        ["31.01.2026 23:59:59,990", "01.02.2026 00:00:00,010", "1.2.2026 00:00:00,030"],
        ["2026/01/31 23:59:59.99", "2026/02/01 00:00:00.01", "2026/02/01 00:00:00.03"],
    ];
    for (k, stamps) in cases.into_iter().enumerate() {
        let text = format!("time;tau_cmd;omega\n{}", rows(stamps));
        let found = read_text("csv", text.as_bytes(), "");
        if k == 1 {
            // a time of day has no hour 24
            let error = found.unwrap_err();
            assert!(
                error.contains(
                    "line 3, column time: \"24:00:00,010\" is no time of day (allowed: hours"
                ),
                "{error}"
            );
            continue;
        }
        let (table, said) = found.unwrap();
        assert_close(column(&table, "time"), &TIME, stamps[0]);
        assert!(said.contains("time counts from "), "{said}");
    }
}

#[test]
fn a_field_that_can_be_read_in_two_ways_is_refused_with_its_line() {
    let cases = [
        (
            "time,tau_cmd,omega\n0,0,0\n\"1,234\",0,0\n",
            "line 3, column time: \"1,234\" may be 1234 or 1.234 (allowed: numbers without separators of thousands",
        ),
        (
            "time;tau_cmd;omega\n0,5;0;0\n1.234;0;0\n",
            "line 3, column time: \"1.234\" is read with a decimal point, the lines above with a decimal comma",
        ),
        (
            "time;tau_cmd;omega\n0.5;0;0\n0,75;0;0\n",
            "line 3, column time: \"0,75\" is read with a decimal comma, the lines above with a decimal point",
        ),
        // the error names the first faulty line, and not the last line that was examined
        (
            "time,tau_cmd,omega\n0,0,true\n1,0,true\n2,0,false\n",
            "line 2, column omega: \"true\" is not a number; line 3",
        ),
        ("a,b\nidle,x\nbusy,y\n", "line 2, \"idle,x\", is not a row of numbers"),
    ];
    for (text, words) in cases {
        let error = read_text("csv", text.as_bytes(), "").unwrap_err();
        assert!(error.contains(words), "{words}:\n{error}");
    }
}

#[test]
fn a_file_without_times_is_read_only_with_a_stated_rate() {
    let text = "tau_cmd,omega\n0.1,0\n0.25,1\n-0.3,2\n";
    let error = read_text("csv", text.as_bytes(), "").unwrap_err();
    assert!(
        error.contains("; --columns rate=HZ, or --rate HZ of the command gyro, reads equally"),
        "{error}"
    );
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    std::fs::write(&path, text).unwrap();
    let at_50_hz = Columns::default().with_rate(Some(50.0)).unwrap();
    let (table, said) = read_file(&path, &at_50_hz).unwrap();
    assert_close(column(&table, "time"), &TIME, text);
    assert_close(column(&table, "tau_cmd"), &TORQUE, text);
    assert!(said.contains("its rows are taken as 50 per second (--rate)"), "{said}");
    assert!(Columns::default().with_rate(Some(0.0)).is_err());
    // a rate replaces the time column, unless --columns asks for this column
    std::fs::write(&path, format!("time,{text}").replace('\n', "\n7,")).unwrap();
    let (table, said) = read_file(&path, &at_50_hz).unwrap();
    assert_close(column(&table, "time"), &TIME, text);
    assert!(said.contains("the column time is not read, because"), "{said}");
    let both = columns("time=time:ms").with_rate(Some(50.0)).unwrap();
    let error = read_file(&path, &both).unwrap_err();
    assert!(
        error.contains(
            "(50 Hz) and a column of times (time, from --columns) are given (allowed: one"
        ),
        "{error}"
    );
    let of = columns("tau_cmd=omega").with_rate(Some(50.0)).unwrap();
    let (_, said) = read_file(&stored("dur_ns.parquet"), &of).unwrap();
    assert!(said.contains("the column time is not read"), "{said}");
}

#[test]
fn columns_of_seconds_and_nanoseconds_form_one_time() {
    let rows = "0,0,0\n0,20000000,1\n0,40000000,2\n";
    for (head, of) in [
        ("sec,nanosec,omega", "tau_cmd=omega"),
        ("header.stamp.secs,header.stamp.nsecs,omega", "tau_cmd=omega"),
        ("tv_sec,tv_nsec,omega", "time=tv_sec,tau_cmd=omega"),
        ("tv_sec,tv_nsec,omega", "time=tv_nsec,tau_cmd=omega"),
    ] {
        let (table, said) = read_text("csv", format!("{head}\n{rows}").as_bytes(), of).unwrap();
        assert_close(column(&table, "time"), &TIME, head);
        assert!(said.contains("the times are the columns"), "{said}");
    }
    // two columns, each of which contains the full time
    let rows = "1.00,1000000000,0\n1.02,1020000000,1\n1.04,1040000000,2\n";
    for time in ["t_s", "t_ns"] {
        let text = format!("t_s,t_ns,omega\n{rows}");
        let of = format!("time={time},tau_cmd=omega");
        let (table, said) = read_text("csv", text.as_bytes(), &of).unwrap();
        let off = |(t, expected): (&f64, f64)| (t - 1.0 - expected).abs() < 1e-12;
        assert!(column(&table, "time").iter().zip(TIME).all(off), "{time}: {table:?}");
        assert!(!said.contains("the times are the columns"), "{said}");
    }
}

#[test]
fn times_printed_to_milliseconds_are_restored_to_the_even_grid_of_33_hz() {
    let rows: String = (0..400).map(|k| format!("{:.3},0,{k}\n", f64::from(k) / 33.0)).collect();
    let (table, said) =
        read_text("csv", format!("time,tau_cmd,omega\n{rows}").as_bytes(), "").unwrap();
    let time = column(&table, "time");
    let worst = (0..400).map(|k| (time[k] - time[0] - k as f64 / 33.0).abs()).fold(0.0, f64::max);
    assert!(worst < 2e-5, "{worst:e}");
    assert!(said.contains("the times are rounded to 1 ms: rows 30.303"), "{said}");
}

fn write_parquet(path: &Path, names: [&str; 3], codec: parquet::basic::Compression) {
    use parquet::{basic, data_type, file, schema::types::Type};
    let field = |name: &str| {
        let of = Type::primitive_type_builder(name, basic::Type::DOUBLE);
        std::sync::Arc::new(of.with_repetition(basic::Repetition::REQUIRED).build().unwrap())
    };
    let schema = Type::group_type_builder("schema").with_fields(names.map(field).to_vec()).build();
    let properties = file::properties::WriterProperties::builder().set_compression(codec).build();
    let mut writer = file::writer::SerializedFileWriter::new(
        std::fs::File::create(path).unwrap(),
        std::sync::Arc::new(schema.unwrap()),
        std::sync::Arc::new(properties),
    )
    .unwrap();
    let mut group = writer.next_row_group().unwrap();
    for values in [TIME, TORQUE.map(|t| 1e3 * t), RATE] {
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<data_type::DoubleType>().write_batch(&values, None, None).unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
}

#[test]
fn parquet_files_of_common_codecs_with_units_in_their_names_are_read() {
    use parquet::basic::Compression;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.parquet");
    let codecs = [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        Compression::GZIP(Default::default()),
        Compression::LZ4,
        Compression::LZ4_RAW,
        Compression::ZSTD(Default::default()),
    ];
    for codec in codecs {
        write_parquet(&path, ["time (s)", "tau cmd [mN.m]", "omega"], codec);
        // a column may be named with or without its unit
        for of in ["time=time (s),tau_cmd=tau cmd [mN.m]", "tau_cmd=tau cmd"] {
            let (table, _) = read_file(&path, &columns(of)).unwrap();
            assert_close(column(&table, "time"), &TIME, of);
            assert_close(column(&table, "tau_cmd"), &TORQUE, of);
        }
    }
}
