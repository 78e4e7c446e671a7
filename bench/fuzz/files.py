"""Coverage-guided fuzzing of what reads files (needs the `fuzz` extra).

python bench/fuzz/files.py TARGET [libFuzzer options] [corpus directory]

TARGET is plan (YAML), curve (CSV), record (bytes of an MCAP), repair (the same through `recover`)
or forged (a well-formed record with poison in it, through `replay`). Any error but a clear refusal
is a finding. `--corpus` writes a first corpus and ends.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
from pathlib import Path

import atheris  # type: ignore[import-not-found, unused-ignore]

with atheris.instrument_imports(include=["stepload"]):
    from stepload.engine.replay import replay_file
    from stepload.errors import SteploadError
    from stepload.plan.load import load_plan
    from stepload.record.curves import read_curve
    from stepload.record.reader import read_recording
    from stepload.record.recovery import recover

import forge

PLACE = Path(tempfile.mkdtemp(prefix="stepload-fuzz-"))
ROOT = Path(__file__).parents[2]


def plan(data: bytes) -> None:
    path = PLACE / "plan.yaml"
    path.write_bytes(data)
    load_plan(path)


def curve(data: bytes) -> None:
    path = PLACE / "curve.csv"
    path.write_bytes(data)
    found = read_curve(path)
    if len(found.force_n) < 3:
        raise AssertionError("a curve of fewer than three points was accepted")


def record(data: bytes) -> None:
    path = PLACE / "run.mcap"
    path.write_bytes(data)
    read_recording(path)


def repair(data: bytes) -> None:
    path, out = PLACE / "cut.mcap", PLACE / "out.mcap"
    path.write_bytes(data)
    out.unlink(missing_ok=True)
    recover(path, out)


def forged(data: bytes) -> None:
    source = atheris.FuzzedDataProvider(data)
    bad = forge.spoil(_honest(), lambda n: source.ConsumeIntInRange(0, max(n - 1, 0)))
    replay_file(forge.write(bad, PLACE / "forged.mcap"))


_loaded: list[forge.Record] = []


def _honest() -> forge.Record:
    """A short run, made once."""
    if not _loaded:
        from stepload.feasibility.preflight import preflight_of
        from stepload.plan.load import load_plan as load
        from stepload.session.experiment import run_plan

        preflight = preflight_of(load(ROOT / "procedures" / "campaign.yaml"))
        made = run_plan(preflight, dry_run=True, out=PLACE / "r")
        _loaded.append(forge.load(made.directory / "run.mcap", 64))
    return _loaded[0]


TARGETS = {"plan": plan, "curve": curve, "record": record, "repair": repair, "forged": forged}


def corpus(name: str, directory: Path) -> None:
    """Honest inputs to begin with."""
    directory.mkdir(parents=True, exist_ok=True)
    if name == "plan":
        for path in (ROOT / "procedures").rglob("*.yaml"):
            (directory / path.name).write_bytes(path.read_bytes())
    elif name == "curve":
        rows = "".join(f"{i * 0.1},{i * 1e-6},{i * 2.5}\n" for i in range(20))
        (directory / "curve.csv").write_text("time_s,position_m,force_n\n" + rows)
    elif name in ("record", "repair"):
        short = _honest()
        short.force, short.arm, short.ticks = short.force[:9], short.arm[:9], short.ticks[:9]
        short.second = short.second[:9]
        forge.write(short, directory / "short.mcap")


def main() -> None:
    name = sys.argv.pop(1)
    target = TARGETS[name]
    if sys.argv[1:2] == ["--corpus"]:
        corpus(name, Path(sys.argv[2]))
        return

    def one_input(data: bytes) -> None:
        with contextlib.suppress(SteploadError):
            target(data)

    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
