//! All tests of the crates together: the core driven by the simulator, the paper's results, the book, real recordings. One program, because each would be linked
//! with all of drift-sim; one file is run by `cargo test -p drift-tests --test all FILE::`.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests fail by panicking, their own functions too"
)]

mod book;
mod book_commands;
mod command;
mod core_channels;
mod core_commissioning;
mod core_decision;
mod core_hostile_samples;
mod core_memory_commissioning;
mod core_memory_promise;
mod core_operating_point;
mod core_precision;
mod core_run_length;
mod core_samples;
mod core_sizes;
mod core_slices;
mod core_state;
mod firmware_costs;
mod kinds_snapshot;
mod packages;
mod paper;
mod real_diagnosis;
mod real_recordings;

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
