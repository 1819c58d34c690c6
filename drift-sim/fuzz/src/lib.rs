//! What every target asserts: any bytes are a recording or an error in one line, within a memory limit.

use drift_sim::recording::{ReadOptions, Recording};

/// What reading one input may take, bytes.
const MEMORY_LIMIT_BYTES: u64 = 64 << 20;

/// Reads the bytes behind the magic number of a format with these columns.
pub fn read(magic: &[u8], bytes: &[u8], columns: &str) {
    let all = if bytes.starts_with(magic) { bytes.to_vec() } else { [magic, bytes].concat() };
    let options = ReadOptions {
        columns: columns.parse().unwrap_or_default(),
        memory_limit_bytes: Some(MEMORY_LIMIT_BYTES),
        ..ReadOptions::default()
    };
    match Recording::from_reader("fuzz", std::io::Cursor::new(all), &options) {
        Ok(recording) => assert!(recording.sample_time_s > 0.0 && !recording.is_empty()),
        Err(error) => assert!(!error.to_string().chars().any(char::is_control)),
    }
}
