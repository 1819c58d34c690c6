//! The command line as it may be typed again.

use std::ffi::OsString;

/// Arguments as a POSIX shell reads them back; of the program its file name alone.
pub fn command_line(arguments: impl IntoIterator<Item = OsString>) -> String {
    let mut words = Vec::new();
    for (i, argument) in arguments.into_iter().enumerate() {
        let word = if i == 0 {
            std::path::Path::new(&argument).file_stem().map_or(argument.clone(), |name| name.to_owned())
        } else {
            argument
        };
        words.push(quoted(&word.to_string_lossy()));
    }
    words.join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_same_words() {
        let words = [
            "target/release/drift",
            "monitor",
            "it's <b>.csv",
            "--columns",
            "t=time,r=SP",
            "",
            "a b",
            "$HOME",
        ];
        let line = command_line(words.iter().map(OsString::from));
        assert_eq!(line, "drift monitor 'it'\\''s <b>.csv' --columns t=time,r=SP '' 'a b' '$HOME'");
        #[cfg(unix)]
        {
            let out = std::process::Command::new("sh")
                .args(["-c", &format!("printf '%s|' {line}")])
                .output()
                .unwrap();
            let read = String::from_utf8(out.stdout).unwrap();
            assert_eq!(read, format!("drift|{}|", words[1..].join("|")));
        }
    }
}
