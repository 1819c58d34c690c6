//! Recordings as people have them: every shape of text gives the same loop, and what can't be told is asked for with an
//! example from the file itself.

use drift_sim::controller::{Controller, Limits};
use drift_sim::recording::{ReadOptions, Recording, Repeated, RowState};

fn read(bytes: impl AsRef<[u8]>, options: &ReadOptions) -> drift_sim::Result<Recording> {
    Recording::from_reader("x.csv", std::io::Cursor::new(bytes.as_ref().to_vec()), options)
}

fn plain() -> ReadOptions {
    ReadOptions::default()
}

fn columns(text: &str) -> ReadOptions {
    ReadOptions { columns: text.parse().unwrap(), ..plain() }
}

/// Three samples, a second apart: r = 1, y = 2.5, 2.25, 2.5, u = 3.
#[track_caller]
fn is_the_loop(bytes: impl AsRef<[u8]>, options: &ReadOptions) -> Recording {
    let bytes = bytes.as_ref();
    let recording =
        read(bytes, options).unwrap_or_else(|e| panic!("{:?}: {e}", String::from_utf8_lossy(bytes)));
    assert_eq!(
        (recording.sample_time_s, &recording.r, &recording.y, &recording.u),
        (1.0, &vec![1.0; 3], &vec![2.5, 2.25, 2.5], &vec![3.0; 3]),
        "{:?}",
        String::from_utf8_lossy(bytes)
    );
    recording
}

#[test]
fn every_shape_of_text_is_read() {
    let rows = "0,1,2.5,3\n1,1,2.25,3\n2,1,2.5,3\n";
    for text in [
        // A row of units; two rows below the header; lines before it; comments; trailing separators.
        format!("t,r,y,u\ns,degC,degC,%\n{rows}"),
        format!("t,r,y,u\n[s],[degC],[degC],[%]\nelapsed,wanted,measured,valve\n{rows}"),
        // A line with as many cells before the header, with and without units below it.
        format!("Trend export\nName,Tag,Info,x\nt,r,y,u\n{rows}"),
        format!("Name,Tag,Info,x\nt,r,y,u\ns,degC,degC,%\n{rows}"),
        format!("Name;Tag;Info;x\nTime;SP;PV;OP\n[s];[degC];[degC];[%]\n;Avg;Avg;Smp\n{}", rows.replace(',', ";")),
        // More lines before the header than a screen.
        format!("{}t,r,y,u\n{rows}", "# one of the settings of this export\n".repeat(1000)),
        format!("{}t,r,y,u\n{rows}", "Another one of the settings of this export: on\n".repeat(3000)),
        format!("Exported by Logger 3\nStation: A, oven\n\nt,r,y,u\n{rows}"),
        format!("Device;Oven 3\nSerial;1234\nt,r,y,u\n{rows}"),
        format!("# made by hand\n# in May\nt,r,y,u\n{rows}"),
        format!("% t, r, y, u\n{rows}"),
        format!("# t,r,y,u\n{rows}"),
        "t,r,y,u\n0,1,2.5,3\n# the operator left\n1,1,2.25,3\n2,1,2.5,3\n".into(),
        // Blanks and bars.
        "  t   r     y  u\n  0   1  2.50  3\n  1   1  2.25  3\n  2   1  2.50  3\n".into(),
        "t r y u\n0 1 2,5 3\n1 1 2,25 3\n2 1 2,5 3\n".into(),
        "t\t r\t y\t u\n0\t1\t2.5\t3\n1\t1\t2.25\t3\n2\t1\t2.5\t3\n".into(),
        "t|r|y|u\n0|1|2.5|3\n1|1|2.25|3\n2|1|2.5|3\n".into(),
        // Date and time in two columns, or one name for both, in blanks.
        "Date,Time,SP,PV,OP\n2024-05-31,23:59:58,1,2.5,3\n2024-05-31,23:59:59,1,2.25,3\n2024-06-01,00:00:00,1,2.5,3\n".into(),
        "Datum;Uhrzeit;Soll;Ist;Stellwert\n31.05.2024;23:59:58;1;2,5;3\n31.05.2024;23:59:59;1;2,25;3\n\
         01.06.2024;00:00:00;1;2,5;3\n"
            .into(),
        "Timestamp SP PV OP\n2024-05-31 23:59:58 1 2.5 3\n2024-05-31 23:59:59 1 2.25 3\n2024-06-01 00:00:00 1 2.5 3\n"
            .into(),
        // Dates of both kinds: the file decides.
        "Time,SP,PV,OP\n5/31/2024 11:59:58 PM,1,2.5,3\n5/31/2024 11:59:59 PM,1,2.25,3\n6/1/2024 12:00:00 AM,1,2.5,3\n".into(),
        "Time,SP,PV,OP\n31/05/2024 23:59:58,1,2.5,3\n31/05/2024 23:59:59,1,2.25,3\n01/06/2024 00:00:00,1,2.5,3\n".into(),
        "Time,SP,PV,OP\n05/01/2024 23:59:58,1,2.5,3\n05/01/2024 23:59:59,1,2.25,3\n05/02/2024 00:00:00,1,2.5,3\n".into(),
        // Names in six languages.
        "Zeit;Sollwert;Istwert;Stellgr\u{f6}\u{df}e\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n".into(),
        "Temps;Consigne;Mesure;Commande\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n".into(),
        "Tiempo;Consigna;Medici\u{f3}n;Salida\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n".into(),
        "Tempo;Riferimento;Misura;Uscita\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n".into(),
        "Tempo;Refer\u{ea}ncia;Medi\u{e7}\u{e3}o;Sa\u{ed}da\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n".into(),
        // JSON lines, with a value of its own depth and keys in any order.
        "{\"t\":0,\"r\":1,\"y\":2.5,\"u\":3}\n{\"r\":1,\"t\":1,\"u\":3,\"y\":2.25}\n\n{\"t\":2,\"r\":1,\"y\":2.5,\"u\":3.0}\n".into(),
        "{\"time\": 0, \"loop\": {\"sp\": 1, \"pv\": 2.5, \"op\": 3}}\n{\"time\": 1, \"loop\": {\"sp\": 1, \"pv\": 2.25, \"op\": 3}}\n\
         {\"time\": 2, \"loop\": {\"sp\": 1, \"pv\": 2.5, \"op\": 3}}\n"
            .into(),
    ] {
        is_the_loop(&text, &plain());
        is_the_loop(text.replace('\n', "\r\n"), &plain());
    }
}

#[test]
fn every_encoding_is_read() {
    let text = "Zeit;Sollwert;Istwert [\u{b0}C];Stellgr\u{f6}\u{df}e\n0;1;2,5;3\n1;1;2,25;3\n2;1;2,5;3\n";
    let wide = |bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
    let windows: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    for bytes in [
        text.as_bytes().to_vec(),
        windows,
        wide(u16::to_le_bytes),
        wide(u16::to_be_bytes),
        [b"\xff\xfe".to_vec(), wide(u16::to_le_bytes)].concat(),
    ] {
        assert_eq!(is_the_loop(bytes, &plain()).columns.y, "Istwert [\u{b0}C]");
    }
}

#[test]
fn columns_go_by_their_numbers() {
    let rows = "0,1,2.5,3\n1,1,2.25,3\n2,1,2.5,3\n";
    let recording = is_the_loop(rows, &columns("t=1,r=2,y=3,u=4"));
    assert_eq!(recording.quality.notes, ["there is no header: columns go by their numbers"]);
    is_the_loop(format!("t,r,y,u\n{rows}"), &columns("r=2,y=3,u=4"));
    is_the_loop(format!("a,b,c,d\n{rows}"), &columns("t=1,r=2,y=3,u=4"));
    // The unit of a row of units counts.
    is_the_loop("t,r,y,u\nms,-,-,-\n0,1,2.5,3\n1000,1,2.25,3\n2000,1,2.5,3\n", &plain());
}

#[test]
fn what_was_passed_over_is_told() {
    let notes = |text: &str| read(text, &plain()).unwrap().quality.notes;
    assert_eq!(
        notes("Oven 3\n\nt,r,y,u\ns,C,C,%\n0,1,2,3\n1,1,2,3\n"),
        ["one line before the header is passed over", "one line below the header is passed over"]
    );
}

#[test]
fn every_error_about_a_column_has_an_example_from_this_file() {
    let message = |text: &str, options: &ReadOptions| read(text, options).unwrap_err().to_string();
    for (text, expected) in [
        (
            "Time,TIC1.SP,TIC1.PV,TIC2.SP,TIC2.PV,valve\n0,1,2,3,4,5\n1,1,2,3,4,5\n",
            "x.csv:1: 'TIC1.SP' and 'TIC2.SP' could both be r; --columns t=Time,r=TIC1.SP,y=TIC1.PV,u=valve",
        ),
        (
            "a b,c,\"d, e\"\n0,1,2\n1,1,2\n",
            "x.csv:1: no column 't' for t; like --columns \"t=a b,y=c,u=3\" or --sample-time S; the columns are a b, c, d, e",
        ),
        (
            "0,1,2\n1,1,2\n",
            "x.csv:1: the first line holds numbers; a header that names the columns, or --columns t=1,y=2,u=3",
        ),
    ] {
        assert_eq!(message(text, &plain()), expected);
    }
    // The example works.
    read("a b,c,\"d, e\"\n0,1,2\n1,1,2\n", &columns("t=a b,y=c,u=3")).unwrap();
    let text = "Time,TIC1.SP,TIC1.PV,TIC2.SP,TIC2.PV,TIC1.OP,TIC2.OP\n0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n";
    assert_eq!(
        read(text, &columns("y=TIC2.PV")).unwrap().columns.labels(),
        ["r (TIC2.SP)", "y (TIC2.PV)", "u (TIC2.OP)"]
    );
}

#[test]
fn a_date_that_could_be_two_is_asked_for() {
    let text = "t,r,y,u\n05/01/2024 12:00,1,2,3\n07/01/2024 12:00,1,2,3\n";
    assert_eq!(
        read(text, &plain()).unwrap_err().to_string(),
        "x.csv:3: '07/01/2024 12:00' in column 't' could have the day or the month first; --dates day-first (7 January \
         2024) or --dates month-first (1 July 2024)"
    );
    let days = |order: &str| {
        let options = ReadOptions { date_order: Some(order.parse().unwrap()), ..plain() };
        read(text, &options).unwrap().sample_time_s / 86_400.0
    };
    assert_eq!((days("day-first"), days("month-first")), (2.0, 61.0));
}

#[test]
fn a_loop_without_a_reference_is_taken_to_be_at_rest() {
    for text in ["t,y,u\n0,2,3\n1,2.5,3\n2,2.25,3\n", "t,r,y,u\n0,,2,3\n1,,2.5,3\n2,,2.25,3\n"] {
        let recording = read(text, &plain()).unwrap();
        assert_eq!(recording.r, [2.25; 3]);
        assert_eq!(recording.state, [RowState::Valid; 3]);
        let said = recording.quality.notes.join("\n");
        assert!(
            said.contains("the controller is taken to hold 2.25, the median of y at the beginning"),
            "{said}"
        );
    }
    let stated = read("t,r,y,u\n0,7,2,3\n1,7,2.5,3\n2,7,2.25,3\n", &columns("r=")).unwrap();
    assert_eq!(stated.r, [2.25; 3]);
    // A name that is given and not there is a mistake.
    assert!(
        read("t,y,u\n0,2,3\n1,2,3\n", &columns("r=SP"))
            .unwrap_err()
            .to_string()
            .contains("no column 'SP' for r")
    );
}

#[test]
fn a_repeated_time_stamp_is_refused_or_merged() {
    let text = "t,r,y,u\n0,1,2,3\n1,1,4,3\n1,1,,5\n1,1,6,7\n2,1,2,3\n2,1,8,3\n";
    let with = |repeated: Repeated| read(text, &ReadOptions { repeated, ..plain() });
    assert_eq!(
        with(Repeated::Refuse).unwrap_err().to_string(),
        "x.csv:4: the time 1 s again, with other values; --repeated first, last or mean"
    );
    let of = |repeated| {
        let recording = with(repeated).unwrap();
        assert_eq!(recording.sample_time_s, 1.0);
        (recording.y, recording.u)
    };
    assert_eq!(of(Repeated::First), (vec![2.0, 4.0, 2.0], vec![3.0; 3]));
    assert_eq!(of(Repeated::Last), (vec![2.0, 6.0, 8.0], vec![3.0, 7.0, 3.0]));
    assert_eq!(of(Repeated::Mean), (vec![2.0, 5.0, 5.0], vec![3.0, 5.0, 3.0]));
    let told = with(Repeated::Mean).unwrap().quality.notes;
    assert_eq!(told, ["3 rows repeat a time stamp: their mean counts"]);
}

#[test]
fn manual_stretches_are_found_and_told() {
    use RowState::{Manual, Valid};
    for (name, values, expected) in [
        ("MODE", ["AUTO", "MAN", "CAS"], [Valid, Manual, Valid]),
        ("AUTO/MAN", ["A", "M", "A"], [Valid, Manual, Valid]),
        ("TIC1.Mode", ["Auto", "Manual", ""], [Valid, Manual, Valid]),
        ("Betriebsart", ["Automatik", "Hand", "Automatik"], [Valid, Manual, Valid]),
        ("Quality", ["GOOD", "BAD", "GOOD"], [Valid, Manual, Valid]),
        ("auto", ["1", "0", "1"], [Valid, Manual, Valid]),
        ("manual", ["0", "1", "0"], [Valid, Manual, Valid]),
        ("comment", ["a", "MAN", "b"], [Valid; 3]),
    ] {
        let [a, b, c] = values;
        let text = format!("t,r,y,u,{name}\n0,1,2,3,{a}\n1,1,2,3,{b}\n2,1,2,3,{c}\n");
        let recording = read(&text, &plain()).unwrap();
        assert_eq!(recording.state, expected, "{name}");
        let told = recording.quality.notes.join("\n").contains(&format!("rows where '{name}' says"));
        assert_eq!(told, expected != [Valid; 3], "{name}");
        let always = ReadOptions { when: vec!["always".parse().unwrap()], ..plain() };
        assert_eq!(read(&text, &always).unwrap().state, [Valid; 3]);
    }
}

/// A mode in numbers: by hand u stays put, under the law it moves in every row. What comes later than the first 10 000 rows is not
/// known to be a closed loop.
#[test]
fn modes_in_numbers_are_read_off_u() {
    let rows = |count: usize, mode: &dyn Fn(usize) -> usize| {
        let mut text = String::from("t,r,y,u,LOOP MODE\n");
        let mut u = 0.0;
        for i in 0..count {
            if mode(i) == 1 || i % 100 == 0 {
                u = 50.0 + 20.0 * (0.3 * i as f64).sin();
            }
            text += &format!("{i},1,2,{u},{}\n", mode(i));
        }
        text
    };
    let manual = |recording: &Recording| recording.state.iter().filter(|s| **s == RowState::Manual).count();
    let told = |recording: &Recording| recording.quality.notes.join("\n");
    let by_hand = read(rows(900, &|i| usize::from(!(300..500).contains(&i))), &plain()).unwrap();
    assert_eq!(manual(&by_hand), 200);
    assert!(
        told(&by_hand).contains("rows where 'LOOP MODE' is 0 don't count, where u stays put"),
        "{}",
        told(&by_hand)
    );
    let later = read(rows(12_000, &|i| if i < 11_000 { 1 } else { 7 }), &plain()).unwrap();
    assert_eq!(manual(&later), 1000);
    assert!(told(&later).contains("rows where 'LOOP MODE' is 7 don't count"), "{}", told(&later));
    // Codes in which u moves alike are left to the user.
    let alike =
        read(rows(900, &|_| 1).replace(",1\n", ",3\n").replacen(",3\n", ",2\n", 450), &plain()).unwrap();
    assert_eq!(manual(&alike), 0);
    assert!(told(&alike).contains("u does not show which of them is a closed loop"), "{}", told(&alike));
    let asked = ReadOptions { when: vec!["LOOP MODE=3".parse().unwrap()], ..plain() };
    let asked = read(rows(900, &|i| if i < 450 { 2 } else { 3 }), &asked).unwrap();
    assert_eq!(manual(&asked), 450);
}

/// Units stand below the names, or behind them in brackets; an unknown plant whose y is a temperature is no motor.
#[test]
fn the_units_of_the_columns_are_those_of_the_loop() {
    let rows = |names: &str| {
        let row = |k: usize| format!("{k},{},{},{}\n", 50 + k / 40 % 2, 50.0 + (k % 7) as f64 * 0.1, k % 5);
        format!("{names}\n{}", (0..200).map(row).collect::<String>())
    };
    let units = |names: &str| {
        let recording = read(rows(names), &plain()).unwrap();
        let units = drift_sim::init::with_law_alone(&recording).unwrap().units;
        [units.r, units.y, units.u].map(Option::unwrap_or_default)
    };
    assert_eq!(units("t,SP [degC],PV [degC],OP (%)"), ["degC", "degC", "%"]);
    assert_eq!(units("t,r,y,u\ns,bar,bar,%"), ["bar", "bar", "%"]);
    assert_eq!(units("t,r,y,u"), ["", "", ""]);
}

/// Two heaters and their laws in one log of a 3D printer, shaped as the firmware Klipper writes it.
#[test]
fn a_printers_log_holds_its_heaters_and_their_law() {
    let mut log = String::from(
        "Starting Klippy...\n===== Config file =====\n[extruder]\ncontrol = pid\npid_kp = 25.5\npid_ki = 2.55\npid_kd = 51\n\
         max_power = 0.8\n\n[heater_bed]\ncontrol = watermark\n=======================\n",
    );
    for k in 0..50 {
        log += &format!(
            "Stats {k}.1: gcodein=0  mcu: mcu_awake=0.002 freq=71999437 heater_bed: target=60 temp={}.5 pwm=0.250  \
             sysload=3.49 print_time=75.906 extruder: target=200 temp=199.{} pwm=0.500\n",
            59 + k % 2,
            k % 10
        );
        log += "Some other line of the log\n";
    }
    let recording = read(&log, &plain()).unwrap();
    assert_eq!((recording.len(), recording.sample_time_s), (50, 1.0));
    assert_eq!(recording.columns.labels(), ["r (extruder.target)", "y (extruder.temp)", "u (extruder.pwm)"]);
    assert_eq!((recording.r[3], recording.y[3], recording.u[3]), (200.0, 199.3, 0.5));
    let said = recording.quality.notes.join("\n");
    assert!(said.contains("pid, kp = 0.1000, ki = 0.01000, kd = 0.2000, u_min = 0, u_max = 0.8"), "{said}");
    assert!(said.contains("the heaters are extruder, heater_bed; this is extruder"), "{said}");
    let Some(Controller::Pid(law)) = &recording.stated_law else { panic!("{:?}", recording.stated_law) };
    assert_eq!((law.kp, law.kd, law.limits), (0.1, 0.2, Limits { u_min: 0.0, u_max: 0.8 }));
    assert!((law.ki - 0.01).abs() < 1e-15, "{}", law.ki);
    assert_eq!(recording.units.y.as_deref(), Some("degC"));
    let bed = read(&log, &columns("y=heater_bed.temp")).unwrap();
    assert_eq!((bed.r[0], bed.y[1], bed.u[0]), (60.0, 60.5, 0.25));
}

/// A blackbox log as its description (betaflight.com, "Blackbox internals") states it: a header in text, then frames of
/// numbers in seven bits a byte.
#[cfg(feature = "blackbox")]
fn blackbox(frames: u32) -> Vec<u8> {
    let fields = "loopIteration,time,axisP[0],axisI[0],axisD[0],setpoint[0],gyroADC[0]";
    let mut log = format!(
        "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\nH Field I name:{fields}\n\
         H Field I signed:0,0,1,1,1,1,1\nH Field I predictor:0,0,0,0,0,0,0\nH Field I encoding:1,1,0,0,0,0,0\n\
         H Field P predictor:6,2,1,1,1,1,1\nH Field P encoding:9,0,0,0,0,0,0\nH Field S name:flightModeFlags\n\
         H Field S signed:0\nH Field S predictor:0\nH Field S encoding:1\nH Firmware type:Cleanflight\n\
         H Firmware revision:Betaflight 4.2.11 (948ba6339) STM32F7X2\nH I interval:1\nH P interval:1\nH P ratio:1\n\
         H minthrottle:1070\nH maxthrottle:2000\nH gyro_scale:0x3f800000\nH motorOutput:158,2047\nH acc_1G:2048\n\
         H vbatref:2466\nH looptime:125\n\
         H debug_mode:0\nH motor_pwm_protocol:6\nH features:541130760\nH fields_disabled_mask:0\n"
    )
    .into_bytes();
    let number = |log: &mut Vec<u8>, mut value: u32| {
        while value > 127 {
            log.push(value as u8 | 0x80);
            value >>= 7;
        }
        log.push(value as u8);
    };
    let signed = |log: &mut Vec<u8>, value: i32| number(log, ((value << 1) ^ (value >> 31)).cast_unsigned());
    for k in 0..frames {
        log.push(b'I');
        number(&mut log, k);
        number(&mut log, 7_000_000 + k * 1000);
        let k = k.cast_signed();
        for value in [k % 50, -(k % 7), 3, 100, 100 - k % 5] {
            signed(&mut log, value);
        }
    }
    log.extend(b"E\xffEnd of log\0");
    log
}

#[cfg(feature = "blackbox")]
#[test]
fn a_blackbox_holds_the_rate_loop_of_an_axis() {
    let recording = read(blackbox(500), &plain()).unwrap();
    assert_eq!((recording.len(), recording.sample_time_s, recording.start_s), (500, 0.001, 0.0));
    assert_eq!(recording.columns.labels(), ["r (setpoint[0])", "y (gyroADC[0])", "u (pid[0])"]);
    for k in [0_usize, 1, 99, 499] {
        let [p, i] = [k % 50, k % 7].map(|x| x as f64);
        assert_eq!((recording.r[k], recording.u[k]), (100.0, p - i + 3.0), "{k}");
        // The library scales the gyroscope in single precision.
        let y = recording.y[k];
        assert!((y - (100.0 - (k % 5) as f64)).abs() < 1e-5, "{k}: {y}");
    }
    assert!(recording.quality.notes.iter().any(|note| note.contains("the rate loop of the roll axis")));
    // Cut off anywhere and with any byte flipped it is a recording or one line.
    let whole = blackbox(20);
    for at in 0..whole.len() {
        let _ = read(&whole[..at], &plain());
        let mut flipped = whole.clone();
        flipped[at] ^= 0x55;
        if let Err(error) = read(flipped, &plain()) {
            assert_eq!(error.to_string().lines().count(), 1);
        }
    }
}
