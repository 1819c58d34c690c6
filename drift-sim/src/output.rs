//! Whole files or none: what is written appears under its name only when it is complete.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use crate::{Error, Result};

/// Writes a file by way of a temporary one beside it, renamed at the end; `-` is standard output.
///
/// # Errors
/// The folder or file can't be written, or `write` fails; what stood there before is then untouched.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let refused = |e: io::Error| Error::new(format!("can't be written: {e}")).in_file(path);
    if path == Path::new("-") {
        let mut out = io::BufWriter::new(io::stdout().lock());
        return match write(&mut out).and_then(|()| out.flush()) {
            // The reader of the pipe has seen enough: not a failure of ours.
            Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other.map_err(|e| Error::new(format!("standard output can't be written: {e}"))),
        };
    }
    // A device or a pipe is written into: renaming a file onto it would put the file in its place.
    if fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        let file = fs::OpenOptions::new().write(true).open(path).map_err(refused)?;
        let mut out = io::BufWriter::new(file);
        return write(&mut out).and_then(|()| out.flush()).map_err(refused);
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut temporary = tempfile::Builder::new().prefix(".drift-").tempfile_in(folder).map_err(refused)?;
    {
        let mut out = io::BufWriter::new(temporary.as_file_mut());
        write(&mut out).and_then(|()| out.flush()).map_err(refused)?;
    }
    make_readable(temporary.as_file()).map_err(refused)?;
    temporary.persist(path).map_err(|e| refused(e.error))?;
    Ok(())
}

/// Writes text the same way.
///
/// # Errors
/// As [`write_with`].
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_with(path, |out| out.write_all(text.as_bytes()))
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
    }
}
