//! Text as UTF-8 with LF at the end of lines, from whatever a spreadsheet or a data logger writes: UTF-8, UTF-16 in both
//! orders, Windows-1252 (which ISO 8859-1 is a part of), lines that end in CR alone.

use std::io::{self, Cursor, Read};

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};
use encoding_rs_io::DecodeReaderBytesBuilder;

/// Bytes that tell the encoding; a letter outside ASCII stands in the header.
const START_BYTES: u64 = 1 << 16;

/// The text of a source.
pub(super) fn decoded(mut source: Box<dyn Read + Send>) -> io::Result<Box<dyn Read + Send>> {
    let mut start = Vec::new();
    source.by_ref().take(START_BYTES).read_to_end(&mut start)?;
    let encoding = encoding_of(&start);
    let text =
        if encoding == UTF_8 { start.clone() } else { encoding.decode(&start).0.into_owned().into_bytes() };
    let has_cr_alone = !text.contains(&b'\n') && text.contains(&b'\r');
    let whole = Cursor::new(start).chain(source);
    let decoded: Box<dyn Read + Send> = if encoding == UTF_8 {
        Box::new(without_mark(whole)?)
    } else {
        Box::new(DecodeReaderBytesBuilder::new().encoding(Some(encoding)).bom_sniffing(true).build(whole))
    };
    Ok(if has_cr_alone { Box::new(LineFeeds(decoded)) } else { decoded })
}

fn encoding_of(start: &[u8]) -> &'static Encoding {
    if let Some((encoding, _)) = Encoding::for_bom(start) {
        return encoding;
    }
    // Without a mark UTF-16 shows as a zero beside nearly every letter.
    let zeros = |odd: usize| start.iter().skip(odd).step_by(2).filter(|b| **b == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    let most = start.len() * 2 / 5;
    if odd > most && even == 0 {
        return UTF_16LE;
    }
    if even > most && odd == 0 {
        return UTF_16BE;
    }
    // A letter may be cut at the end of what was read.
    match std::str::from_utf8(start) {
        Err(e) if e.error_len().is_some() => WINDOWS_1252,
        _ => UTF_8,
    }
}

/// The text behind a byte order mark.
fn without_mark<R: Read>(mut source: R) -> io::Result<impl Read> {
    const MARK: &[u8] = b"\xef\xbb\xbf";
    let mut start = Vec::new();
    source.by_ref().take(MARK.len() as u64).read_to_end(&mut start)?;
    if start == MARK {
        start.clear();
    }
    Ok(Cursor::new(start).chain(source))
}

/// CR as LF.
struct LineFeeds<R>(R);

impl<R: Read> Read for LineFeeds<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.0.read(buffer)?;
        buffer[..count].iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> String {
        let mut text = String::new();
        decoded(Box::new(Cursor::new(bytes.to_vec()))).unwrap().read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn every_encoding_gives_the_same_text() {
        let wanted = "t;Stellgr\u{f6}\u{df}e\n1;2\n";
        let wide = |bytes: fn(u16) -> [u8; 2]| wanted.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
        let one_byte: Vec<u8> = wanted.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        assert_eq!(text(wanted.as_bytes()), wanted);
        assert_eq!(text(&one_byte), wanted);
        assert_eq!(text(&wide(u16::to_le_bytes)), wanted);
        assert_eq!(text(&wide(u16::to_be_bytes)), wanted);
        assert_eq!(text(&[&b"\xff\xfe"[..], &wide(u16::to_le_bytes)].concat()), wanted);
        assert_eq!(text(&[&b"\xfe\xff"[..], &wide(u16::to_be_bytes)].concat()), wanted);
        assert_eq!(text(&[&b"\xef\xbb\xbf"[..], wanted.as_bytes()].concat()), wanted);
        assert_eq!(text(wanted.replace('\n', "\r").as_bytes()), wanted);
    }
}
