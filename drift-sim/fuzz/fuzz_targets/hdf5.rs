#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(b"\x89HDF\r\n\x1a\n", bytes, "t=t"));
