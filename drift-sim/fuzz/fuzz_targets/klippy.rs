#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| drift_fuzz::read(
    b"Stats 1.0: ",
    bytes,
    "r=extruder.target,y=extruder.temp,u=extruder.pwm"
));
