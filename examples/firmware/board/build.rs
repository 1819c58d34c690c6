//! Writes the memory map of the board that QEMU offers for the target.

use std::{env, fs, path::PathBuf};

fn main() {
    let target = env::var("TARGET").unwrap_or_default();
    // 32 KiB of RAM are enough for every program here, and quick to paint.
    let (flash, ram) = match target.as_str() {
        "thumbv6m-none-eabi" => ("0x00000000, LENGTH = 256K", "0x20000000, LENGTH = 16K"), // microbit
        "thumbv8m.main-none-eabihf" => ("0x10000000, LENGTH = 512K", "0x38000000, LENGTH = 32K"), // mps2-an505
        _ => ("0x00000000, LENGTH = 512K", "0x20000000, LENGTH = 32K"), // mps2-an385, mps2-an386
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    let map = format!("MEMORY {{ FLASH : ORIGIN = {flash}\n RAM : ORIGIN = {ram} }}\n");
    if let Err(error) = fs::write(out.join("memory.x"), map) {
        println!("cargo::error=memory.x: {error}");
    }
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rerun-if-changed=build.rs");
}
