//! A kind of channel is one file and one row: everything else follows from the table.

use std::path::{Path, PathBuf};

use drift_core::{ChannelKind, Decision, Index, Indices, Location};
use drift_sim::baseline_file::{BaselineFile, ChannelEntry, Provenance, Samples, Timing};
use drift_sim::report::axis_names;

const INDICES: [Index; 4] = [Index::Iae, Index::Ise, Index::Itae, Index::Itse];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every kind, with every index where it has one.
fn kinds() -> Vec<ChannelKind> {
    let all = ChannelKind::ROWS.iter().flat_map(|row| INDICES.map(|index| row.kind.with_index(index)));
    all.enumerate().filter(|(i, kind)| kind.index().is_some() || i % 4 == 0).map(|(_, kind)| kind).collect()
}

/// A baseline file with the kind at its place, and the first kinds at the others.
fn file(kind: ChannelKind) -> BaselineFile {
    let at = |place: usize| {
        let row = ChannelKind::ROWS.iter().find(|row| row.meaning.place == place).unwrap();
        ChannelEntry::unlearned(if kind.meaning().place == place { kind } else { row.kind })
    };
    BaselineFile {
        timing: Timing { sample_time_s: 0.001, block_ticks: 250, window_blocks: 12, hop_blocks: 12 },
        samples: Samples { min_valid: 0.5, saturation: None, blanking: None },
        decision: Decision::DEFAULT,
        promise: None,
        operating_point: None,
        calibration: Provenance { files: Vec::new(), windows: 0, effective_windows: 0.0 },
        channels: [0, 1, 2].map(at),
    }
}

#[test]
fn every_kind_goes_through_files_exports_and_the_header() {
    let header = std::fs::read_to_string(root().join("drift-core/c/include/drift.h")).unwrap();
    assert_eq!(kinds().len(), ChannelKind::ROWS.len() + 3);
    for kind in kinds() {
        let file = file(kind);
        let text = file.to_toml();
        let name = kind.name();
        assert!(text.contains(&format!("kind = \"{name}\"")), "{name}: {text}");
        let read = BaselineFile::parse(&text, "b.toml").unwrap();
        assert_eq!(read.channels, file.channels, "{name}");
        assert_eq!(ChannelKind::named(name).unwrap().with_index(kind.index().unwrap_or(Index::Iae)), kind);
        assert!(
            file.to_rust_const()
                .contains(&format!("drift_core::ChannelKind::{kind:?}").replace("(", "(drift_core::Index::"))
        );
        let named = format!("DRIFT_{}", name.to_uppercase());
        assert!(file.to_c_initialiser().contains(&named), "{name}");
        assert!(header.contains(&format!("#define {named} {}\n", kind.number())), "{name}: not in drift.h");
    }
}

/// Numbers of saved configurations and of C must not change.
#[test]
fn numbers_are_those_of_earlier_versions() {
    let numbers = ChannelKind::ROWS.iter().map(|row| (row.name, row.kind.number())).collect::<Vec<_>>();
    let earlier = [("energy_error", 0), ("effort", 1), ("motion_effort", 2), ("activity", 3)];
    assert_eq!(numbers[..4], earlier);
    for row in ChannelKind::ROWS {
        assert_eq!(ChannelKind::numbered(row.kind.number()), Some(row.kind));
    }
    assert_eq!(ChannelKind::numbered(ChannelKind::ROWS.len() as u32), None);
}

/// Each compares two numbers of its own, lies somewhere of its own and says so.
#[test]
fn kinds_differ_in_what_they_compare_and_say() {
    let indices = Indices {
        e_u: 1.0,
        iae: 2.0,
        ise: 3.0,
        itae: 4.0,
        itse: 5.0,
        mean_u: 6.0,
        mean_y: 7.0,
        mean_e: 8.0,
        peak_u: 9.0,
        peak_e: 10.0,
        reference_activity: 11.0,
        motion_effort: 12.0,
        speed: 13.0,
    };
    let kinds = kinds();
    for (i, a) in kinds.iter().enumerate() {
        let (x, value) = a.coordinates(&indices);
        assert!(x.is_finite() && value.is_finite());
        for b in &kinds[i + 1..] {
            assert_ne!((x, value), b.coordinates(&indices), "{a:?} {b:?}");
            assert_ne!(axis_names(*a), axis_names(*b), "{a:?} {b:?}");
            if a.name() != b.name() {
                assert_ne!(a.location(), b.location(), "{a:?} {b:?}");
            }
        }
        let meaning = a.meaning();
        assert!(meaning.place < 3 && !matches!(a.location(), Location::Nowhere | Location::Several));
        for sentence in [meaning.above, meaning.below, meaning.cause_above, meaning.cause_below] {
            assert!(sentence.len() > 20, "{a:?}: {sentence}");
        }
        if let Some(word) = meaning.chosen_by {
            assert_eq!(ChannelKind::chosen(word), Some(*a));
        }
    }
}

/// The kind that no program singles out is named in its row, in C's number and nowhere else in the sources.
#[test]
fn no_other_source_names_the_kind() {
    let folders = [
        "drift-core/src",
        "drift-core/c/src",
        "drift-sim/src",
        "drift-sim/python/src",
        "drift-sim/fleet/src",
    ];
    let mut named = Vec::new();
    for folder in folders {
        sources(&root().join(folder), &mut |path, text| {
            let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
            if code
                .into_iter()
                .any(|line| line.contains("MotionEffort") || line.contains("DRIFT_MOTION_EFFORT"))
            {
                named.push(path.strip_prefix(root()).unwrap().display().to_string());
            }
        });
    }
    named.sort();
    assert_eq!(named, ["drift-core/c/src/codes.rs", "drift-core/src/channel/kind.rs"]);
}

fn sources(folder: &Path, each: &mut impl FnMut(&Path, &str)) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, each);
        } else if path.extension().is_some_and(|e| e == "rs") {
            each(&path, &std::fs::read_to_string(&path).unwrap());
        }
    }
}
