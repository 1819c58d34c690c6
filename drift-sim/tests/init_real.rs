//! What `drift init` reads off recordings of real loops, where they are at hand (`DRIFT_RECORDINGS`): laws that are known
//! come back, and where no law or plant holds it says so.

use std::path::PathBuf;

use drift_sim::controller::{Controller, VelocityRule};
use drift_sim::init::{Proposal, propose};
use drift_sim::plant::Plant;
use drift_sim::recording::{ReadOptions, Recording};

fn proposal(name: &str) -> Option<Proposal> {
    let default = || concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings").into();
    let folder: PathBuf = std::env::var_os("DRIFT_RECORDINGS").map_or_else(default, PathBuf::from);
    let file = folder.join(name);
    if !file.is_file() {
        eprintln!("skipped: no {}", file.display());
        return None;
    }
    let proposal = propose(&Recording::read(&file, &ReadOptions::default()).unwrap()).unwrap();
    println!("{}", proposal.to_toml());
    Some(proposal)
}

#[track_caller]
fn near(found: f64, truth: f64, tolerance: f64) {
    assert!((found - truth).abs() <= tolerance * truth.abs(), "{found} for {truth}");
}

/// The servo's documented cascade: kp = 160.18 1/s, kv = 243.45 V s/m, velocity over two samples.
#[test]
#[ignore = "slow: 25 000 samples are searched twice"]
fn the_servos_cascade_is_found() {
    for name in ["emps/emps_train.csv", "emps/emps_pulses_ctrl.csv"] {
        let Some(proposal) = proposal(name) else { return };
        let Controller::PVelocity(law) = &proposal.model.controller else { panic!("{}", proposal.to_toml()) };
        near(law.kp, 160.18, 1e-3);
        near(law.kv, 243.45, 1e-3);
        assert_eq!(law.velocity, VelocityRule::Mean2);
    }
}

/// The heater's laws: P 33; PI 33 with an integral gain that is 1.3 at the sampling of the file. The heater's own hidden
/// limit leaves no linear plant that follows the recorded u.
#[test]
#[ignore = "slow: 15 000 samples are searched"]
fn the_heaters_laws_are_found_and_its_plant_is_left_open() {
    for (name, ki) in [("p_kp33", 0.0), ("pi_kp33_ki1p23", 1.3)] {
        let Some(proposal) = proposal(&format!("ce103_thermal/{name}.csv")) else { return };
        let Controller::Pi(law) = &proposal.model.controller else { panic!("{}", proposal.to_toml()) };
        near(law.kp, 33.0, 1e-4);
        near(law.ki, ki, 1e-3);
        assert_eq!(proposal.model.plant, Plant::Identify);
    }
}

/// A linear-quadratic controller, an operator's day and a sticking valve: none of them is a law of the loop file.
#[test]
#[ignore = "slow: four recordings are searched"]
fn what_has_no_law_of_the_loop_file_is_recorded() {
    for name in [
        "tclab/sp_reg_cons_ml.csv",
        "ahu/ers_2008-08-19_nofault.csv",
        "stiction_plant/stiction_2411LIC30501_20241018_2155.csv",
        "ce110_servo/pos_sat5.csv",
    ] {
        let Some(proposal) = proposal(name) else { return };
        assert_eq!(proposal.model.controller, Controller::Recorded, "{name}");
        assert!(proposal.to_toml().contains("# No law of the loop file makes the recorded u"), "{name}");
    }
}
