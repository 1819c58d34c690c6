//! What a loop file may say, and what is said to one that says something else.

use proptest::prelude::*;

use crate::control_loop::Loop;

const SERVO: &str = r#"# a servo
[loop]
sample_time_s = 0.001

[units]
y = "m"
force = "N"

[controller]
kind = "p-velocity"
kp = 160.18
kv = 243.45
velocity = "mean2"
u_min = -10
u_max = 10.0

[plant]
kind = "servo"
output = "position"
inertia = 95.1
viscous = 203.5
actuator_gain = 35.15065

[[inputs]]
column = "pulse"
enters = "actuator"
gain = 1.0139

[[physics]]
kind = "coulomb_friction"
level = 20.4
onset_s = 1.5

[[physics]]
kind = "injected_signal"
level = 2.0
spans = [[1.0, 2.0], [4.0, 5.5]]
"#;

const OTHERS: [&str; 5] = [
    "[loop]\nsample_time_s = 1\n[sensor]\nnoise = 0.1\n[controller]\nkind = \"pid\"\nkp = 1\nki = 0.1\nkd = 2\nderivative_filter_s = 0.5\nanti_windup = false\n[plant]\nkind = \"first-order\"\ngain = 0.8\ntime_constant_s = 20\ndelay_s = 2.5\noffset = 21",
    "[loop]\nsample_time_s = 1e-3\n[controller]\nkind = \"pi\"\nkp = 300\nki = 100\n[plant]\nkind = \"state-space\"\na = [[-0.2, 2.0, 0.0], [-2.0, -0.2, 0.0], [0.0, 0.0, -0.5]]\nb = [[1.0], [0.0], [0.0]]\nc = [[1.0, 0.0, 0.0]]\nd = [[0.0]]",
    "[loop]\nsample_time_s = 1\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"transfer-function\"\nnum = [1]\nden = [1, 2, 3]\ndelay_s = 0.1",
    "[loop]\nsample_time_s = 1\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"tank\"\narea = 2\ninflow_gain = 1\noutflow = 0.5",
    "[loop]\nsample_time_s = 60\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n[[inputs]]\ncolumn = \"t_in\"\nminus = \"y\"\ntimes = \"flow\"\nenters = \"load\"\ngain = \"identify\"",
];

#[test]
fn what_is_written_reads_back_the_same() {
    for text in OTHERS.iter().chain([&SERVO]) {
        let model = Loop::parse(text, "a.toml").unwrap();
        assert_eq!(Loop::parse(&model.to_toml(), "b.toml").unwrap(), model, "{}", model.to_toml());
    }
    assert_eq!(Loop::parse(&Loop::paper().to_toml(), "paper").unwrap(), Loop::paper());
}

#[test]
fn values_arrive_where_they_belong() {
    let model = Loop::parse(SERVO, "a.toml").unwrap();
    assert_eq!(model.controller.limits().u_min, -10.0);
    assert_eq!(model.plant.drive_gain(), 35.15065);
    assert_eq!(model.physics[0].value("level"), Some(20.4));
    assert_eq!(model.physics[0].onset_s, 1.5);
    assert_eq!(model.physics[1].spans, [(1.0, 2.0), (4.0, 5.5)]);
    assert_eq!(model.inputs[0].column, "pulse");
}

#[test]
fn a_gain_to_be_identified_can_not_be_simulated() {
    let text = SERVO.replacen("gain = 1.0139", "gain = \"identify\"", 1);
    let model = Loop::parse(&text, "a.toml").unwrap();
    let error = crate::simulate::Simulation::new(&model, 0).err().unwrap().to_string();
    assert!(error.contains("'pulse' is still to be identified") && !error.contains('\n'), "{error}");
}

/// Each fault: what is replaced by what, the line, and a word that the message must hold.
#[test]
fn every_fault_has_its_line_and_what_is_allowed() {
    let faults = [
        ("kp = 160.18", "kpp = 160.18", 11, "unknown key 'kpp' in [controller]; allowed: kind, kp, kv"),
        ("kp = 160.18", "kp = \"high\"", 11, "kp is \"high\"; kp must be a finite number"),
        ("kp = 160.18\n", "", 9, "[controller] lacks the key 'kp'"),
        ("kp = 160.18", "kp = nan", 11, "kp is nan"),
        ("sample_time_s = 0.001", "sample_time_s = -0.001", 3, "must be a finite number > 0"),
        ("sample_time_s = 0.001", "sample_time_s = 0", 3, "must be a finite number > 0"),
        ("kind = \"p-velocity\"", "kind = \"p\"", 10, "\"pi\", \"pid\", \"p-velocity\", \"recorded\""),
        ("velocity = \"mean2\"", "velocity = \"mean3\"", 13, "\"backward\", \"mean2\""),
        ("u_max = 10.0", "u_max = -10", 14, "u_min must be below u_max"),
        ("kind = \"servo\"", "kind = \"motor\"", 18, "\"servo\", \"first-order\""),
        ("inertia = 95.1", "inertia = 0.0", 20, "inertia must be a finite number > 0"),
        ("enters = \"actuator\"", "enters = \"valve\"", 26, "\"actuator\", \"load\", \"sensor\""),
        ("\"coulomb_friction\"", "\"rust\"", 30, "coulomb_friction, stribeck_friction"),
        ("level = 20.4", "level = -20.4", 31, "level must be a finite number >= 0"),
        ("level = 20.4", "levels = 20.4", 31, "allowed: kind, level, onset_s"),
        ("onset_s = 1.5", "onset_s = -1", 32, "onset_s must be"),
        ("\"coulomb_friction\"\nlevel", "\"radiation\"\ncoefficient", 29, "can't act on a servo plant"),
        ("[[1.0, 2.0], [4.0, 5.5]]", "[[2.0, 1.0]]", 37, "0 <= from < to"),
        ("spans = [[1.0, 2.0], [4.0, 5.5]]\n", "", 34, "needs spans"),
        ("[units]", "[unit]", 5, "loop, units, controller, plant, sensor, inputs, physics"),
        ("y = \"m\"", "y = 3", 6, "text in quotes"),
        ("y = \"m\"", "y = \"m", 6, "not TOML"),
        ("gain = 1.0139", "gain = inf", 27, "gain must be a finite number"),
        ("gain = 1.0139", "gain = \"find\"", 27, "gain must be a number or \"identify\""),
        ("gain = 1.0139", "times = 3", 27, "text in quotes"),
        (
            "enters = \"actuator\"\ngain = 1.0139",
            "enters = \"sensor\"\ngain = \"identify\"",
            27,
            "only inputs at the actuator and at the load are identified",
        ),
    ];
    for (old, new, line, word) in faults {
        let text = SERVO.replacen(old, new, 1);
        assert_ne!(text, SERVO, "{old}");
        let message = Loop::parse(&text, "a.toml").expect_err(new).to_string();
        assert!(message.starts_with(&format!("a.toml:{line}: ")) && message.contains(word), "{message}");
    }
}

#[test]
fn matrices_must_fit_each_other() {
    for (old, new, word) in [
        ("[-2.0, -0.2, 0.0], ", "", "not square"),
        ("[[1.0], [0.0], [0.0]]", "[[1.0], [0.0]]", "3 numbers"),
        ("[[1.0], [0.0], [0.0]]", "[[1.0, 2.0], [0.0, 1.0], [0.0, 1.0]]", "list of finite numbers"),
        ("[[1.0, 0.0, 0.0]]", "[]", "list of finite numbers"),
        ("d = [[0.0]]", "d = [[0.0, 1.0]]", "one number"),
    ] {
        let message = Loop::parse(&OTHERS[1].replacen(old, new, 1), "a.toml").unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    assert!(Loop::parse(&OTHERS[1].replace("d = [[0.0]]", "d = 0.5"), "a.toml").is_ok());
    let inline = "loop = { sample_time_s = 1 }\ncontroller = { kind = \"recorded\" }\nplant = { kind = \"state-space\", a = [[-1]], b = 2, c = 3, d = 4 }";
    let crate::plant::Plant::StateSpace(plant) = Loop::parse(inline, "a.toml").unwrap().plant else {
        panic!()
    };
    assert_eq!((plant.b, plant.c, plant.d), (vec![2.0], vec![3.0], 4.0));
    assert!(Loop::parse(&OTHERS[2].replace("num = [1]", "num = [1, 2, 3, 4]"), "a.toml").is_err());
    assert!(Loop::parse(&OTHERS[2].replace("den = [1,", "den = [0,"), "a.toml").is_err());
}

proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(text in "\\PC{0,200}") {
        let _ = Loop::parse(&text, "a.toml");
    }

    /// A valid file with a piece cut out, doubled or overwritten; what still reads must also build and step.
    #[test]
    fn no_mutation_makes_reader_or_simulation_panic(
        which in 0..5_usize, from in 0..700_usize, length in 0..40_usize, piece in "[-0-9a-z_=\\[\\]\". \n]{0,12}"
    ) {
        let text = OTHERS.get(which).copied().unwrap_or(SERVO);
        let from = from.min(text.len());
        let to = (from + length).min(text.len());
        let mutated = format!("{}{piece}{}", &text[..from], &text[to..]);
        if let Ok(model) = Loop::parse(&mutated, "a.toml") {
            prop_assert_eq!(&Loop::parse(&model.to_toml(), "b.toml").unwrap(), &model);
            if let Ok(mut simulation) = crate::simulate::Simulation::new(&model, 0) {
                for _ in 0..20 {
                    simulation.step(1.0, &[1.0]);
                }
            }
        }
    }
}
