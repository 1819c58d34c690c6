//! What each loop looks like when it is healthy: a folder with one `LOOP.toml` a loop, as `drift calibrate` writes them, so that each can
//! be read, corrected and used by itself.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use drift_sim::baseline_file::BaselineFile;
use drift_sim::{Error, Result};

/// Where a loop's baseline lies. Letters, digits, `.`, `_` and `-` of its name stand as they are, all else as `%` and two hexadecimal
/// digits a byte, so that no two loops share a file and none leaves the folder.
pub fn path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{}.toml", file_stem(name)))
}

/// A loop's name as the name of a file.
pub fn file_stem(name: &str) -> String {
    let mut stem = String::with_capacity(name.len());
    for (at, byte) in name.bytes().enumerate() {
        let plain = byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-') || (byte == b'.' && at > 0);
        if plain {
            stem.push(char::from(byte));
        } else {
            // Writing to a String can't fail.
            let _ = write!(stem, "%{byte:02X}");
        }
    }
    stem
}

/// A loop's baseline; `None` where it has none.
///
/// # Errors
/// The file is no baseline, or one that depends on columns that a fleet doesn't read.
pub fn read(folder: &Path, name: &str) -> Result<Option<BaselineFile>> {
    let path = path(folder, name);
    if !path.exists() {
        return Ok(None);
    }
    let file = BaselineFile::read(&path)?;
    if file.operating_point.is_some() {
        return Err(Error::new("this baseline depends on an operating point, which a fleet doesn't read")
            .allowed("drift monitor for this loop, or a baseline without --operating-point")
            .in_file(path));
    }
    Ok(Some(file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loop_has_a_file_of_its_own_within_the_folder() {
        assert_eq!(path(Path::new("b"), "FIC-101.PV_2"), Path::new("b/FIC-101.PV_2.toml"));
        let names = ["a/b", "a%2Fb", "a b", "../x", "", "\u{e4}"];
        let stems: Vec<String> = names.iter().map(|n| file_stem(n)).collect();
        for (i, stem) in stems.iter().enumerate() {
            assert!(!stem.contains('/') && !stem.starts_with('.'), "{stem}");
            assert!(stems.iter().skip(i + 1).all(|other| other != stem), "{stem}");
        }
    }
}
