#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(b"H Product:Blackbox", bytes, "y=gyroADC[0]"));
