"""Every plan in procedures/ through `preflight --json` and `run --dry-run --json`."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from real_runs import ROOT, leave_out_figures

from stepload.cli.main import main
from stepload.engine.first_loading import true_deformation
from stepload.engine.rehearse import payload_truth
from stepload.feasibility.theory import theory_of
from stepload.plan.load import load_plan
from stepload.record.reader import read_recording
from stepload.session import experiment, files

PROCEDURES = ROOT / "procedures"
UNSAFE, UNIDENTIFIABLE = "top_force_above_safe_limit", "unidentifiable"

VERDICTS: dict[str, tuple[str, set[str]]] = {
    "aluminium-sphere": ("refused", {UNSAFE, UNIDENTIFIABLE}),
    "campaign": ("go", set()),
    "demo-wire": ("warn", {"patient"}),
    "plastic-cone": ("refused", {UNSAFE}),
    "plastic-cube": ("refused", {UNIDENTIFIABLE}),
    "plastic-prism": ("refused", {UNIDENTIFIABLE}),
    "plastic-pyramid": ("refused", {UNSAFE, "tip_exceeded"}),
    "plastic-sphere": ("go", set()),
    "run-in": ("go", set()),
    "system-stiffness": ("go", set()),
    "ur16e-polyurethane-sphere": ("warn", {"stiffness_indicative", "friction_unknown"}),
    "ur5e-silicone-sphere": ("warn", {"stiffness_indicative", "friction_unknown"}),
}
"""Verdict, and the codes of the reasons that refuse or warn."""
RUNNING = [name for name, (verdict, _) in VERDICTS.items() if verdict != "refused"]
LONG = {
    "demo-wire",
    "run-in",
    "system-stiffness",
    "ur16e-polyurethane-sphere",
    "ur5e-silicone-sphere",
}
"""As the others in all but their length; `make long`."""
REFUSED = [name for name, (verdict, _) in VERDICTS.items() if verdict == "refused"]

PREFLIGHT_FIELDS = {
    "verdict": str, "reasons": list, "elastic_limit_n": float, "largest_safe_force_n": float,
    "k_max_n_per_m": float, "secant_n_per_m": float, "guarded_speed_m_s": float,
    "force_budget": list, "duration_s": (int, float),
}  # fmt: skip


@dataclass(frozen=True)
class Ran:
    """One command: exit code, its JSON object, what it printed for people, the run's truth."""

    code: int
    data: dict[str, Any]
    text: str
    true_peak_n: float


def command(capsys: pytest.CaptureFixture[str], *arguments: object) -> Ran:
    """One `stepload` command in this process; exactly one JSON object on standard output."""
    peaks: list[float] = []
    opened = experiment.opened

    @contextmanager
    def watched(*args: Any, **kwargs: Any) -> Iterator[Any]:
        with opened(*args, **kwargs) as rig:
            yield rig
            peaks.append(rig.world.true_peak_force_n)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["stepload", *map(str, arguments)])
        patch.setattr(experiment, "opened", watched)
        patch.setattr(files, "render", lambda page: "")
        with pytest.raises(SystemExit) as ended:
            main()
    out, err = capsys.readouterr()
    return Ran(int(ended.value.code or 0), json.loads(out), err, max(peaks, default=0.0))


@pytest.mark.parametrize("name", VERDICTS)
def test_preflight(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    verdict, codes = VERDICTS[name]
    ran = command(capsys, "preflight", PROCEDURES / f"{name}.yaml", "--json")
    assert (ran.code, ran.data["verdict"]) == (3 if verdict == "refused" else 0, verdict)
    severe = [reason for reason in ran.data["reasons"] if reason["severity"] != "note"]
    assert {reason["code"] for reason in severe} == codes
    assert all(reason["message"] and reason["remedy"] for reason in severe)
    for field, kind in PREFLIGHT_FIELDS.items():
        if ran.data[field] is None:  # nothing to say of a K_max or a speed
            assert UNSAFE in codes or name == "system-stiffness", field
            continue
        assert isinstance(ran.data[field], kind), field
    for term in ran.data["force_budget"]:
        assert set(term) == {"name", "value_n", "source"}
        assert term["value_n"] >= 0.0
    supervised = {limit["source"].split(":")[0] for limit in ran.data["limits"]}
    if verdict == "refused":
        assert not supervised
    else:
        rules = {*(f"R{number}" for number in range(3, 11)), "R1, R2", "CAP"}
        assert rules <= supervised
        assert ran.data["force_budget"]
        assert ran.data["duration_s"] > 1.0
        assert ran.data["largest_safe_force_n"] < ran.data["elastic_limit_n"]


@pytest.mark.parametrize("name", REFUSED)
def test_refused_plans_do_not_run(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    plan = PROCEDURES / f"{name}.yaml"
    ran = command(capsys, "run", plan, "--dry-run", "--json", "--out", tmp_path / "run")
    assert (ran.code, ran.data["exit_code"]) == (3, 3)
    assert "preflight refused the plan" in ran.data["error"]
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long) if name in LONG else name for name in RUNNING],
)
def test_the_others_run(
    name: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    leave_out_figures(monkeypatch)
    path = PROCEDURES / f"{name}.yaml"
    if name not in ("plastic-sphere", "campaign"):  # one is as patient as it is meant to be
        path = _sooner(path, tmp_path / path.name)
    ran = command(capsys, "run", path, "--dry-run", "--json", "--quiet", "--out", tmp_path / "run")
    data = ran.data
    assert ran.code == 0, ran.text
    assert data["status"] == "completed"
    assert data["why_it_ended"].startswith("The run was completed.")
    assert 0.0 < ran.true_peak_n < data["elastic_limit_n"]
    plan = load_plan(path)
    assert data["levels_done"] == len(plan.procedure.levels_n) * plan.procedure.cycles
    recording = read_recording(tmp_path / "run" / "run.mcap")
    assert not recording.partial
    assert recording.attachments["plan.yaml"] == path.read_bytes()
    if name == "system-stiffness":
        assert data["system_stiffness"]["stiffness_n_per_m"] == pytest.approx(3.49e6, rel=0.03)
        return
    expected = data["fits"][data["selected"]]
    low, high = data["interval_secant_n_per_m"]
    assert low < expected["secant_n_per_m"] < high
    for fit in ("rs_btls", "rs_rtls", "joint"):
        assert {"k", "n", "zero_m", "secant_n_per_m"} <= set(data["fits"][fit])
    assert data["verdict"] in ("identified", "marginal")
    assert all(isinstance(reason, str) for reason in data["reasons"])
    truth = payload_truth(plan.payload, theory_of(plan.payload), plan.rig.simulation)
    headline = data["headline"]
    assert headline["kind"] == "chord"
    assert headline["from_n"] == pytest.approx(0.1 * plan.procedure.top_force_n, rel=0.05)
    assert headline["to_n"] == pytest.approx(plan.procedure.top_force_n, rel=0.02)
    low_n, high_n = headline["from_n"], headline["to_n"]
    travel_m = true_deformation(truth, high_n) - true_deformation(truth, low_n)
    _holds(headline, (high_n - low_n) / travel_m)
    if name == "plastic-sphere":  # `make demo`
        low, high = (each / 1e6 for each in headline["interval_n_per_m"])
        told = f"Chord stiffness {headline['value_n_per_m'] / 1e6:.2f} MN/m, 95 %"
        told += f" [{low:.2f}, {high:.2f}] MN/m, from"
        assert told in (PROCEDURES.parent / "README.md").read_text()
    if (mean_plane := data["quantities"].get("secant_from_mean_plane")) is not None:
        to_n = mean_plane["to_n"]
        _holds(mean_plane, to_n / true_deformation(truth, to_n))


def _holds(quantity: dict[str, Any], truth: float) -> None:
    low, high = quantity["interval_n_per_m"]
    assert low < quantity["value_n_per_m"] < high
    assert low < truth < high, (quantity["kind"], truth / quantity["value_n_per_m"])


def _sooner(shipped: Path, path: Path) -> Path:
    """The plan with short waits, a short search and one cycle in place of three."""
    text = shipped.read_text().replace("payload: payloads", f"payload: {PROCEDURES}/payloads")
    waits = {"hold": "0.3 s", "tare": "0.5 s", "warm_up": "0 s", "surface_uncertainty": "0.3 mm"}
    for key, short in waits.items():
        text = re.sub(rf"^  {key}: .*\n", "", text, flags=re.MULTILINE)
        text = text.replace("procedure:\n", f"procedure:\n  {key}: {short}\n")
    path.write_text(text.replace("cycles: 3", "cycles: 1"))
    return path


def test_identify_says_the_same_as_the_run(
    cycles_run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the file again: the same fits, the same interval."""
    at_once = json.loads((cycles_run / "results.json").read_text())
    assert at_once["verdict"] == "identified"
    later = command(capsys, "identify", cycles_run / "run.mcap", "--json")
    assert later.code == 0
    for key in ("selected", "fits", "headline", "quantities", "inelastic", "verdict", "reasons"):
        assert later.data[key] == at_once[key]


def told(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """What a person reads of one `stepload` command in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["stepload", *map(str, arguments)])
        with pytest.raises(SystemExit):
            main()
    return capsys.readouterr().out


def test_replay_does_not_trip(cycles_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = cycles_run / "run.mcap"
    assert command(capsys, "replay", record, "--json").data["tripped"] is False
    lower = command(capsys, "replay", record, "--force-limit", "200 N", "--json")
    assert (lower.code, lower.data["tripped"]) == (4, True)
    assert lower.data["cause"]["rule"] in ("R1", "R2", "CAP")
    assert lower.data["phase"] in ("LOAD", "HOLD")


def test_help_is_quick() -> None:
    """What takes long to import is imported by the verb that needs it."""
    import subprocess

    program = (
        "import sys; sys.argv = ['stepload', '--help']\n"
        "from stepload.cli.main import main\n"
        "try: main()\n"
        "except SystemExit as end: code = end.code\n"
        "slow = {'numpy', 'scipy', 'matplotlib', 'ruamel', 'mcap', 'can', 'serial'}\n"
        "print(code, sorted(slow & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "0 []"
