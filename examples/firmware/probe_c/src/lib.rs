//! The monitors of `c/monitors.c`, timed as those in Rust are: the same script, the same ruler. What is called is the archive that a C
//! firmware links.
#![no_std]

/// The program that times one: number, plan of the script's timing, the C functions, whether its report has a curve.
#[macro_export]
macro_rules! timed {
    ($number:ident, $plan:ident, $start:ident, $tick:ident, $without:ident, $bytes:ident, curve: $curve:literal) => {
        use drift_core::Input;

        unsafe extern "C" {
            fn $start() -> i32;
            fn $tick(r: $number, y: $number, u: $number) -> i32;
            fn $without(why: u32) -> i32;
            fn $bytes() -> u32;
            fn c_drift_with_curve() -> i32;
        }

        #[board::entry]
        fn main() -> ! {
            // SAFETY: the C functions touch their own statics only, and nothing here interrupts.
            let (started, bytes) = unsafe { ($start(), $bytes()) };
            board::Line::new().text("ram ").number(bytes).print();
            probe::run::$number(scenario::$plan.config(), |input| {
                // SAFETY: as above.
                let code = unsafe {
                    match input {
                        Input::Sample { r, y, u } => $tick(r, y, u),
                        Input::Manual => $without(0),
                        Input::Missing => $without(1),
                    }
                };
                core::hint::black_box(code);
            });
            // SAFETY: as above.
            let drifted = unsafe { c_drift_with_curve() } == 1;
            board::exit(started == 0 && drifted == $curve)
        }
    };
}
