//! Calls cargo and QEMU.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::image::panics;
use crate::targets::{BUILD, M0, M4F, Target};

/// Runs a command to its end; its standard output, or an error with its standard error.
pub fn run(command: &mut Command) -> Result<Vec<u8>> {
    let output = command.output().with_context(|| format!("{command:?}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let out = String::from_utf8_lossy(&output.stdout);
        bail!("{command:?} failed ({}):\n{said}{out}", output.status);
    }
    Ok(output.stdout)
}

fn cargo(arguments: &[&str]) -> Result<()> {
    run(Command::new("cargo").args(arguments)).map(drop)
}

/// Where cargo puts what it builds.
pub fn target_dir() -> PathBuf {
    let given = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
    std::path::absolute(&given).unwrap_or(given)
}

/// The linked image of a program.
pub fn image(target: &Target, program: &str) -> PathBuf {
    target_dir().join(target.triple).join("release").join(program)
}

/// drift-core on every target in every combination of features that makes sense.
pub fn library_everywhere() -> Result<()> {
    let combinations =
        ["libm", "libm,defmt", "libm,serde", "libm,defmt,serde", "micromath", "micromath,defmt,serde"];
    for target in BUILD {
        for features in combinations {
            cargo(&[
                "check",
                "--quiet",
                "--release",
                "--manifest-path",
                "../../drift-core/Cargo.toml",
                "--no-default-features",
                "--features",
                features,
                "--target",
                target,
            ])
            .with_context(|| format!("drift-core with {features} on {target}"))?;
        }
        println!("builds    drift-core on {target}, {} combinations of features", combinations.len());
    }
    Ok(())
}

/// The programs that run in QEMU.
pub fn programs(target: &Target) -> Result<()> {
    let packages = ["build", "--quiet", "--release", "-p", "pi_loop", "-p", "replay", "-p", "probe"];
    cargo(&[&packages[..], &["--target", target.triple]].concat())?;
    let archives = crate::c_interface::monitors(target)?;
    run(Command::new("cargo")
        .args(["build", "--quiet", "--release", "-p", "probe_c", "--target", target.triple])
        .env("DRIFT_C_FOLDER", archives))
    .map(drop)
}

/// The probes with the checks on that a release leaves out: freedom from panics must not rest on them being off.
pub fn overflow_checks() -> Result<()> {
    let folder = target_dir().join("overflow_checks");
    for target in [M4F, M0] {
        // The target's own flags are not added to those of the environment.
        run(Command::new("cargo")
            .args(["build", "--quiet", "--release", "-p", "probe", "--target", target.triple])
            .env("RUSTFLAGS", "-C link-arg=-Tlink.x -C overflow-checks=on")
            .arg("--target-dir")
            .arg(&folder))?;
        let release = folder.join(target.triple).join("release");
        for (program, without, _) in crate::probe::PROBES {
            let (with, without) = (panics(&release.join(program))?, panics(&release.join(without))?);
            let ours: Vec<&String> = with.iter().filter(|name| !without.contains(name)).collect();
            if !ours.is_empty() {
                bail!("{program} on {} with overflow checks: {ours:?}", target.core);
            }
            let owner = calls_panic(&release.join(program))?;
            if !owner.is_empty() {
                bail!("{program} on {} with overflow checks: a panic in {}", target.core, owner.join(", "));
            }
        }
        println!("checked   overflow checks on, {}: no function of drift-core holds a panic", target.core);
    }
    Ok(())
}

/// Functions of drift-core that call the panic machinery, by the disassembly.
fn calls_panic(image: &std::path::Path) -> Result<Vec<String>> {
    let text = run(Command::new("arm-none-eabi-objdump").args(["-d", "-C"]).arg(image))?;
    let text = String::from_utf8_lossy(&text);
    let (mut inside, mut found) = ("", Vec::new());
    for line in text.lines() {
        if let Some((_, name)) = line.split_once(" <").filter(|_| line.ends_with(">:")) {
            inside = name;
        } else if line.contains("panicking") && inside.starts_with("drift_core") {
            found.push(inside.trim_end_matches(">:").to_string());
        }
    }
    Ok(found)
}

/// The example for a real board.
pub fn real_board() -> Result<()> {
    cargo(&["build", "--quiet", "--release", "-p", "rtic_stm32", "--target", "thumbv7em-none-eabihf"])?;
    println!("builds    rtic_stm32 for the STM32F411");
    Ok(())
}

/// Runs an image to its end; what it wrote.
pub fn emulate(target: &Target, image: &std::path::Path) -> Result<Vec<u8>> {
    run(Command::new("timeout")
        .args(["120", "qemu-system-arm", "-M", target.machine, "-nographic", "-icount", "shift=10"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(target_dir()))
}
