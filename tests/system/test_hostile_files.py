"""Files from anybody through identify, recover, replay and run --resume: an answer or exit 2."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from long_ones import long_rows
from real_runs import ENVIRONMENT, ROOT, leave_out_figures

sys.path.insert(0, str(ROOT / "bench" / "fuzz"))

import forge

from stepload.cli.main import main
from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.session.resume import resumable

FEW: dict[str, Any] = {
    "deadline": None,
    "phases": [Phase.explicit, Phase.reuse, Phase.generate],
    "suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
}


@pytest.fixture(scope="module")
def honest(quick_plan: Path, quick_run: Path) -> tuple[Path, forge.Record]:
    """A plan, and the thinned-out record of its dry run."""
    return quick_plan, forge.load(quick_run / "run.mcap", 48)


@pytest.fixture
def contained(tmp_path: Path) -> Iterator[Path]:
    """A directory for one command; next to it and above it nothing may appear."""
    inside = tmp_path / "outer" / "inside"
    inside.mkdir(parents=True)
    yield inside
    assert list((tmp_path / "outer").iterdir()) == [inside]
    assert list(tmp_path.iterdir()) == [tmp_path / "outer"]
    assert not Path("/etc/escape").exists()


def _ends_well(capsys: pytest.CaptureFixture[str], *arguments: object) -> int:
    """Run a command on a hostile file: its exit code is one of ours, and its text is harmless."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["stepload", *map(str, arguments)])
        leave_out_figures(patch)
        with pytest.raises(SystemExit) as ended:
            main()
    out, err = capsys.readouterr()
    assert ended.value.code in (0, 2, 4), err
    json.loads(out)
    assert all(c.isprintable() or c == "\n" for c in out + err)
    return int(ended.value.code or 0)


@settings(max_examples=6, **FEW)
@given(data=st.data())
def test_forged_records_are_replayed_and_repaired_or_refused(
    honest: tuple[Path, forge.Record],
    contained: Path,
    capsys: pytest.CaptureFixture[str],
    data: st.DataObject,
) -> None:
    bad = forge.spoil(honest[1], lambda n: data.draw(st.integers(0, max(n - 1, 0))))
    path = forge.write(bad, contained / "run.mcap.part")
    assert _ends_well(capsys, "replay", path, "--json") in (0, 2, 4)
    if _ends_well(capsys, "recover", path, "--out", contained / "out.mcap", "--json") == 0:
        (contained / "out.mcap").unlink()


@settings(max_examples=15, **FEW)
@given(
    rows=st.lists(
        st.tuples(
            *[st.sampled_from([*map(repr, forge.NUMBERS), "", "1", "x", "1e400", "0x1"])] * 2
        ),
        max_size=12,
    ),
    header=st.sampled_from(["displacement_m,force_n", "force_n;displacement_m", "a,b", "\x00", ""]),
    tail=st.sampled_from(["", "\x1b[2J", '"' * 5000, "\ud800", ",,,,"]),
)
def test_any_curve_is_identified_or_refused(
    contained: Path,
    capsys: pytest.CaptureFixture[str],
    rows: list[tuple[str, str]],
    header: str,
    tail: str,
) -> None:
    path = contained / "curve.csv"
    lines = [header, *(f"{a},{b}" for a, b in rows), tail]
    path.write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")
    assert _ends_well(capsys, "identify", path, "--json") in (0, 2)


@pytest.mark.parametrize("poison", ["conditions", "force", "times", "events", "touches"])
def test_identification_of_poisoned_records(
    honest: tuple[Path, forge.Record],
    contained: Path,
    capsys: pytest.CaptureFixture[str],
    poison: str,
) -> None:
    record = forge.spoil(honest[1], lambda _: 0)
    record.attachments, record.events = dict(honest[1].attachments), list(honest[1].events)
    record.force, record.arm = list(honest[1].force), list(honest[1].arm)
    if poison == "conditions":
        found = json.loads(record.attachments["conditions.json"])
        found["sources"]["smooth_error_m"] = 1e308
        record.attachments["conditions.json"] = json.dumps(found).encode()
    elif poison == "force":
        record.force = [s._replace(wrench=(1e308,) * 6) for s in record.force]
    elif poison == "times":  # an even grid over these would take all the memory there is
        last = record.force[-1]
        record.force = [
            s._replace(receive_time_s=i * 1e-9, device_time_s=float("nan"))
            for i, s in enumerate(record.force)
        ]
        record.force[-1] = last._replace(receive_time_s=1e9, device_time_s=float("nan"))
    elif poison == "events":
        record.events = [{**e, "data": {"mean_n": [[]]}} for e in record.events]
    else:
        record.events = [
            {**e, "data": {**e["data"], "position_m": 1e308}} if e["kind"] == "touch" else e
            for e in record.events
        ]
    path = forge.write(record, contained / "run.mcap")
    assert _ends_well(capsys, "identify", path, "--json") in (0, 2)


def _held(step: object, cycle: object = 1) -> dict[str, Any]:
    return {"time_s": 5.0, "kind": "held", "data": {"loading": True, "step": step, "cycle": cycle}}


@pytest.mark.parametrize(
    "events",
    [
        [_held(-1)], [_held(10**30)], [_held("x")], [_held(None)], [_held(1, 0)], [_held(1, -5)],
        [_held(1.5)], [_held([[]])], [{"time_s": 0.0, "kind": "held", "data": {}}],
    ],
    ids=str,
)  # fmt: skip
def test_a_forged_place_is_not_resumed(
    honest: tuple[Path, forge.Record], contained: Path, events: list[dict[str, Any]]
) -> None:
    plan_file, record = honest
    changed = forge.spoil(record, lambda _: 0)
    changed.attachments, changed.metadata = dict(record.attachments), dict(record.metadata)
    changed.force, changed.arm, changed.ticks = record.force, record.arm, record.ticks
    changed.events = events
    forge.write(changed, contained / "run.mcap")
    with pytest.raises(BadInputError):
        resumable(contained, load_plan(plan_file), dry_run=True)


def _limited(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A command that may use 1.5 GB of address space and 60 s of processor time."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))
        resource.setrlimit(resource.RLIMIT_CPU, (60, 60))

    return subprocess.run(
        [sys.executable, "-m", "stepload", *map(str, arguments)],
        capture_output=True, text=True, check=False, preexec_fn=limit,
        env={**ENVIRONMENT, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip


LARGE: dict[str, Callable[[], bytes]] = {
    "line.csv": lambda: b"time_s,position_m,force_n\n" + b"1" * 300_000_000,
    "zeros.mcap": lambda: b"\x89MCAP0\r\n" + bytes(300_000_000),
    "length.mcap": lambda: b"\x89MCAP0\r\n\x06" + b"\xff" * 7 + b"\x7f" + bytes(99),
}


@pytest.mark.parametrize(
    ("name", "verb"),
    [
        ("line.csv", "identify"),
        ("zeros.mcap", "recover"),
        *long_rows(("zeros.mcap", verb) for verb in ("identify", "replay")),
        *long_rows(("length.mcap", verb) for verb in ("identify", "recover", "replay")),
    ],
)
def test_large_files_take_bounded_memory(name: str, verb: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(LARGE[name]())
    done = _limited(verb, path, "--json")
    assert done.returncode == 2, (verb, done.stderr[-300:])
    assert done.stderr.startswith("error: ")
    path.unlink()
