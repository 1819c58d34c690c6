"""The Zephyr module's Kconfig: which Rust target it chooses for the symbols that Zephyr sets for a core.

usage: kconfig.py KCONFIG
"""
import os
import sys
import tempfile

import kconfiglib

ARM = ["CPU_CORTEX_M"]
CHOICES = [
    (ARM + ["CPU_CORTEX_M0PLUS"], "thumbv6m-none-eabi"),
    (ARM + ["CPU_CORTEX_M3"], "thumbv7m-none-eabi"),
    (ARM + ["CPU_CORTEX_M4"], "thumbv7em-none-eabi"),
    (ARM + ["CPU_CORTEX_M4", "FPU"], "thumbv7em-none-eabi"),
    (ARM + ["CPU_CORTEX_M4", "FPU", "FP_HARDABI"], "thumbv7em-none-eabihf"),
    (ARM + ["CPU_CORTEX_M7", "FPU", "FP_HARDABI"], "thumbv7em-none-eabihf"),
    (ARM + ["CPU_CORTEX_M23"], "thumbv8m.base-none-eabi"),
    (ARM + ["CPU_CORTEX_M33"], "thumbv8m.main-none-eabi"),
    (ARM + ["CPU_CORTEX_M33", "FPU", "FP_HARDABI"], "thumbv8m.main-none-eabihf"),
    (["RISCV", "RISCV_ISA_EXT_C"], "riscv32imc-unknown-none-elf"),
    (["RISCV", "RISCV_ISA_EXT_A", "RISCV_ISA_EXT_C"], "riscv32imac-unknown-none-elf"),
    (["RISCV", "64BIT", "RISCV_ISA_EXT_A", "RISCV_ISA_EXT_C"], "riscv64imac-unknown-none-elf"),
]
# Zephyr's own symbols that the file names.
ZEPHYR = sorted({symbol for symbols, _ in CHOICES for symbol in symbols} | {"CPU_CORTEX_M0", "CPU_CORTEX_M1", "CPU_CORTEX_M55", "CPU_CORTEX_M85"})

with tempfile.TemporaryDirectory() as folder:
    top = os.path.join(folder, "Kconfig")
    with open(top, "w", encoding="utf-8") as file:
        file.writelines(f'config {symbol}\n\tbool "{symbol}"\n' for symbol in ZEPHYR)
        file.write(f'source "{os.path.abspath(sys.argv[1])}"\n')
    kconfig = kconfiglib.Kconfig(top, warn_to_stderr=False)
    assert not kconfig.warnings, kconfig.warnings
    for symbols, target in CHOICES:
        for symbol in kconfig.unique_defined_syms:
            symbol.unset_value()
        for symbol in symbols + ["DRIFT"]:
            kconfig.syms[symbol].set_value("y")
        assert kconfig.syms["DRIFT"].str_value == "y", symbols
        chosen = kconfig.syms["DRIFT_RUST_TARGET"].str_value
        assert chosen == target, f"{symbols}: {chosen}, not {target}"
    for symbol in kconfig.unique_defined_syms:
        symbol.unset_value()
    kconfig.syms["DRIFT"].set_value("y")
    assert kconfig.syms["DRIFT"].str_value == "n", "on other cores it can't be chosen"
print(f"checked   the Zephyr module's Kconfig: {len(CHOICES)} cores")
