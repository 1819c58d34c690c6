//! The same recording through the host and through the firmware: every word of every report must agree.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use scenario::pi::Pi;
use scenario::plant::{Plant, Reference};
use scenario::words::Words;
use scenario::{
    ALL_F32, ALL_I32, BACK_F32, EVERYTHING_F32, ITAE_F32, ITAE_I32, PAIR_F32, PAIR_I32, SMALLEST_F32,
};

use crate::build::{emulate, image, target_dir};
use crate::image::no_panic;
use crate::targets::Target;

type Sample = [f32; 3];
const COUNTS_PER_UNIT: f32 = 4096.0;

/// 30 000 ticks: a loop that drifts, with samples that must not enter a sum.
fn generated() -> Vec<Sample> {
    let mut pi = Pi { kp: 2.0, ki_ts: 0.02, u_min: -10.0, u_max: 10.0, integral: 0.0 };
    let (mut plant, mut reference) = (Plant::new(11), Reference::new(12));
    (0..30_000u32)
        .map(|tick| {
            let r = reference.at(tick);
            let y = plant.measure();
            let u = pi.tick(r, y);
            plant.drive(u);
            if tick > 15_000 {
                plant.gain = 0.8;
            }
            match tick % 997 {
                5 => [r, f32::NAN, u],
                6 => [r, y, f32::INFINITY],
                7 => [1e30, y, u],
                _ => [r, y, u],
            }
        })
        .collect()
}

/// A real one, where the recordings are.
fn real() -> Result<Option<Vec<Sample>>> {
    let folder = std::env::var_os("DRIFT_RECORDINGS")
        .map_or_else(|| PathBuf::from("../../../shared/recordings"), PathBuf::from);
    let file = folder.join("emps/emps_pulses.csv");
    let Ok(text) = std::fs::read_to_string(&file) else {
        println!("note      no {}: the generated recording alone is compared", file.display());
        return Ok(None);
    };
    let row = |line: &str| -> Option<Sample> {
        let mut fields = line.split(',').skip(1).map(|field| field.trim().parse().ok());
        Some([fields.next()??, fields.next()??, fields.next()??])
    };
    let samples = text.lines().skip(1).map(|line| row(line).with_context(|| line.to_string()));
    samples.collect::<Result<Vec<_>>>().map(Some)
}

/// The script of the probes, without what only an input other than a sample can say.
fn script() -> Vec<Sample> {
    let mut script = scenario::events::Script::new(2000);
    (0..2000 * scenario::events::WINDOWS)
        .map(|_| match script.tick().1 {
            drift_core::Input::Sample { r, y, u } => [r, y, u],
            _ => [f32::NAN; 3],
        })
        .collect()
}

fn counts(samples: &[Sample]) -> Vec<[i32; 3]> {
    let count = |x: f32| if x.is_nan() { i32::MAX } else { (x * COUNTS_PER_UNIT) as i32 };
    samples.iter().map(|s| s.map(count)).collect()
}

fn lines(name: &str, report: &impl Words, out: &mut String) {
    let mut column = 0;
    report.words(&mut |word| {
        if column % 16 == 0 {
            let _ = write!(out, "{}{name}", if column > 0 { "\n" } else { "" });
        }
        let _ = write!(out, " {word:08x}");
        column += 1;
    });
    out.push('\n');
}

/// Without the reset that the target goes through: nothing may show of it.
fn on_host(samples: &[Sample]) -> String {
    let mut out = String::new();
    macro_rules! replay {
        ($samples:expr, $($name:literal: $plan:ident),*) => {
            $(let mut state = $plan.start();
            for &[r, y, u] in $samples {
                if let Some(report) = $plan.tick(&mut state, r, y, u) {
                    lines($name, report, &mut out);
                }
            })*
        };
    }
    replay!(samples, "smallest_f32": SMALLEST_F32, "pair_f32": PAIR_F32, "all_f32": ALL_F32, "back_f32": BACK_F32,
        "everything_f32": EVERYTHING_F32, "itae_f32": ITAE_F32);
    let counts = counts(samples);
    replay!(&counts, "pair_i32": PAIR_I32, "all_i32": ALL_I32, "itae_i32": ITAE_I32);
    out
}

fn write_files(samples: &[Sample], folder: &Path) -> Result<()> {
    let floats: Vec<u8> = samples.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let integers: Vec<u8> = counts(samples).iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(folder.join("recording.bin"), floats)?;
    std::fs::write(folder.join("counts.bin"), integers)?;
    Ok(())
}

/// All recordings on one target.
pub fn compare(target: &Target) -> Result<()> {
    let path = image(target, "replay");
    no_panic(&path)?;
    let recordings = [("generated", Some(generated())), ("script", Some(script())), ("emps_pulses", real()?)];
    for (name, samples) in recordings {
        let Some(samples) = samples else { continue };
        write_files(&samples, &target_dir())?;
        let there = String::from_utf8(emulate(target, &path)?)?;
        let here = on_host(&samples);
        if let Some((a, b)) = here.lines().zip(there.lines()).find(|(a, b)| a != b) {
            bail!("{name} on {}: the host says\n{a}\nand the target\n{b}", target.triple);
        }
        if here.len() != there.len() {
            bail!("{name} on {}: {} bytes here, {} there", target.triple, here.len(), there.len());
        }
        println!(
            "equal     {name}, {} ticks, f32 and i32, on {}: {} words bit for bit",
            samples.len(),
            target.triple,
            here.split_whitespace().filter(|w| w.len() == 8 && !w.contains('_')).count()
        );
    }
    Ok(())
}
