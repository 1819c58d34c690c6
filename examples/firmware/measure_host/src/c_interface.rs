//! The C interface: header as committed, an archive of our objects only, the C program under sanitizers on the
//! host and linked with newlib in QEMU.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::build::{emulate, run, target_dir};
use crate::image::no_panic;
use crate::targets::{BUILD, M0, M3, M4F, Target};

const CRATE: &str = "../../drift-core/c";
const WARNINGS: [&str; 5] = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];

/// All of it.
pub fn check() -> Result<()> {
    header()?;
    generated_configuration()?;
    let on_host = host()?;
    for triple in BUILD.iter().filter(|t| t.starts_with("thumb")) {
        let archive = archive(triple)?;
        check_symbols(&archive)?;
        println!("archive   {}: only drift_ symbols, no panic", archive.display());
    }
    for target in [M4F, M3, M0] {
        let printed = firmware(&target)?;
        if printed != on_host {
            bail!("C on {} printed\n{printed}and on the host\n{on_host}", target.triple);
        }
        println!("runs      C with newlib on {}: as on the host", target.core);
    }
    print!("{on_host}");
    Ok(())
}

fn header() -> Result<()> {
    let config = cbindgen::Config::from_file(format!("{CRATE}/cbindgen.toml")).map_err(anyhow::Error::msg)?;
    let bindings = cbindgen::Builder::new().with_crate(CRATE).with_config(config).generate()?;
    let mut text = Vec::new();
    bindings.write(&mut text);
    let text = in_parentheses(&String::from_utf8(text)?).into_bytes();
    let path = PathBuf::from(CRATE).join("include/drift.h");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(&path, &text)?;
    }
    let committed = std::fs::read(&path).with_context(|| path.display().to_string())?;
    if committed != text {
        bail!("{} is not what cbindgen makes of the crate; UPDATE_EXPECTED=1 writes it anew", path.display());
    }
    println!("header    {} is as generated", path.display());
    Ok(())
}

/// `#define DRIFT_NULL (-1)`: a bare minus would bind to what stands before the name.
fn in_parentheses(header: &str) -> String {
    let line = |line: &str| match line.split_once(" -") {
        Some((define, number)) if define.starts_with("#define ") => format!("{define} (-{number})\n"),
        _ => format!("{line}\n"),
    };
    header.lines().map(line).collect()
}

/// What `drift calibrate --c` writes, as the committed example of its test, compiles against our header.
fn generated_configuration() -> Result<()> {
    let example = std::path::absolute("../../drift-sim/tests/baseline_file/config.h")?;
    if !example.exists() {
        println!("note      no {}: only the example here is compiled", example.display());
        return Ok(());
    }
    let program = target_dir().join("c/generated.c");
    std::fs::create_dir_all(target_dir().join("c"))?;
    let main = "drift_monitor_t m[DRIFT_FULL_WORDS];\nint start(void);\n\
        int start(void) { return drift_full_init(m, DRIFT_FULL_WORDS, &drift_config); }\n";
    let (header, config) = ("drift.h".to_string(), example.display().to_string());
    for order in [[&header, &config], [&config, &header]] {
        let [first, second] = order;
        std::fs::write(&program, format!("#include \"{first}\"\n#include \"{second}\"\n{main}"))?;
        for (compiler, language, standard) in [
            ("arm-none-eabi-gcc", "c", "-std=c99"),
            ("arm-none-eabi-gcc", "c", "-std=c11"),
            ("arm-none-eabi-g++", "c++", "-std=c++11"),
            ("arm-none-eabi-g++", "c++", "-std=c++17"),
        ] {
            run(Command::new(compiler)
                .args(["-x", language, standard, "-Wall", "-Wextra", "-Werror", "-pedantic"])
                .args(["-I", &format!("{CRATE}/include"), "-c"])
                .arg(&program)
                .arg("-o")
                .arg(program.with_extension("o")))
            .with_context(|| format!("{first} before {second} as {standard}"))?;
        }
    }
    println!(
        "compiles  the configuration that drift calibrate --c writes, in either include order, as C99, C11, C++11 and C++17"
    );
    Ok(())
}

/// The program under AddressSanitizer and UBSan; what it printed.
fn host() -> Result<String> {
    let library = archive("host")?;
    let program = target_dir().join("c/pi_loop_host");
    run(Command::new("cc")
        .args(WARNINGS)
        .args(["-g", "-O1", "-ffp-contract=off", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"])
        .args(["-I", &format!("{CRATE}/include"), "-I", "c", "c/pi_loop.c"])
        .arg(&library)
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program))?;
    let printed = String::from_utf8(run(&mut Command::new(&program))?)?;
    println!("runs      C on the host under ASan and UBSan");
    Ok(printed)
}

/// The archive as the documented command makes it. Of a target without an operating system it holds our object alone: a
/// default static library would replace the firmware's own float and memory routines by Rust's.
fn archive(triple: &str) -> Result<PathBuf> {
    let build = target_dir().join("c");
    let archive = build.join(triple).join("release/libdrift.a");
    let given = |name: &str, path: &Path| format!("-D{name}={}", path.display());
    run(Command::new("cmake")
        .args([&format!("-DTRIPLE={triple}"), &given("OUT", &archive), &given("BUILD", &build)])
        .args(["-P", &format!("{CRATE}/cmake/archive.cmake")]))?;
    Ok(archive)
}

/// The folder with the archive and with the monitors of the cost table, compiled from C.
pub fn monitors(target: &Target) -> Result<PathBuf> {
    let folder = archive(target.triple)?.parent().context("a folder")?.to_path_buf();
    let (object, library) = (folder.join("monitors.o"), folder.join("libmonitors.a"));
    run(Command::new("arm-none-eabi-gcc")
        .args(target.gcc)
        .args(WARNINGS)
        .args(["-Os", "-ffp-contract=off", "-ffunction-sections", "-fdata-sections"])
        .args(["-I", &format!("{CRATE}/include"), "-c", "c/monitors.c", "-o"])
        .arg(&object))?;
    run(Command::new("arm-none-eabi-ar").arg("rcs").arg(&library).arg(&object))?;
    Ok(folder)
}

/// Only our names are in it, and no panic.
fn check_symbols(archive: &Path) -> Result<()> {
    let symbols = run(Command::new("arm-none-eabi-nm").arg("-g").arg(archive))?;
    for line in String::from_utf8(symbols)?.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (kind, name) = match words.as_slice() {
            [_, kind, name] => (*kind, *name),
            ["U", name] => ("U", *name),
            _ => continue,
        };
        if name.contains("panic") || (kind != "U" && !name.starts_with("drift_")) {
            bail!("{}: symbol {kind} {name}", archive.display());
        }
    }
    Ok(())
}

/// Linked with newlib and run; what it printed.
fn firmware(target: &Target) -> Result<String> {
    let image = target_dir().join("c").join(target.triple).join("pi_loop_c.elf");
    let library = target_dir().join("c").join(target.triple).join("release/libdrift.a");
    let map = if target.triple == M0.triple { "c/microbit.ld" } else { "c/mps2.ld" };
    run(Command::new("arm-none-eabi-gcc")
        .args(target.gcc)
        .args(WARNINGS)
        .args(["-Os", "-ffp-contract=off", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"])
        .args(["-I", &format!("{CRATE}/include"), "-I", "c", "c/pi_loop.c", "c/startup.c"])
        .args(["--specs=nano.specs", "--specs=rdimon.specs", "-nostartfiles", "-L", "c", "-T", map])
        .arg(&library)
        .arg("-o")
        .arg(&image))?;
    no_panic(&image)?;
    Ok(String::from_utf8(emulate(target, Path::new(&image))?)?)
}
