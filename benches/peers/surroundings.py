"""The virtual environment of the other programs, the binary of `gearlash`, and the machine."""

import datetime
import os
import platform
import shutil
import subprocess
import sys

from measure import PeersError

# What each program needs, pinned; the packages these need in turn are left to pip.
COMMON = ("numpy==2.4.6", "scipy==1.17.1", "PyYAML==6.0.3")
PINS = {
    "pyharm": ("pyHarm-os==1.2.2", "numba==0.68.1", "llvmlite==0.50.0", "jax==0.5.3", "jaxlib==0.5.3"),
    "scipy": (),
    "numbalsoda": ("numbalsoda==0.3.4", "numba==0.68.1", "llvmlite==0.50.0"),
}
# Pinned for repeatability only: they have no share in the figures.
UNTOLD = ("PyYAML", "jax", "jaxlib", "llvmlite")
# pyHarm-os 1.2.2 and numpy 2.4 ask for it.
OLDEST_PYTHON = (3, 11)
# numbalsoda comes as source; its build asks CMake for a Fortran compiler.
FORTRAN_COMPILERS = ("gfortran", "flang", "ifx", "ifort", "f95", "f77")
# Prints the versions of Python and of the packages named.
VERSIONS = """
import importlib.metadata, platform, sys
versions = [f"{package} {importlib.metadata.version(package)}" for package in sys.argv[1:]]
print(", ".join([f"Python {platform.python_version()}", *versions]))
"""


def prepare(folder, python, programs):
    """Path of a Python that has the packages of `programs`; made in `folder` unless it is there already."""
    pins = pinned(programs)
    interpreter, stamp = folder / "bin" / "python", folder / "peers.txt"
    present = stamp.read_text(encoding="utf-8").split() if interpreter.exists() and stamp.exists() else []
    if set(pins) <= set(present):
        return interpreter
    check_tools(python, programs)
    print(f"installing {', '.join(pins)} in {folder}", file=sys.stderr)
    if not interpreter.exists():
        command([python, "-m", "venv", folder], "python -m venv failed; on Debian it is in the package python3-venv")
    advice = "pip could not install the other programs; is the package index within reach?"
    command([interpreter, "-m", "pip", "install", "--disable-pip-version-check", "--quiet", *pins], advice)
    stamp.write_text("\n".join(sorted({*present, *pins})) + "\n", encoding="utf-8")
    return interpreter


def check_tools(python, programs):
    """Raises `PeersError` for what pip would stumble over late and obscurely."""
    code = "import sys; print(*sys.version_info[:2])"
    version = tuple(map(int, command([python, "-c", code], f"{python} does not run").split()))
    if version < OLDEST_PYTHON:
        wanted, found = (".".join(map(str, v)) for v in (OLDEST_PYTHON, version))
        raise PeersError(f"the other programs need Python {wanted} or later, found {found}; name one with --python")
    if "numbalsoda" in programs and not os.environ.get("FC") and not any(map(shutil.which, FORTRAN_COMPILERS)):
        raise PeersError(
            "numbalsoda is built from source and needs a Fortran and a C++ compiler, found no Fortran compiler;\n"
            "install one (Debian: apt-get install gfortran g++), name it in FC, or leave it out: --without numbalsoda"
        )


def command(words, advice):
    """Standard output of a command that must succeed, else `PeersError` with `advice` and its last words."""
    try:
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    except OSError as error:
        raise PeersError(f"{advice}: {error}") from error
    if done.returncode != 0:
        last = "\n".join((done.stdout + done.stderr).strip().splitlines()[-15:])
        raise PeersError(f"{advice}\n{last}")
    return done.stdout


def binary(given, project):
    """Path of the program `gearlash`: the one given, else the release build, made if missing."""
    if given is not None:
        if not os.access(given, os.X_OK):
            raise PeersError(f"--gearlash {given}: not a program")
        return given.resolve()
    built = project / "target" / "release" / "gearlash"
    if not built.exists():
        print("cargo build --release", file=sys.stderr)
        command(["cargo", "build", "--release", "--manifest-path", project / "Cargo.toml"], "gearlash does not build")
    return built


def versions(interpreter, gearlash, programs):
    """Name and version of everything that takes part, as one line."""
    own = command([gearlash, "--version"], f"{gearlash} does not run").strip()
    packages = [package for package in (pin.split("==")[0] for pin in pinned(programs)) if package not in UNTOLD]
    advice = "the virtual environment is damaged; delete it"
    return f"{own}; {command([interpreter, '-c', VERSIONS, *packages], advice).strip()}"


def pinned(programs):
    """The requirements of some programs, each once."""
    return list(dict.fromkeys([*COMMON, *(pin for program in programs for pin in PINS[program])]))


def machine():
    """Date, processor, cores and system as one line."""
    today = datetime.date.today().isoformat()
    return f"{today}, {processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}"


def processor():
    """The processor's name."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def load_warning():
    """A sentence if other work runs on the machine, else None."""
    load = os.getloadavg()[0]
    if load < 0.5:
        return None
    return f"warning: other work runs on this machine (load {load:.1f}): CPU seconds come out longer"
