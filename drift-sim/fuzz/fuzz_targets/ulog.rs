#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(
    b"ULog\x01\x12\x35",
    bytes,
    "r=wanted.r,y=sensor.y,u=control.u"
));
