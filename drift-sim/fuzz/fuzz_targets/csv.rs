#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(b"", bytes, "t=t"));
