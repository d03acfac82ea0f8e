//! Files in the formats of laboratory tools, with 40 rows of the same recording: each is read with the correct values, or
//! refused with its line and a message that helps.

use std::fmt::Write as _;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{PrimitiveTypeBuilder, Type};

use super::recording::{assert_close, column, read_text};

const ROWS: usize = 40;
const BEGIN: i64 = 1_769_860_800;

fn millis(k: usize) -> usize {
    20 * k
}

fn torque(k: usize) -> i64 {
    (37 * k % 200) as i64 - 100
}

/// Returns the rate in row `k` of the test recording, in tenths of a degree per second.
fn tenths(k: usize) -> i64 {
    (13 * k % 50) as i64 - 25
}

fn rate(k: usize) -> String {
    format!(
        "{}{}.{}",
        if tenths(k) < 0 { "-" } else { "" },
        tenths(k).abs() / 10,
        tenths(k).abs() % 10
    )
}

fn seconds(k: usize) -> String {
    format!("{}.{:03}", millis(k) / 1000, millis(k) % 1000)
}

fn clock(k: usize) -> String {
    format!("12:00:0{}.{:03}", millis(k) / 1000, millis(k) % 1000)
}

fn lines(head: &str, line: impl Fn(usize) -> String) -> Vec<u8> {
    let mut text = String::from(head);
    for k in 0..ROWS {
        let _ = writeln!(text, "{}", line(k));
    }
    text.into_bytes()
}

fn commas(text: &str) -> String {
    text.replace('.', ",")
}

fn crlf(text: &[u8]) -> Vec<u8> {
    String::from_utf8_lossy(text).replace('\n', "\r\n").into_bytes()
}

fn of(time: &str, tau: &str, omega: &str) -> String {
    format!("time={time},tau_cmd={tau},omega={omega}")
}

fn parquet(time: &str, timestamps: bool) -> Vec<u8> {
    fn real(name: &str) -> PrimitiveTypeBuilder<'_> {
        Type::primitive_type_builder(name, Physical::DOUBLE)
    }
    let first = match timestamps {
        true => Type::primitive_type_builder(time, Physical::INT64)
            .with_logical_type(Some(LogicalType::timestamp(true, TimeUnit::NANOS))),
        false => real(time),
    };
    let fields = [real("T_cmd"), real("gyro_z"), first];
    let fields = fields.map(|f| Arc::new(f.with_repetition(Repetition::OPTIONAL).build().unwrap()));
    let schema = Type::group_type_builder("schema").with_fields(fields.to_vec()).build().unwrap();
    let mut bytes = Vec::new();
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let there = [1_i16; ROWS];
    let reals: [&dyn Fn(usize) -> f64; 2] = [&|k| torque(k) as f64, &|k| tenths(k) as f64 / 10.0];
    for value in reals {
        let values: Vec<f64> = (0..ROWS).map(value).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&values, Some(&there), None).unwrap();
        column.close().unwrap();
    }
    let mut column = group.next_column().unwrap().unwrap();
    if timestamps {
        let at = |k: usize| BEGIN * 1_000_000_000 + millis(k) as i64 * 1_000_000;
        let values: Vec<i64> = (0..ROWS).map(at).collect();
        column.typed::<Int64Type>().write_batch(&values, Some(&there), None).unwrap();
    } else {
        let values: Vec<f64> = (0..ROWS).map(|k| millis(k) as f64 / 1e3).collect();
        column.typed::<DoubleType>().write_batch(&values, Some(&there), None).unwrap();
    }
    column.close().unwrap();
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

/// A file in the format of a tool: the tool's name, the file's ending and contents, the columns, and words of the error (`None`
/// if the file must be read).
type Case = (&'static str, &'static str, Vec<u8>, String, Option<&'static str>);

fn spreadsheets() -> Vec<Case> {
    let plain = of("t:ms", "T_cmd:mNm", "gyro z:deg/s");
    let german = lines("sep=;\nt;T_cmd;gyro z\n", |k| {
        format!("{};{};{}", millis(k), torque(k), commas(&rate(k)))
    });
    let minus = |text: &str| text.replace('-', "\u{2212}");
    let french = lines("t;T_cmd;gyro z\n", |k| {
        // torques in µN·m, with narrow blanks as separators of thousands
        let torque = format!("{}\u{202f}000", torque(k)).replace("0\u{202f}000", "0\u{202f}000");
        let torque = if torque.starts_with("0\u{202f}") { "0".into() } else { torque };
        format!("{};{};{}", millis(k), minus(&torque), minus(&commas(&rate(k))))
    });
    let utf_16: Vec<u8> = String::from_utf8(lines("\u{feff}t\tT_cmd\tgyro z\n", |k| {
        format!("{}\t{}\t{}", millis(k), torque(k), rate(k))
    }))
    .unwrap()
    .encode_utf16()
    .flat_map(u16::to_le_bytes)
    .collect();
    vec![
        (
            "Excel, Germany",
            "csv",
            crlf(&[b"\xef\xbb\xbf", &german[..]].concat()),
            plain.clone(),
            None,
        ),
        (
            "Excel, France",
            "csv",
            french,
            of("t:ms", "T_cmd:uNm", "gyro z:deg/s"),
            Some("line 2, column T_cmd: \"\u{2212}100\u{202f}000\" is not a number"),
        ),
        (
            "Excel, Unicode text",
            "txt",
            utf_16,
            plain.clone(),
            Some("the file is in UTF-16; save it as UTF-8"),
        ),
        (
            "Excel, #N/A and #DIV/0! in a column that is not used",
            "csv",
            lines("t,T_cmd,gyro z,ratio\n", |k| {
                let ratio = if k % 3 == 0 { "#DIV/0!" } else { "1.5" };
                format!("{},{},{},{ratio}", millis(k), torque(k), rate(k))
            }),
            plain.clone(),
            None,
        ),
        (
            "Excel workbook under another name",
            "csv",
            b"PK\x03\x04\x14\0\x06\0".to_vec(),
            plain.clone(),
            Some("the file is neither text in columns nor Parquet"),
        ),
        (
            "LibreOffice, all fields quoted",
            "csv",
            lines("\"t\",\"T_cmd\",\"gyro z\"\n", |k| {
                format!("\"{}\",\"{}\",\"{}\"", millis(k), torque(k), commas(&rate(k)))
            }),
            plain,
            None,
        ),
    ]
}

fn robots() -> Vec<Case> {
    let nanoseconds = |k: usize| BEGIN * 1_000_000_000 + 1_000_000 * millis(k) as i64;
    let bag = lines(
        "%time,field.header.seq,field.header.frame_id,field.torque,field.angular_velocity.z\n",
        |k| format!("{},{k},imu_link,{},{}", nanoseconds(k), torque(k), rate(k)),
    );
    let influx = lines("name,time,T_cmd,gyro\n", |k| {
        format!("bench,{},{},{}", nanoseconds(k), torque(k), rate(k))
    });
    let tau = "field.torque:mNm";
    let z = "field.angular_velocity.z:deg/s";
    let late = "is 1769860800000000000 s";
    vec![
        ("rostopic echo -p", "csv", bag.clone(), of("time:ns", tau, z), None),
        ("rostopic echo -p, its unit not stated", "csv", bag, of("time", tau, z), Some(late)),
        (
            "PlotJuggler",
            "csv",
            lines("__time,/bench/torque/data,/imu/angular_velocity/z\n", |k| {
                format!(
                    "{}.{:06},{},{}",
                    BEGIN + millis(k) as i64 / 1000,
                    millis(k) % 1000 * 1000,
                    torque(k),
                    rate(k)
                )
            }),
            of("__time", "/bench/torque/data:mNm", "/imu/angular_velocity/z:deg/s"),
            None,
        ),
        (
            "PX4 ulog2csv",
            "csv",
            lines("timestamp,timestamp_sample,xyz[0],xyz[1],xyz[2],torque\n", |k| {
                format!(
                    "{0},{0},0.5,-0.25,{1},{2}",
                    123_456_789 + 1000 * millis(k),
                    rate(k),
                    torque(k)
                )
            }),
            of("timestamp:us", "torque:mNm", "xyz[2]:deg/s"),
            None,
        ),
        (
            "ArduPilot mavlogdump --format csv",
            "csv",
            lines("timestamp,TimeUS,I,GyrZ,Tq,Mode\n", |k| {
                format!(
                    "{}.{:03},{},0,{},{},GUIDED",
                    BEGIN + millis(k) as i64 / 1000,
                    millis(k) % 1000,
                    1000 * millis(k),
                    rate(k),
                    torque(k)
                )
            }),
            of("TimeUS:us", "Tq:mNm", "GyrZ:deg/s"),
            None,
        ),
        (
            "gnss-ins-sim",
            "csv",
            lines("time (sec),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),T (mN.m)\n", |k| {
                format!("{},0.1,-0.2,{},{}", seconds(k), rate(k), torque(k))
            }),
            of("time", "T", "gyro_z"),
            None,
        ),
        ("InfluxDB 1 shell", "csv", influx.clone(), of("time:ns", "T_cmd:mNm", "gyro:deg/s"), None),
        (
            "InfluxDB 1 shell, its unit not stated",
            "csv",
            influx,
            of("time", "T_cmd:mNm", "gyro:deg/s"),
            Some(late),
        ),
        (
            "InfluxDB 2 annotated, pivoted",
            "csv",
            lines(
                "#group,false,false,true,false,false\n#datatype,string,long,dateTime:RFC3339,double,double\n#default,_result,,,,\n,result,table,_time,T_cmd,gyro\n",
                |k| format!(",,0,2026-01-31T{}Z,{},{}", clock(k), torque(k), rate(k)),
            ),
            of("_time", "T_cmd:mNm", "gyro:deg/s"),
            None,
        ),
        (
            "Grafana",
            "csv",
            lines("\"Time\",\"T_cmd\",\"gyro\"\n", |k| {
                format!("2026-01-31 {},{} mN·m,{}", clock(k), torque(k), rate(k))
            }),
            of("Time", "T_cmd:mNm", "gyro:deg/s"),
            Some("line 2, column T_cmd: \"-100 mN·m\" is not a number"),
        ),
    ]
}

fn laboratories() -> Vec<Case> {
    vec![
        (
            "NI TDMS to CSV (npTDMS)",
            "csv",
            lines(",/'Bench'/'Time',/'Bench'/'T_cmd',/'Bench'/'gyro z'\n", |k| {
                format!("{k},{},{},{}", seconds(k), torque(k), rate(k))
            }),
            of("/'Bench'/'Time'", "/'Bench'/'T_cmd':mNm", "/'Bench'/'gyro z':deg/s"),
            None,
        ),
        (
            "Saleae Logic",
            "csv",
            lines("Time [s],Channel 0,Channel 1\n", |k| {
                format!("{}000000,{}.000,{}00", seconds(k), torque(k), rate(k))
            }),
            of("Time", "Channel 0:mNm", "Channel 1:deg/s"),
            None,
        ),
        (
            "HBM catman, Germany",
            "txt",
            lines(
                "HBM_CATMANFILE_5.0\nDatum: 31.01.2026\nZeit\tDrehmoment\tDrehrate\ns\tmN·m\t°/s\n",
                |k| format!("{}\t{}\t{}\t", commas(&seconds(k)), torque(k), commas(&rate(k))),
            ),
            of("Zeit", "Drehmoment", "Drehrate"),
            None,
        ),
        (
            "Arduino serial plotter",
            "txt",
            lines("", |k| format!("T_cmd:{},gyro:{}", torque(k), rate(k))),
            of("t", "T_cmd:mNm", "gyro:deg/s"),
            Some("is not a row of numbers"),
        ),
        (
            "C on Windows: NaN and infinities in a spare column",
            "csv",
            lines("t,T_cmd,gyro,spare\n", |k| {
                let spare = ["-nan(ind)", "1.#QNAN", "-1.#IND", "nan", "-nan", "0.5"][k % 6];
                format!("{},{},{},{spare}", millis(k), torque(k), rate(k))
            }),
            of("t:ms", "T_cmd:mNm", "gyro:deg/s"),
            None,
        ),
        (
            "gzip under another name",
            "csv",
            b"\x1f\x8b\x08\0\0\0\0\0\0\x03".to_vec(),
            of("t", "a", "b"),
            Some("the file is compressed with gzip"),
        ),
        (
            "gzip",
            "gz",
            b"\x1f\x8b\x08\0\0\0\0\0\0\x03".to_vec(),
            of("t", "a", "b"),
            Some("the file is compressed with gzip"),
        ),
        (
            "ROS 2 bag",
            "csv",
            b"SQLite format 3\0\x10\0".to_vec(),
            of("t", "a", "b"),
            Some("the file is an SQLite database"),
        ),
    ]
}

fn programs() -> Vec<Case> {
    let plain = || of("t:ms", "T_cmd:mNm", "gyro_z:deg/s");
    vec![
        (
            "MATLAB writetable with datetime",
            "csv",
            lines("t,T_cmd,gyro_z\n", |k| {
                format!("31-Jan-2026 {},{},{}", clock(k), torque(k), rate(k))
            }),
            of("t", "T_cmd:mNm", "gyro_z:deg/s"),
            None,
        ),
        (
            "pandas to_csv with its index",
            "csv",
            lines(",t,T_cmd,gyro_z\n", |k| {
                format!("{k},{}.0,{}.0,{}", millis(k), torque(k), rate(k))
            }),
            plain(),
            None,
        ),
        (
            "pandas to_csv, DatetimeIndex",
            "csv",
            lines("time,T_cmd,gyro_z\n", |k| {
                let stamp = format!("2026-01-31 {}000", clock(k));
                format!(
                    "{},{},{}",
                    stamp.strip_suffix(".000000").unwrap_or(&stamp),
                    torque(k),
                    rate(k)
                )
            }),
            of("time", "T_cmd:mNm", "gyro_z:deg/s"),
            None,
        ),
        (
            "pandas to_csv, TimedeltaIndex",
            "csv",
            lines("time,T_cmd,gyro_z\n", |k| {
                let stamp = format!("0 days 00:00:0{}000", seconds(k));
                format!(
                    "{},{},{}",
                    stamp.strip_suffix(".000000").unwrap_or(&stamp),
                    torque(k),
                    rate(k)
                )
            }),
            of("time", "T_cmd:mNm", "gyro_z:deg/s"),
            None,
        ),
        (
            "pandas to_parquet, DatetimeIndex",
            "parquet",
            parquet("__index_level_0__", true),
            of("__index_level_0__", "T_cmd:mNm", "gyro_z:deg/s"),
            None,
        ),
        (
            "Polars write_parquet",
            "parquet",
            parquet("t", false),
            of("t", "T_cmd:mNm", "gyro_z:deg/s"),
            None,
        ),
        (
            "Python logging",
            "log",
            lines("", |k| format!("2026-01-31 {};{};{}", commas(&clock(k)), torque(k), rate(k))),
            of("#1", "#2:mNm", "#3:deg/s"),
            None,
        ),
        (
            "numpy savetxt with a header",
            "txt",
            lines("# t T_cmd gyro_z\n", |k| {
                format!("{:.18e} {:.18e} {}", millis(k) as f64, torque(k) as f64, rate(k))
            }),
            plain(),
            None,
        ),
        (
            "Dymola, OpenModelica",
            "csv",
            lines("\"t\",\"T_cmd\",\"gyro_z\",\n", |k| {
                format!("{},{},{},", millis(k), torque(k), rate(k))
            }),
            plain(),
            None,
        ),
        (
            "JavaScript dates",
            "csv",
            lines("t,T_cmd,gyro_z\n", |k| {
                format!("{},{},{}", BEGIN * 1000 + millis(k) as i64, torque(k), rate(k))
            }),
            of("t", "T_cmd:mNm", "gyro_z:deg/s"),
            Some("is 1769860800000 s"),
        ),
    ]
}

fn with_words() -> Vec<Case> {
    let row = |k: usize| format!("{},{},{}", millis(k), torque(k), rate(k));
    let numbered = || of("#1:ms", "#2:mNm", "#3:deg/s");
    let plain = || of("t:ms", "T_cmd:mNm", "gyro z:deg/s");
    let labview = |decimal: char, comment: &str| {
        let digits = move |text: String| text.replace('.', &decimal.to_string());
        let head = [
            "LabVIEW Measurement\t",
            "Writer_Version\t2",
            "Reader_Version\t2",
            "Separator\tTab",
            "Multi_Headings\tNo",
            "X_Columns\tOne",
            "Time_Pref\tRelative",
            "Date\t2026/01/31",
            "Time\t12:00:00.5",
            "***End_of_Header***\t",
            "\t",
            "Channels\t2\t\t",
            "Samples\t40\t40\t",
            "Date\t2026/01/31\t2026/01/31\t",
            "Time\t12:00:00.5\t12:00:00.5\t",
            "Y_Unit_Label\tmN·m\tdeg/s\t",
            "X_Dimension\tTime\tTime\t",
            "X0\t0.0E+0\t0.0E+0\t",
            "Delta_X\t0.020000\t0.020000\t",
            "***End_of_Header***\t\t\t",
            "X_Value\tT_cmd\tgyro z\tComment\n",
        ];
        let head = digits(head.join("\n"));
        crlf(&lines(&head, |k| {
            let comment = if k == 0 { comment } else { "" };
            digits(format!("{}\t{}.000000\t{}00000{comment}", seconds(k), torque(k), rate(k)))
        }))
    };
    let labels = of("X_Value", "T_cmd", "gyro z");
    let dspace = lines(
        "type,ControlDesk measurement,,\nrecorder,Recorder 1,,\nname,t,T_cmd,gyro z\nunit,ms,mN·m,deg/s\n",
        |k| format!("{},{}", if k == 0 { "trace_values" } else { "" }, row(k)),
    );
    let tektronix = lines("", |k| {
        let before = [
            "Record Length,2.5e+03,",
            "Sample Interval,2.0e-02,",
            "Trigger Point,1.0e+00,",
            ",,",
            ",,",
            "Source,CH1,",
            "Vertical Units,V,",
        ];
        let before = before.get(k).copied().unwrap_or(",,");
        format!("{before},{},  {},  {},", seconds(k), torque(k), rate(k))
    });
    let motec = [
        r#""Format","MoTeC CSV File",,,"Workbook","""#,
        r#""Venue","Bench",,,"Worksheet","""#,
        r#""Log Date","31/01/2026",,,"Origin Time","0.000","s""#,
        r#""Log Time","12:00:00",,,"Start Time","0","s""#,
        r#""Sample Rate","50.000","Hz""#,
        r#""Duration","1","s""#,
        r#""Range","entire outing""#,
        "\n",
        r#""Time","T_cmd","gyro z""#,
        r#""s","mN.m","deg/s""#,
        "\n\n",
    ];
    let motec = lines(&motec.join("\n"), |k| {
        format!("\"{}\",\"{}\",\"{}\"", seconds(k), torque(k), rate(k))
    });
    let boot = "ets Jul 29 2019 12:21:46\r\nrst:0x1 (POWERON_RESET),boot:0x13\r\n";
    let capture = |begin: &str| [begin.as_bytes(), &crlf(&lines("", row)), b"800,-1"].concat();
    let data_flash = |rows: &dyn Fn(usize) -> String| {
        let head = [
            "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
            "FMT, 129, 31, PARM, QNff, TimeUS,Name,Value,Default",
            "FMT, 150, 50, IMU, QBff, TimeUS,I,GyrZ,Tq",
            "FMT, 151, 40, ATT, Qff, TimeUS,Roll,Pitch",
            "PARM, 100, ARSPD_TYPE, 0, 0",
            "PARM, 101, BARO_GND, 0, 0\n",
        ];
        let head = &head.join("\n");
        lines(head, rows)
    };
    vec![
        (
            "LabVIEW",
            "lvm",
            labview('.', ""),
            labels.clone(),
            Some("the header, line 20, has 4 names, but the rows have 3 fields"),
        ),
        (
            "LabVIEW, Germany, with a comment",
            "lvm",
            labview(',', "\tstart"),
            labels,
            Some("is neither a row of numbers nor a header"),
        ),
        ("dSPACE ControlDesk", "csv", dspace, of("t", "T_cmd", "gyro z"), None),
        (
            "Tektronix TDS",
            "csv",
            tektronix,
            of("#4:s", "#5:mNm", "#6:deg/s"),
            Some("the lines are records of several kinds"),
        ),
        (
            "Tektronix MSO",
            "csv",
            lines(
                &[
                    "Model,MSO44",
                    "Firmware Version,2.0.3",
                    "",
                    "Waveform Type,ANALOG,,",
                    "Horizontal Units,s,,",
                    "Horizontal Scale,0.1,,",
                    "Sample Interval,0.02,,",
                    "Record Length,40,,",
                    "Gating,0.0% to 100.0%,,",
                    "Probe Attenuation,1,1,",
                    "Vertical Units,V,V,",
                    "Vertical Offset,0,0,",
                    "Label,,,",
                    "",
                    "TIME,CH1,CH2\n",
                ]
                .join("\n"),
                |k| format!("{},{},{}", seconds(k), torque(k), rate(k)),
            ),
            of("TIME:s", "CH1:mNm", "CH2:deg/s"),
            None,
        ),
        ("MoTeC i2", "csv", motec, of("Time", "T_cmd", "gyro z"), None),
        (
            "Arduino serial monitor with times",
            "txt",
            lines("", |k| format!("{} -> {},{}", clock(k), torque(k), rate(k))),
            of("#1", "#2:mNm", "#3:deg/s"),
            Some("the lines are records of several kinds"),
        ),
        (
            "Arduino serial monitor with times and names",
            "txt",
            lines("11:59:59.990 -> t,T_cmd,gyro z\n", |k| format!("{} -> {}", clock(k), row(k))),
            plain(),
            Some("no column t (columns in it"),
        ),
        (
            "Arduino serial monitor, names in the rows",
            "txt",
            lines("", |k| format!("{} -> T_cmd:{},gyro:{}", clock(k), torque(k), rate(k))),
            of("#1", "T_cmd:mNm", "gyro:deg/s"),
            Some("of text, as line 1 shows: #2"),
        ),
        (
            "Tera Term with times",
            "log",
            lines("", |k| format!("[2026-01-31 {}] {}\t{}", clock(k), torque(k), rate(k))),
            of("#1", "#2:mNm", "#3:deg/s"),
            Some("the lines are records of several kinds"),
        ),
        (
            "R write.csv",
            "csv",
            lines("\"\",\"t\",\"T_cmd\",\"gyro z\"\n", |k| format!("\"{}\",{}", k + 1, row(k))),
            plain(),
            None,
        ),
        (
            "R write.table",
            "txt",
            lines("\"t\" \"T_cmd\" \"gyro z\" \"state\"\n", |k| {
                format!("\"{}\" {} \"slow sweep\"", k + 1, row(k).replace(',', " "))
            }),
            plain(),
            Some("the header, line 1, has 4 names, but the rows have 5 fields"),
        ),
        (
            "R write.table, no quotes",
            "txt",
            lines("t T_cmd gyro\n", |k| format!("{} {}", k + 1, row(k).replace(',', " "))),
            of("t:ms", "T_cmd:mNm", "gyro:deg/s"),
            Some("the header, line 1, has 3 names, but the rows have 4 fields"),
        ),
        (
            "R write.csv2",
            "csv",
            lines("\"\";\"t\";\"T_cmd\";\"gyro z\"\n", |k| {
                format!("\"{}\";{};{};{}", k + 1, millis(k), torque(k), commas(&rate(k)))
            }),
            plain(),
            None,
        ),
        (
            "serial capture, cut at both ends",
            "log",
            capture("3,-1.2\r\n"),
            numbered(),
            Some("line 1, \"3,-1.2\", is neither a row of numbers nor a header"),
        ),
        (
            "PuTTY",
            "log",
            capture("=~=~=~=~= PuTTY log 2026.01.31 12:00:00 =~=~=~=~=\r\n"),
            numbered(),
            None,
        ),
        (
            "serial capture with names after a start",
            "log",
            capture("ready\r\nt,T_cmd,gyro z\r\n"),
            plain(),
            None,
        ),
        (
            "serial capture of a start",
            "log",
            capture(boot),
            numbered(),
            Some("the header, line 1, has 2 names, but the rows have 3 fields"),
        ),
        (
            "serial capture, its first row damaged",
            "log",
            capture("\u{fffd}20,5,1.5\r\n"),
            numbered(),
            Some("line 1, column #1: \"\u{fffd}20\" is not a number"),
        ),
        (
            "serial capture with a second start",
            "log",
            [lines("t,T_cmd,gyro z\n", row), lines("t,T_cmd,gyro z\n", row)].concat(),
            plain(),
            Some("line 42, column t: \"t\" is not a number"),
        ),
        (
            "ArduPilot DataFlash",
            "log",
            data_flash(&|k| match k % 2 {
                0 => format!("IMU, {}, 0, {}, {}", 1000 * millis(k), rate(k), torque(k)),
                _ => format!("ATT, {}, 0.1, 0.2", 1000 * millis(k)),
            }),
            of("#2:us", "#5:mNm", "#4:deg/s"),
            Some("the header, line 4, has 8 names, but the rows have 5 fields"),
        ),
        (
            "ArduPilot DataFlash, its formats alone at the beginning",
            "log",
            data_flash(&|k| {
                format!("FMT, {k}, 50, A{k}, Q{}, T{}", "f".repeat(k % 3), ",x".repeat(k % 3))
            }),
            of("#2:us", "#5:mNm", "#4:deg/s"),
            Some("is not a number"),
        ),
        (
            "NMEA and rows of its own",
            "log",
            lines("", |k| match k % 2 {
                0 => format!("$IMU,{},{},{}", millis(k), torque(k), rate(k)),
                _ => format!("$GPS,{},48.1,11.5", millis(k)),
            }),
            of("#2:ms", "#3:mNm", "#4:deg/s"),
            Some("the lines are records of several kinds, such as $GPS and $IMU"),
        ),
    ]
}

#[test]
fn files_of_many_tools_are_read_correctly_or_refused_with_a_helpful_message() {
    let cases = [spreadsheets(), robots(), laboratories(), programs(), with_words()].concat();
    let time: Vec<f64> = (0..ROWS).map(|k| millis(k) as f64 * 1e-3).collect();
    let torques: Vec<f64> = (0..ROWS).map(|k| torque(k) as f64 * 1e-3).collect();
    let rates: Vec<f64> = (0..ROWS).map(|k| (tenths(k) as f64 / 10.0).to_radians()).collect();
    let mut wrong = Vec::new();
    for (tool, ending, bytes, columns, refusal) in &cases {
        match (read_text(ending, bytes, columns), refusal) {
            (Ok((table, said)), None) => {
                // dates are converted to times since the first row; other times are not shifted
                let from = column(&table, "time")[0];
                let times: Vec<f64> = column(&table, "time").iter().map(|t| t - from).collect();
                // times since 1970 in s have only 52 binary digits
                let off = |(a, b): (&f64, &f64)| (a - b).abs() > 3e-7;
                if times.len() != ROWS || times.iter().zip(&time).any(off) {
                    wrong.push(format!("{tool}: times {times:?}\n{said}"));
                    continue;
                }
                assert_close(column(&table, "tau_cmd"), &torques, tool);
                assert_close(column(&table, "omega"), &rates, tool);
            }
            (Err(error), Some(words)) if error.contains(words) => {}
            (Ok((_, said)), Some(words)) => {
                wrong.push(format!("{tool}: read, not \"{words}\"\n{said}"))
            }
            (Err(error), _) => wrong.push(format!("{tool}: {error}")),
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}
