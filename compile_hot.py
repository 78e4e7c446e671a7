"""Compile the modules that a run spends its time in, from their own unchanged source (mypyc).

python compile_hot.py     once per checkout and change; without a C compiler it says so and goes

The tick, the supervisor, the step controller and the simulated rig run about three times as fast
then, with the same results to the last bit (`tests/system/test_compiled.py`). What is compiled
lies in `.compiled`; `src/stepload/compiled.py` uses it only while it is of the present source.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent
HOT = {
    "src/stepload/engine": (
        "anchor", "force_response", "cadence", "controller", "course", "cross_check", "tracking",
        "force_filter", "motion", "retract_guard",
        "settle", "supervisor", "tare", "tick", "watch", "wrench",
    ),
    "src/stepload/record": ("ring",),
    "drivers/stepload_drivers/sim": (
        "adhesion", "channels", "contact", "creep", "drift_and_creep", "drive", "faults",
        "friction", "lag", "lateral_derating", "laws", "layers", "mechanics", "moving_plate",
        "plant", "sensor_errors", "sensor_load", "simulation", "six_channels", "six_plant",
        "six_tip", "six_world", "springs", "stream", "tip_constraint",
    ),
}  # fmt: skip
"""Not `sim/noise.py`: its endless generators would be made into lists. Not the simulated devices: a
class may inherit from a compiled one only if it is compiled too."""

FILES = [f"{room}/{name}.py" for room, names in HOT.items() for name in names]
OPTIMISE = "1"
"""With 3 the loop of `make demo` takes 3 % less, and compiling a sixth more."""
TYPES = """\
[mypy]
follow_imports = skip
ignore_missing_imports = True
[mypy-numpy.*,stepload.*,stepload_drivers.*]
follow_imports = normal
"""
"""Whose types are read. Those of other libraries change nothing in the machine code, and took two
thirds of the time."""


def _module(path: str) -> str:
    return ".".join(Path(path).with_suffix("").parts[1:])


def _sources() -> dict[str, list[int]]:
    """Every file of the project that the compiled modules import, with its stamp.

    A constant or a type of one that is not compiled may stand in the machine code all the same.
    """
    from stepload.compiled import PURE, stamp_of

    code = (
        "import sys, importlib\n"
        f"for name in {[_module(path) for path in FILES]}: importlib.import_module(name)\n"
        "for module in list(sys.modules.values()):\n"
        "    if module.__name__.split('.')[0] in ('stepload', 'stepload_drivers'):\n"
        "        print(module.__file__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, PURE: "1"}, check=True,
        capture_output=True, text=True,
    )  # fmt: skip
    files = [Path(__file__), *map(Path, done.stdout.splitlines())]
    names = sorted({str(file.relative_to(ROOT)) for file in files})
    return {name: stamp_of(str(ROOT / name)) for name in names}


def _compile(into: Path, work: Path) -> None:
    """Machine code of the hot modules into a directory.

    Raises:
        ImportError: mypyc is not installed.
        SystemExit: mypyc, the compiler or the linker refuses.
    """
    from mypyc.build import mypycify
    from setuptools import Distribution
    from setuptools.command.build_ext import build_ext

    class BuildOnAllCores(build_ext):  # type: ignore[misc]  # setuptools says no types
        """All modules are one extension: its C files are compiled side by side."""

        def build_extension(self, extension: Any) -> None:
            one_by_one = self.compiler.compile

            def side_by_side(sources: list[str], **options: Any) -> list[str]:
                with ThreadPoolExecutor(os.cpu_count()) as pool:
                    made = pool.map(lambda source: one_by_one([source], **options), sources)
                    return [name for names in made for name in names]

            self.compiler.compile = side_by_side
            super().build_extension(extension)

    os.environ["MYPYPATH"] = "src:drivers"
    (settings := work / "mypy.ini").write_text(TYPES, "utf-8")
    extensions = mypycify(
        ["--config-file", str(settings), "--cache-dir", str(work / "cache"), *FILES],
        opt_level=OPTIMISE, debug_level="0", multi_file=True, group_name="stepload",
        target_dir=str(work / "c"),
    )  # fmt: skip
    for extension in extensions:  # no fused multiply-add: its last bit is another
        extension.extra_compile_args.append("-ffp-contract=off")
    distribution = Distribution({"name": "stepload-compiled", "ext_modules": extensions})
    command = BuildOnAllCores(distribution)
    command.build_lib, command.build_temp = str(into), str(work / "o")
    command.ensure_finalized()
    command.run()


def main() -> int:
    sys.path.insert(0, str(ROOT / "src"))
    from stepload.compiled import LIST, PLACE, PURE, use

    if os.environ.get(PURE):
        print(f"compiled modules: none, {PURE} is set")
        return 0
    if use(ROOT):
        return 0
    if not os.access(ROOT, os.W_OK):
        print("compiled modules: none, nothing can be written here; Python does the same, slower")
        return 0
    print("compiling the hot modules, once, about a minute", flush=True)
    os.chdir(ROOT)
    try:
        sources = _sources()
    except subprocess.CalledProcessError as error:
        print(f"{error.stderr}compiled modules: none, they cannot be imported")
        return 0
    with tempfile.TemporaryDirectory(dir=ROOT, prefix=".compiling-") as name:
        work = Path(name)
        log = work / "log"
        with open(log, "w", encoding="utf-8") as out:
            ran = subprocess.run(
                [sys.executable, __file__, "--into", str(work)], stdout=out, stderr=out
            )
        if ran.returncode:
            lines = log.read_text(encoding="utf-8").splitlines()
            print("\n".join(lines[-5:]))
            print("compiled modules: none, see above; the Python source does the same, slower")
            return 0
        made = work / "made"
        suffix = sysconfig.get_config_var("EXT_SUFFIX")
        found = sorted(path.relative_to(made) for path in made.rglob(f"*{suffix}"))
        modules = {".".join(path.parts).removesuffix(suffix): str(path) for path in found}
        sizes = {str(path): (made / path).stat().st_size for path in found}
        listed = {"sources": sources, "modules": modules, "sizes": sizes}
        (made / LIST).write_text(json.dumps(listed), "utf-8")
        _put(made, ROOT / PLACE)
    return 0


def _put(made: Path, place: Path) -> None:
    """Put what was made in its place, unless another process has put the same there meanwhile."""
    place.parent.mkdir(exist_ok=True)
    with suppress(OSError):
        place.rename(made.with_name("former"))
    try:
        made.rename(place)
    except OSError:
        if not place.is_dir():
            raise


if __name__ == "__main__":
    if sys.argv[1:2] == ["--into"]:
        _compile(Path(sys.argv[2]) / "made", Path(sys.argv[2]))
        sys.exit(0)
    sys.exit(main())
