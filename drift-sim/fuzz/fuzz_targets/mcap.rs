#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(
    b"\x89MCAP0\r\n",
    bytes,
    "r=/wanted.data,y=/sensor.y,u=/control.data"
));
