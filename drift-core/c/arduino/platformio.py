"""PlatformIO runs this: links the archive of the board's core, which lies where the Arduino IDE looks for it too."""
import os

FOLDER = "src"


def archive(core, flags):
    """The folder of libdrift.a for a core (`cortex-m4`, `esp32c3`) and the compiler's flags, or None."""
    value = {flag.split("=")[0]: flag.split("=")[1] for flag in flags if flag.count("=") == 1}
    abi = value.get("-mfloat-abi")
    folders = [core]
    if "-mfpu" in value and abi in ("hard", "softfp"):
        # An archive for soft floats can't be linked where floats are passed in registers.
        folders = [f"{core}/{value['-mfpu']}-{abi}"] + ([core] if abi == "softfp" else [])
    return next((f for f in folders if os.path.exists(os.path.join(FOLDER, f, "libdrift.a"))), None)


def link(env, board):
    """Adds the archive to a build, or stops it."""
    core = board.get("build.cpu", board.get("build.mcu", ""))
    flags = [str(flag) for flag in env.get("CCFLAGS", [])]
    found = archive(core, flags)
    if found is None:
        raise SystemExit(f"drift: no archive for {core or 'this board'} with {' '.join(flags)}")
    env.Append(LIBPATH=[os.path.realpath(os.path.join(FOLDER, found))], LIBS=["drift"])


try:
    Import("env")  # noqa: F821, PlatformIO's
except NameError:
    pass
else:
    link(env, env.BoardConfig())  # noqa: F821
