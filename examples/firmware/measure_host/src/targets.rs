//! The targets, and the board that QEMU offers for each.

/// A target whose programs run in QEMU.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// The Rust triple.
    pub triple: &'static str,
    /// The core, in words.
    pub core: &'static str,
    /// QEMU's machine.
    pub machine: &'static str,
    /// The core's clock there, Hz: under `-icount shift=10` an instruction takes 1024 ns.
    pub clock_hz: f64,
    /// gcc's options for the same core.
    pub gcc: &'static [&'static str],
}

/// Cortex-M4 with FPU.
pub const M4F: Target = Target {
    triple: "thumbv7em-none-eabihf",
    core: "Cortex-M4F",
    machine: "mps2-an386",
    clock_hz: 25e6,
    gcc: &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
};
const M4: Target = Target {
    triple: "thumbv7em-none-eabi",
    core: "Cortex-M4, soft float",
    gcc: &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft"],
    ..M4F
};
/// Cortex-M3.
pub const M3: Target = Target {
    triple: "thumbv7m-none-eabi",
    core: "Cortex-M3",
    machine: "mps2-an385",
    clock_hz: 25e6,
    gcc: &["-mcpu=cortex-m3", "-mthumb", "-mfloat-abi=soft"],
};
/// Cortex-M0.
pub const M0: Target = Target {
    triple: "thumbv6m-none-eabi",
    core: "Cortex-M0",
    machine: "microbit",
    clock_hz: 16e6,
    gcc: &["-mcpu=cortex-m0", "-mthumb", "-mfloat-abi=soft"],
};

/// Cortex-M33 with FPU.
pub const M33F: Target = Target {
    triple: "thumbv8m.main-none-eabihf",
    core: "Cortex-M33F",
    machine: "mps2-an505",
    clock_hz: 20e6,
    gcc: &["-mcpu=cortex-m33", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"],
};

/// Those that run.
pub const RUN: &[Target] = &[M4F, M4, M3, M0, M33F];

/// Those that drift-core is built for.
pub const BUILD: &[&str] = &[
    "thumbv6m-none-eabi",
    "thumbv7m-none-eabi",
    "thumbv7em-none-eabi",
    "thumbv7em-none-eabihf",
    "thumbv8m.main-none-eabihf",
    "riscv32imac-unknown-none-elf",
    "wasm32-unknown-unknown",
];
