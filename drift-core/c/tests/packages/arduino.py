"""The assembled Arduino library: PlatformIO's script finds the archive of each core, and the example links with each of them.

usage: arduino.py LIBRARY TESTS OUT
"""
import importlib.util
import os
import subprocess
import sys

# Core as a board names it (Arduino's build.mcu), the compiler and its flags.
ARM, RISCV = "arm-none-eabi-g++", "riscv64-unknown-elf-g++"
CORES = [
    ("cortex-m0plus", ARM, ["-mcpu=cortex-m0plus", "-mthumb"]),
    ("cortex-m3", ARM, ["-mcpu=cortex-m3", "-mthumb"]),
    ("cortex-m4", ARM, ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft"]),
    ("cortex-m4", ARM, ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=softfp"]),
    ("cortex-m4", ARM, ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]),
    ("cortex-m7", ARM, ["-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"]),
    ("cortex-m33", ARM, ["-mcpu=cortex-m33", "-mthumb", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"]),
    ("esp32c3", RISCV, ["-march=rv32imc", "-mabi=ilp32"]),
    ("esp32c6", RISCV, ["-march=rv32imac", "-mabi=ilp32"]),
]


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr[-3000:]}")


def main(library, tests, out):
    spec = importlib.util.spec_from_file_location("platformio_script", os.path.join(library, "platformio.py"))
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    os.chdir(library)
    assert script.archive("atmega328p", ["-mmcu=atmega328p"]) is None, "there is no archive for AVR"
    hard = ["-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    assert script.archive("cortex-m3", hard) is None, "soft floats can't be linked where floats are in registers"
    for core, compiler, flags in CORES:
        folder = script.archive(core, flags)
        assert folder, f"no archive for {core} {flags}"
        sketch, image = os.path.join(out, "sketch.o"), os.path.join(out, "sketch.elf")
        run(compiler, *flags, "-x", "c++", "-std=c++17", "-Os", "-Wall", "-Wextra", "-Werror", "-ffreestanding", "-fno-threadsafe-statics", "-ffunction-sections",
            "-include", os.path.join(tests, "Arduino.h"), "-I", "src", "-c", "examples/pi_loop/pi_loop.ino", "-o", sketch)
        if compiler == ARM:
            alone = ["--specs=nosys.specs"]
        else:
            # Debian has no small C library for it by default.
            alone = ["-nostdlib", "-Wl,-e,main", os.path.join(out, "routines.o")]
            run("riscv64-unknown-elf-gcc", *flags, "-Os", "-ffreestanding", "-c", os.path.join(tests, "routines.c"), "-o", alone[-1])
        run(compiler, *flags, sketch, *alone, "-Wl,--gc-sections", "-L", os.path.join("src", folder), "-ldrift", "-lgcc", "-o", image)
        print(f"links     the Arduino example with src/{folder}")


main(*map(os.path.abspath, sys.argv[1:4]))
