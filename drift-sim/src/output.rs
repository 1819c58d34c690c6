//! Whole files or none: what is written appears under its name only when it is complete, and all outputs of a command
//! appear together. No output may be an input or another output.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::{Error, Result};

/// Links that are followed to where an output really lies.
const LINKS_MAX: usize = 40;

/// The files of this process that are not finished yet.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every file that is not finished, for a process that ends now (Ctrl-C). Nothing can be written afterwards: a
/// thread that tries waits for the end.
pub fn remove_unfinished() {
    let files = unfinished();
    for path in files.iter() {
        let _ = fs::remove_file(path);
    }
    std::mem::forget(files);
}

/// The outputs of one command: prepared one after the other, and shown under their names all together by
/// [`Outputs::commit`]. Where it is dropped before, no output appears and what stood there stays.
///
/// Standard output (`-`), devices and pipes are written at once, because nothing can be taken back there.
#[derive(Default)]
pub struct Outputs {
    staged: Vec<Staged>,
}

/// A finished file under a temporary name beside its own.
struct Staged {
    /// As the user wrote it, for messages.
    path: PathBuf,
    /// Where it goes, links followed.
    target: PathBuf,
    file: NamedTempFile,
}

impl Drop for Staged {
    fn drop(&mut self) {
        unfinished().remove(self.file.path());
    }
}

impl Outputs {
    /// Checks the outputs of a command before any work: `outputs` as (name of the argument, path), `inputs` as paths.
    ///
    /// # Errors
    /// An output is an input (the same file, also through links) or another output, or can't be written.
    pub fn checked(outputs: &[(&str, Option<&Path>)], inputs: &[&Path]) -> Result<Self> {
        let outputs: Vec<(&str, &Path)> =
            outputs.iter().filter_map(|(name, path)| path.map(|path| (*name, path))).collect();
        for (i, (name, path)) in outputs.iter().enumerate() {
            let place = Place::of_output(path);
            for input in inputs {
                if place.is_some() && place == Place::of_input(input) {
                    return Err(Error::new(format!(
                        "{name} would overwrite the input '{}'",
                        input.display()
                    ))
                    .allowed("name another file for it")
                    .in_file(path));
                }
            }
            let same =
                outputs.iter().take(i).find(|(_, other)| place.is_some() && Place::of_output(other) == place);
            if let Some((other, _)) = same {
                let what = format!("{other} and {name} are both '{}'", path.display());
                return Err(Error::new(what).allowed("name a file for each"));
            }
            can_be_written(path)?;
        }
        Ok(Self::default())
    }

    /// Prepares a file by way of a temporary one beside it; `-` is standard output, written at once.
    ///
    /// # Errors
    /// The folder or file can't be written, or `write` fails.
    pub fn write_with(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let refused = |e: io::Error| refused(path, &e);
        if path == Path::new("-") {
            let mut out = io::BufWriter::new(io::stdout().lock());
            return match write(&mut out).and_then(|()| out.flush()) {
                // The reader of the pipe has seen enough: not a failure of ours.
                Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                other => other.map_err(|e| Error::of_file("standard output can't be written", &e)),
            };
        }
        // Renaming a file onto a device or a pipe would put the file in its place.
        if is_device_or_pipe(path) {
            let file = fs::OpenOptions::new().write(true).open(path).map_err(refused)?;
            let mut out = io::BufWriter::new(file);
            return write(&mut out).and_then(|()| out.flush()).map_err(refused);
        }
        let target = behind_links(path);
        let mut staged =
            Staged { path: path.to_owned(), file: temporary(folder(&target)).map_err(refused)?, target };
        {
            let mut out = io::BufWriter::new(staged.file.as_file_mut());
            write(&mut out).and_then(|()| out.flush()).map_err(refused)?;
        }
        make_readable(staged.file.as_file()).map_err(refused)?;
        self.staged.push(staged);
        Ok(())
    }

    /// Prepares text the same way.
    ///
    /// # Errors
    /// As [`Self::write_with`].
    pub fn write_text(&mut self, path: &Path, text: &str) -> Result<()> {
        self.write_with(path, |out| out.write_all(text.as_bytes()))
    }

    /// Shows all prepared files under their names.
    ///
    /// # Errors
    /// One of them can't be: then what stood under the names stands there again.
    pub fn commit(self) -> Result<()> {
        // An interrupt comes before all of this or after it.
        let not_interrupted = unfinished();
        let keep_old = self.staged.len() > 1;
        let mut landed: Vec<Landed> = Vec::with_capacity(self.staged.len());
        for staged in &self.staged {
            let moved = Landed::replace(staged, keep_old);
            match moved {
                Ok(place) => landed.push(place),
                Err(e) => {
                    landed.iter().rev().for_each(Landed::undo);
                    drop(not_interrupted);
                    return Err(refused(&staged.path, &e));
                }
            }
        }
        landed.iter().for_each(Landed::forget_old);
        drop(not_interrupted);
        Ok(())
    }
}

/// An output that has its name now.
struct Landed {
    target: PathBuf,
    /// What stood there before, under another name.
    old: Option<PathBuf>,
}

impl Landed {
    fn replace(staged: &Staged, keep_old: bool) -> io::Result<Self> {
        let target = staged.target.clone();
        let old = match keep_old && fs::symlink_metadata(&target).is_ok_and(|there| there.is_file()) {
            true => {
                let name = staged.file.path().with_extension("old");
                fs::hard_link(&target, &name).or_else(|_| fs::copy(&target, &name).map(|_| ()))?;
                Some(name)
            }
            false => None,
        };
        let landed = Self { target, old };
        match fs::rename(staged.file.path(), &landed.target) {
            Ok(()) => Ok(landed),
            Err(e) => {
                landed.forget_old();
                Err(e)
            }
        }
    }

    fn undo(&self) {
        let _ = match &self.old {
            Some(old) => fs::rename(old, &self.target),
            None => fs::remove_file(&self.target),
        };
    }

    fn forget_old(&self) {
        if let Some(old) = &self.old {
            let _ = fs::remove_file(old);
        }
    }
}

/// Writes one file, whole or not at all; `-` is standard output.
///
/// # Errors
/// The folder or file can't be written, or `write` fails; what stood there before is then untouched.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let mut outputs = Outputs::default();
    outputs.write_with(path, write)?;
    outputs.commit()
}

/// Writes text the same way.
///
/// # Errors
/// As [`write_with`].
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_with(path, |out| out.write_all(text.as_bytes()))
}

fn refused(path: &Path, e: &io::Error) -> Error {
    let error = match e.kind() {
        // A new file lacks nothing but its folder.
        io::ErrorKind::NotFound => {
            Error::new("can't be written: there is no such folder").allowed("make the folder first")
        }
        _ => Error::of_file("can't be written", e),
    };
    error.in_file(path)
}

/// A temporary file that an interrupt removes.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut files = unfinished();
    let file = tempfile::Builder::new().prefix(".drift-").tempfile_in(folder)?;
    files.insert(file.path().to_owned());
    Ok(file)
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn is_device_or_pipe(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// The file that a path leads to, also where there is none yet.
fn behind_links(path: &Path) -> PathBuf {
    let mut at = path.to_owned();
    for _ in 0..LINKS_MAX {
        match fs::read_link(&at) {
            Ok(to) => at = folder(&at).join(to),
            Err(_) => break,
        }
    }
    at
}

/// Makes a folder for files whose names the user did not choose, before any work. Where some of these are there and others are
/// not, they are somebody else's.
///
/// # Errors
/// It can't be made, or holds a file that is not ours.
pub fn own_folder(folder: &Path, files: &[&str]) -> Result<()> {
    let refused = |e: io::Error| Error::of_file("can't be made", &e).in_file(folder);
    fs::create_dir_all(folder).map_err(refused)?;
    let (there, missing): (Vec<&str>, Vec<&str>) =
        files.iter().partition(|name| folder.join(name).symlink_metadata().is_ok());
    match (there.first(), missing.first()) {
        (Some(one), Some(_)) => Err(Error::new(format!("holds a file '{one}' that would be overwritten"))
            .allowed("another folder by --out")
            .in_file(folder)),
        _ => Ok(()),
    }
}

/// Refuses an output that could not be written after all the work.
fn can_be_written(path: &Path) -> Result<()> {
    if path == Path::new("-") || is_device_or_pipe(path) {
        return Ok(());
    }
    let target = behind_links(path);
    if target.is_dir() || target.file_name().is_none() {
        return Err(Error::new("can't be written: it is a folder")
            .allowed("the name of a file")
            .in_file(path));
    }
    // A file without a name: nothing is left of it whatever happens.
    tempfile::tempfile_in(folder(&target)).map(drop).map_err(|e| refused(path, &e))
}

/// What standard output is called as a file, where it has a name.
const STANDARD_OUTPUT: &str = "/dev/stdout";

/// Whether a path is `-` or another name of what standard output is: `/dev/stdout`, `/dev/fd/1`, the terminal, the pipe, the file.
fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-") || is_same(path, Path::new(STANDARD_OUTPUT))
}

/// Whether what is written there is gone.
fn is_nowhere(path: &Path) -> bool {
    is_same(path, Path::new("/dev/null"))
}

/// Whether two paths lead to the same file, device or pipe.
#[cfg(unix)]
fn is_same(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |path: &Path| fs::metadata(path).ok().map(|there| (there.dev(), there.ino()));
    place(one).is_some_and(|one| Some(one) == place(other))
}

#[cfg(not(unix))]
fn is_same(_: &Path, _: &Path) -> bool {
    false
}

/// Where a file is, whatever path leads there; two places are the same file where they are equal.
#[derive(PartialEq)]
enum Place {
    StandardOutput,
    #[cfg(unix)]
    There {
        device: u64,
        inode: u64,
    },
    Path(PathBuf),
}

impl Place {
    /// `None` for devices, which take any number of outputs; a terminal takes one.
    fn of_output(path: &Path) -> Option<Self> {
        if is_standard_output(path) {
            return Self::of_standard_output();
        }
        if let Ok(there) = fs::metadata(path) {
            return Self::of_file(path, &there);
        }
        let target = behind_links(path);
        let folder = fs::canonicalize(folder(&target)).ok()?;
        Some(Self::Path(folder.join(target.file_name()?)))
    }

    /// Where standard output leads: a file is the same place by its own name.
    fn of_standard_output() -> Option<Self> {
        let path = Path::new(STANDARD_OUTPUT);
        match fs::metadata(path) {
            Ok(there) if there.is_file() => Self::of_file(path, &there),
            _ if is_nowhere(path) => None,
            _ => Some(Self::StandardOutput),
        }
    }

    fn of_input(path: &Path) -> Option<Self> {
        // Standard input may be a file too.
        let path = if path == Path::new("-") { Path::new("/dev/stdin") } else { path };
        Self::of_file(path, &fs::metadata(path).ok()?)
    }

    #[cfg(unix)]
    fn of_file(_: &Path, there: &fs::Metadata) -> Option<Self> {
        use std::os::unix::fs::{FileTypeExt, MetadataExt};
        let kind = there.file_type();
        let takes_any = kind.is_char_device() || kind.is_block_device();
        (!takes_any).then(|| Self::There { device: there.dev(), inode: there.ino() })
    }

    #[cfg(not(unix))]
    fn of_file(path: &Path, there: &fs::Metadata) -> Option<Self> {
        if there.is_file() { fs::canonicalize(path).ok().map(Self::Path) } else { None }
    }
}

/// Temporary files are private to their owner; the finished one has the rights that any new file gets.
#[cfg(unix)]
fn make_readable(file: &fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &fs::File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        write_text(&path, "old").unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("full"))
        });
        assert!(failed.unwrap_err().to_string().contains("full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// The third of three can't get its name, because a folder has it by now: the first keeps its old content, the
    /// second does not appear.
    #[test]
    fn outputs_appear_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
        write_text(&a, "old").unwrap();
        let prepare = || {
            let mut outputs = Outputs::default();
            for path in [&a, &b, &c] {
                outputs.write_text(path, "new").unwrap();
            }
            outputs
        };
        let outputs = prepare();
        fs::create_dir(&c).unwrap();
        outputs.commit().unwrap_err();
        assert_eq!(fs::read_to_string(&a).unwrap(), "old");
        assert!(!b.exists());
        fs::remove_dir(&c).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        drop(prepare());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        prepare().commit().unwrap();
        assert_eq!(fs::read_to_string(&a).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[cfg(unix)]
    #[test]
    fn an_output_behind_a_link_is_written_and_the_link_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::os::unix::fs::symlink("file", &link).unwrap();
        write_text(&link, "through").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "through");
    }

    /// What is under the name stays what it was: here a named pipe.
    #[cfg(unix)]
    #[test]
    fn a_pipe_is_written_into_and_stays_a_pipe() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).unwrap()
        });
        write_text(&pipe, "through").unwrap();
        assert_eq!(reader.join().unwrap(), "through");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }

    #[test]
    fn a_missing_folder_is_one_clear_error() {
        let error = write_text(Path::new("no/such/folder/a.toml"), "x").unwrap_err();
        assert!(error.to_string().starts_with("no/such/folder/a.toml: can't be written"));
        let error = Outputs::checked(&[("-o", Some(Path::new("no/such/folder/a.toml")))], &[]).err().unwrap();
        assert!(error.to_string().starts_with("no/such/folder/a.toml: can't be written"));
    }
}
