//! Exports of historians, controllers, laboratories and homes, in the shapes that their tools write: each is read without a word about its
//! columns, or is refused with the words that read it.

use drift_sim::recording::{ColumnMap, Overview, ReadOptions, Recording};

/// Ten samples, 5 s apart from 08:00:00 on: r = 40, y = 20 + 0.5 k, u = 60 - k.
fn rows(row: impl Fn(usize, &str, f64) -> String) -> String {
    (0..10).map(|k| row(k, &format!("08:00:{:02}", 5 * k), 20.0 + 0.5 * k as f64)).collect()
}

fn u(k: usize) -> f64 {
    60.0 - k as f64
}

fn read(text: &str, columns: &str) -> drift_sim::Result<Recording> {
    let columns = if columns.is_empty() { ColumnMap::default() } else { columns.parse()? };
    let options = ReadOptions { columns, ..ReadOptions::default() };
    Recording::from_reader("export", std::io::Cursor::new(text.to_owned()), &options)
}

#[track_caller]
fn is_the_loop(text: &str, names: [&str; 4]) -> Recording {
    let recording =
        read(text, "").unwrap_or_else(|e| panic!("{e}\n{}", text.lines().take(3).collect::<String>()));
    let map = &recording.columns;
    assert_eq!([map.t.as_deref().unwrap_or_default(), &map.r, &map.y, &map.u], names);
    assert_eq!((recording.sample_time_s, recording.len()), (5.0, 10));
    assert_eq!(recording.r, [40.0; 10]);
    let expected: Vec<(f64, f64)> = (0..10).map(|k| (20.0 + 0.5 * k as f64, u(k))).collect();
    assert_eq!(recording.y.iter().copied().zip(recording.u.iter().copied()).collect::<Vec<_>>(), expected);
    recording
}

#[test]
fn tables_of_controllers_and_historians_are_understood() {
    let comma = |value: f64| value.to_string().replace('.', ",");
    is_the_loop(
        &format!(
            "\"Zeitstempel\";\"TIC101/PID.SP_Ext\";\"TIC101/PID.PV_In\";\"TIC101/PID.LMN\"\r\n{}",
            rows(|k, at, y| format!("\"13.05.2024 {at}\";40,0;{};{}\r\n", comma(y), comma(u(k))))
        ),
        ["Zeitstempel", "TIC101/PID.SP_Ext", "TIC101/PID.PV_In", "TIC101/PID.LMN"],
    );
    is_the_loop(
        &format!(
            "\"Date\",\"Time\",\"Millitm\",\"Marker\",\"[PLC]TIC101.SP\",\"[PLC]TIC101.PV\",\"[PLC]TIC101.CV\"\n{}",
            rows(|k, at, y| format!("\"05/13/2024\",\"{at}\",0,\"\",40,{y},{}\n", u(k)))
        ),
        ["Date+Time", "[PLC]TIC101.SP", "[PLC]TIC101.PV", "[PLC]TIC101.CV"],
    );
    is_the_loop(
        &format!(
            "\"Station\",\"FCS0101\"\n\n\"Date/Time\",\"TIC101.SV\",\"TIC101.PV\",\"TIC101.MV\",\"TIC101.MODE\"\n\
             \"\",\"DEGC\",\"DEGC\",\"%\",\"\"\n{}",
            rows(|k, at, y| format!("\"2024/05/13 {at}\",40,{y},{},\"AUT\"\n", u(k)))
        ),
        ["Date/Time", "TIC101.SV", "TIC101.PV", "TIC101.MV"],
    );
    // Columns of one name stand behind each signal, and nobody asks for one of them.
    is_the_loop(
        &format!(
            "Timestamp,TIC101.SP,Confidence,TIC101.PV,Confidence,TIC101.OP,Confidence\n{}",
            rows(|k, at, y| format!("13-May-2024 {at},40,100,{y},100,{},100\n", u(k)))
        ),
        ["Timestamp", "TIC101.SP", "TIC101.PV", "TIC101.OP"],
    );
    // The last part of each tag tells nothing; words are no signal.
    let recording = is_the_loop(
        &format!(
            "Date Time\tTIC-101/PID1/SP.CV\tTIC-101/PID1/PV.CV\tTIC-101/PID1/OUT.CV\tTIC-101/PID1/MODE.ACTUAL\n{}",
            rows(|k, at, y| format!(
                "05/13/2024 {at}.000 AM\t40\t{y}\t{}\t{}\n",
                u(k),
                if k == 4 { "MAN" } else { "AUTO" }
            ))
        ),
        ["Date Time", "TIC-101/PID1/SP.CV", "TIC-101/PID1/PV.CV", "TIC-101/PID1/OUT.CV"],
    );
    assert!(recording.quality.notes.iter().any(|note| note.contains("MODE.ACTUAL")));
    // The dates have no name.
    let text = format!(
        ",TIC101:SP,TIC101:PV,TIC101:OUT\n{}",
        rows(|k, at, y| format!("13-May-24 {at},40,{y},{}\n", u(k)))
    );
    is_the_loop(&text, ["", "TIC101:SP", "TIC101:PV", "TIC101:OUT"]);
    let recording = read(&text.replacen(",60\n", ",Bad Input\n", 1), "").unwrap();
    assert_eq!((recording.quality.missing_u, recording.len()), (1, 10));
}

#[test]
fn files_of_laboratories_and_programs_are_understood() {
    // A row of numbers describes the measurement before the header of its table.
    is_the_loop(
        &format!(
            "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\nChannels\t3\nDelta_X\t5\t5\t5\t\n\
             ***End_of_Header***\t\t\t\t\nX_Value\tSetpoint\tTemperature\tHeater\tComment\n{}",
            rows(|k, _, y| format!("{}\t40\t{y}\t{}\t\n", 5 * k, u(k)))
        ),
        ["X_Value", "Setpoint", "Temperature", "Heater"],
    );
    is_the_loop(
        &format!(
            "Arduino PID ready\nms,setpoint,temp,pwm\n{}",
            rows(|k, _, y| format!("{},40,{y},{}\n", 5000 * k, u(k)))
        ),
        ["ms", "setpoint", "temp", "pwm"],
    );
    is_the_loop(
        &rows(|k, at, y| format!("{at}.000 -> Setpoint:40,Input:{y},Output:{}\n", u(k))),
        ["time", "Setpoint", "Input", "Output"],
    );
    // The path of each block stands above its name; what it is called itself is the port of a block.
    is_the_loop(
        &format!(
            "path;;Loop/Ref;Loop/Plant;Loop/Controller\nname;time;Reference/Out1;Angle/Out1;Voltage/Out1\n{}",
            rows(|k, _, y| format!("trace_values;{};40;{y};{}\n", 5 * k, u(k)))
        ),
        ["time", "Reference/Out1", "Angle/Out1", "Voltage/Out1"],
    );
    is_the_loop(
        &rows(|k, at, y| format!("{at}.000 -> Setpoint:40,Temperature:{y},Heater:{}\n", u(k))),
        ["time", "Setpoint", "Temperature", "Heater"],
    );
    is_the_loop(&rows(|k, _, y| format!("t={} r=40 y={y} u={}\n", 5 * k, u(k))), ["t", "r", "y", "u"]);
    is_the_loop(
        &format!(
            "__time,/loop/ref/data,/loop/state/data,/loop/cmd/data\n{}",
            rows(|k, _, y| format!("{},40,{y},{}\n", 1_715_587_200 + 5 * k, u(k)))
        ),
        ["__time", "/loop/ref/data", "/loop/state/data", "/loop/cmd/data"],
    );
    is_the_loop(
        &format!(
            "time,setpoint,value,output\n{}",
            rows(|k, _, y| format!("{},40.0 \u{b0}C,{y} \u{b0}C,{}%\n", 5 * k, u(k)))
        ),
        ["time", "setpoint", "value", "output"],
    );
}

#[test]
fn json_lines_and_lists_are_understood() {
    let object = |k: usize, y: f64| {
        format!(
            "{{\"_msgid\":\"a{k}\",\"topic\":\"oven\",\"payload\":{{\"setpoint\":40,\"temperature\":{y},\"output\":{}}},\
             \"timestamp\":{}}}",
            u(k),
            1_715_587_200_000_usize + 5000 * k
        )
    };
    let names = ["timestamp", "payload.setpoint", "payload.temperature", "payload.output"];
    let recording = is_the_loop(&rows(|k, _, y| object(k, y) + "\n"), names);
    assert_eq!(recording.clock().says(recording.start_s), "2024-05-13 08:00:00.000");
    let list = rows(|k, _, y| format!("{}{}", if k == 0 { "[" } else { "," }, object(k, y)));
    is_the_loop(&format!("{list}]"), names);
    is_the_loop(&format!("{list}]\n").replace(',', ",\n  "), names);
}

/// A row for each value: tag after tag, as databases and historians write it, or in the order of time.
#[test]
fn tables_with_a_row_for_each_value_become_columns() {
    let blocks = |names: [&str; 3], row: &dyn Fn(&str, &str, f64) -> String| -> String {
        let of = |tag: &str, value: &dyn Fn(usize, f64) -> f64| rows(|k, at, y| row(tag, at, value(k, y)));
        let [r, y, u_name] = names;
        of(r, &|_, _| 40.0) + &of(y, &|_, y| y) + &of(u_name, &|k, _| u(k))
    };
    let tags = ["TIC101.SP", "TIC101.PV", "TIC101.OP"];
    let historian = blocks(tags, &|tag, at, value| format!("{tag},2024-05-13T{at}Z,{value},False\n"));
    is_the_loop(
        &format!("Tag,Timestamp,Value,Questionable\n{historian}"),
        ["Timestamp", tags[0], tags[1], tags[2]],
    );
    let home = ["climate.oven_setpoint", "sensor.oven_temperature", "number.heater_output"];
    let states = blocks(home, &|tag, at, value| format!("{tag},{value},2024-05-13T{at}.000Z\n"));
    let recording = is_the_loop(
        &format!(
            "entity_id,state,last_changed\nclimate.oven_setpoint,unavailable,2024-05-13T07:59:59.000Z\n{states}"
        ),
        ["last_changed", home[0], home[1], home[2]],
    );
    assert!(
        recording
            .quality
            .notes
            .iter()
            .any(|note| note.contains("all others hold their last value before each"))
    );
    let database = blocks(["sp", "pv", "op"], &|tag, at, value| {
        format!(",,0,2024-05-13T08:00:00Z,2024-05-13T12:00:00Z,2024-05-13T{at}Z,{value},{tag},oven\r\n")
    });
    is_the_loop(
        &format!(
            "#group,false,false,true,true,false,false,true,true\r\n,result,table,_start,_stop,_time,_value,_field,_measurement\r\n{database}"
        ),
        ["_time", "sp", "pv", "op"],
    );
    // In the order of time, with a sign of quality and a mark that is no point; and all of it the latest first.
    let panel = rows(|k, at, y| {
        [("A.SP", 40.0), ("A.PV", y), ("A.OP", u(k))]
            .map(|(tag, value)| {
                format!(
                    "\"{tag}\";\"13.05.2024 {at}\";{};1;45425333333,3\r\n",
                    value.to_string().replace('.', ",")
                )
            })
            .concat()
    });
    let header = "\"VarName\";\"TimeString\";\"VarValue\";\"Validity\";\"Time_ms\"\r\n";
    let names = ["TimeString", "A.SP", "A.PV", "A.OP"];
    is_the_loop(&format!("{header}{panel}"), names);
    let latest_first: Vec<&str> = panel.split_inclusive('\n').rev().collect();
    is_the_loop(&format!("{header}{}", latest_first.concat()), names);
    let messages = blocks(["sp", "pv", "op"], &|tag, at, value| {
        format!("{{\"topic\":\"oven/{tag}\",\"value\":{value},\"time\":\"2024-05-13T{at}Z\"}}\n")
    });
    is_the_loop(&messages, ["time", "oven/sp", "oven/pv", "oven/op"]);
}

#[test]
fn what_a_table_of_single_values_lacks_is_told() {
    let header = "Tag,Time,Value\n";
    let message = |rows: &str| read(&format!("{header}{rows}"), "").unwrap_err().to_string();
    assert_eq!(
        message("a,0,1\nb,0,2\na,1,1\nb,1,2\n"),
        "export:1: no column 'y' for y; like --columns t=Time,y=a,u=b; the columns are Time, a, b"
    );
    let many: String = (0..=1000).map(|k| format!("tag{k},0,1\n")).collect();
    assert_eq!(message(&many), "export:1002: more than 1000 names in 'Tag'");
    assert!(
        message("SP,0,1\nPV,0,1\nOP,0,1\nPV,2,1\nPV,1,1\nPV,3,1\n").contains("6: the time of 'PV' goes back")
    );
}

/// An example of `--columns` names columns that hold numbers; where none is left for the time, it says what is needed instead.
#[test]
fn the_way_out_that_an_error_names_works() {
    let plotter = rows(|k, _, y| format!("Setpoint:40,Input:{y},Output:{}\n", u(k)));
    assert_eq!(
        read(&plotter, "").unwrap_err().to_string(),
        "export:1: no column 't' for t; like --columns r=Setpoint,y=Input,u=Output --sample-time S; the columns are Setpoint, \
         Input, Output"
    );
    let options = ReadOptions {
        columns: "r=Setpoint,y=Input,u=Output".parse().unwrap(),
        sample_time_s: Some(5.0),
        ..ReadOptions::default()
    };
    assert_eq!(Recording::from_reader("x", std::io::Cursor::new(plotter), &options).unwrap().len(), 10);
    let traces = format!(
        "path;;Loop/Ref;Loop/Plant;Loop/Controller\nname;time;Reference/Out1;Angle/Out1;Voltage/Out1\n{}",
        rows(|k, _, y| format!("a;{};40;{y};{}\n", 5 * k, u(k)))
    );
    let options = ReadOptions { incomplete: true, ..ReadOptions::default() };
    let seen = Overview::from_reader("x", || std::io::Cursor::new(traces.clone()), &options).unwrap();
    assert!(!seen.example.contains("name"), "{}", seen.example);
}

/// 200 samples of a loop with one more column: what it holds where the value is good or the loop closed, and in every tenth row.
fn with_status(name: &str, good: &str, bad: &str) -> String {
    let cell = |k: usize| if k % 10 == 3 { bad } else { good };
    let rows = (0..200).map(|k| format!("{k},40,{},{},{}\n", 20 + k % 7, 60 - k % 5, cell(k)));
    format!("t,r,y,u,{name}\n{}", rows.collect::<String>())
}

/// What is told of a status, and how many rows don't count.
fn status_of(text: &str) -> (String, u64) {
    let quality = read(text, "").unwrap().quality;
    (quality.notes.join("\n"), quality.manual)
}

#[test]
fn a_note_on_a_status_comes_with_the_rows_that_it_drops() {
    for (name, good, bad) in [
        ("status", "Good", "Bad"),
        ("Status", "OK", "FAULT"),
        ("quality", "GOOD", "Uncertain"),
        ("quality", "192", "0"),
        ("TIC101.Quality", "216.0", "64"),
    ] {
        let (told, manual) = status_of(&with_status(name, good, bad));
        assert_eq!(manual, 20, "{name} {bad}");
        assert!(told.contains(&format!("rows where '{name}'")) && told.contains("don't count"), "{told}");
    }
    // A quality that is no code of OPC, and columns without a bad word.
    for (name, good, bad) in
        [("quality", "100", "80"), ("quality", "0", "0"), ("status", "OK", "ok"), ("MODE", "AUTO", "CAS")]
    {
        assert_eq!(status_of(&with_status(name, good, bad)), (String::new(), 0), "{name} {bad}");
    }
}

/// The condition that is proposed is one of this file, and typed it reads the file as it was read without.
#[test]
fn the_condition_that_a_note_proposes_is_of_this_file() {
    for (name, good, bad, proposed) in [
        ("Betriebsart", "Automatik", "Hand", "Betriebsart=Automatik"),
        ("LoopMode", "Cascade", "Manual", "LoopMode=Cascade"),
        ("MODE", "Auto", "Man", "MODE=Auto"),
        ("status", "Normal", "Bad", "status=Normal"),
        ("LOOP MODE", "Follow setpoint", "Hand", "\"LOOP MODE=Follow setpoint\""),
        ("manual", "FALSE", "TRUE", "manual=FALSE"),
        ("quality", "192", "24", "\"quality>=192\""),
    ] {
        let text = with_status(name, good, bad);
        let (told, manual) = status_of(&text);
        assert!(told.contains(&format!("(--when {proposed} or --when always says otherwise)")), "{told}");
        let when = vec![proposed.trim_matches('"').parse().unwrap()];
        let options = ReadOptions { when, ..ReadOptions::default() };
        let as_typed = Recording::from_reader("x", std::io::Cursor::new(text), &options).unwrap();
        assert_eq!((as_typed.quality.manual, manual), (20, 20), "{name}");
    }
}

#[test]
fn further_names_of_a_mode_are_understood() {
    for (name, good, bad) in [
        ("A/M", "A", "M"),
        ("TIC101.A/M", "AUTO", "MAN"),
        ("enabled", "1", "0"),
        ("controller_enabled", "True", "False"),
        ("TIC101.PID enabled", "on", "off"),
        ("Regler aktiv", "ja", "nein"),
    ] {
        assert_eq!(status_of(&with_status(name, good, bad)).1, 20, "{name}");
    }
    // What is enabled or active here is something else; a unit is no mode.
    for name in ["alarm_enabled", "heater.active", "field A/m"] {
        assert_eq!(status_of(&with_status(name, "1", "0")), (String::new(), 0), "{name}");
    }
}

/// A table as pandas writes it, by each of its orders but the one that is a list of objects.
#[test]
fn a_json_file_of_columns_is_understood() {
    let expected = (vec![1.0, 1.0, 1.0], vec![2.5, f64::INFINITY, 2.5], vec![3.0, 4.0, 5.0]);
    for text in [
        // to_json(orient="list") of a dict, a document around it, to_json(), to_json(orient="split").
        r#"{"t": [0, 1, 2], "r": [1, 1, 1], "y": [2.5, null, 2.5], "u": [3, 4, 5], "note": "x"}"#,
        "{\n  \"made by\": \"a logger\",\n  \"loop\": {\n    \"t\": [0, 1, 2], \"r\": [1, 1, 1],\n    \"y\": [2.5, null, 2.5], \"u\": [3, 4, 5]}\n}\n",
        r#"{"t":{"0":0,"1":1,"2":2},"r":{"0":1,"1":1,"2":1},"y":{"0":2.5,"1":null,"2":2.5},"u":{"0":3,"1":4,"2":5}}"#,
        r#"{"columns":["t","r","y","u"],"index":[0,1,2],"data":[[0,1,2.5,3],[1,1,null,4],[2,1,2.5,5]]}"#,
        r#"{"Time": ["2024-05-01T12:00:00", "2024-05-01T12:00:01", "2024-05-01T12:00:02"], "SP": [1, 1, 1], "PV": [2.5, null, 2.5], "OP": [3, 4, 5]}"#,
    ] {
        let recording = read(text, "").unwrap_or_else(|e| panic!("{text}: {e}"));
        let y = recording.y.iter().map(|y| if y.is_nan() { f64::INFINITY } else { *y }).collect();
        assert_eq!((recording.r, y, recording.u), expected, "{text}");
        assert_eq!(recording.sample_time_s, 1.0);
    }
    // Rows by their number, and not by its text.
    let many: Vec<String> = (0..12).map(|k| format!("\"{k}\":{k}")).collect();
    let many = many.join(",");
    let text = format!("{{\"t\":{{{many}}},\"y\":{{{many}}},\"u\":{{{many}}}}}");
    assert_eq!(read(&text, "").unwrap().y, (0..12).map(f64::from).collect::<Vec<_>>());
    for (text, says) in [
        (
            r#"{"schema": "drift.diagnosis/1", "spans": [1, 2]}"#,
            "export: this is a result of drift (drift.diagnosis/1), no recording; the recording that it was made from",
        ),
        (
            r#"{"name": "oven", "loop": {"gain": 2}}"#,
            "export: this is one JSON object without lists of values; its keys are name, loop; {\"t\": [0, 1], \"r\": [5, 5], ...}, or one \
             object on each line",
        ),
        (
            r#"{"t": [0, 1], "temp": [1, 2]}"#,
            "export: no column 'y' for y; like --columns t=t,y=temp,u=NAME; the columns are t, temp",
        ),
    ] {
        assert_eq!(read(text, "").unwrap_err().to_string(), says);
    }
}
