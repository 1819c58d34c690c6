//! All tests of drift-sim from outside: its library and its command. One program, because each would be linked
//! with all of drift-sim; one file is run by `cargo test -p drift-sim --test all FILE::`.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests fail by panicking, their own functions too"
)]

mod baseline_file;
mod begun_together;
mod beside_friction;
mod calibration;
mod calibration_promise;
mod coming_and_going_load;
mod design_command;
mod diagnose;
mod diagnose_command;
mod diagnose_unknown_motor;
mod effort_families;
mod effort_memory;
mod ewma_run_lengths;
mod far_from_the_first_fit;
mod faults_of_sentences;
mod fleet_command;
mod friction_by_direction;
mod further_searches;
mod hostile_recordings;
mod init;
mod init_real;
mod jumping_load;
mod limit_cycles;
mod look_command;
mod measured_inputs;
mod monitor;
mod monitor_command;
mod noise_since_healthy;
mod operating_point;
mod outputs;
mod plain_rows;
mod plan_command;
mod plot_figures;
mod random_load;
mod recording_dates;
mod recording_exports;
mod recording_formats;
mod recording_gaps;
mod recording_input;
mod recording_real;
mod recording_shapes;
mod recording_torn;
mod refusals;
mod report_pages;
mod rounded_sensor;
mod run_lengths;
mod run_lengths_simulated;
mod sentences;
mod shell_support;
mod side_by_side;
mod simulate_command;
mod stated_offset;
mod swinging_load;
mod unknown_at_rest;

/// A file that is not named above would not run.
#[test]
fn every_file_is_a_module() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let here = include_str!("main.rs");
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if let Some(name) = name.strip_suffix(".rs").filter(|name| *name != "main") {
            assert!(here.contains(&format!("\nmod {name};\n")), "tests/{name}.rs is not in tests/main.rs");
        }
    }
}
