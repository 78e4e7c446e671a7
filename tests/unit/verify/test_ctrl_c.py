"""Ctrl+C into a simulated run: the engine takes it for a fault, but the run has no result."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import typer

from stepload.plan.load import load_plan
from stepload_verify.campaign import single
from stepload_verify.campaign.scenario import draw
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign_verb import campaign
from stepload_verify.falsify.scene_file import text_of
from stepload_verify.falsify_verb import falsify
from stepload_verify.trials import outages, wrong_signs
from stepload_verify.trials.contact_quality import whole
from stepload_verify.trials.dynamic import press

ROOT = Path(__file__).parents[3]
CAMPAIGN, FALSIFY = (ROOT / f"procedures/{name}.yaml" for name in ("campaign", "falsify"))


@pytest.fixture(autouse=True)
def hears_ctrl_c() -> Iterator[None]:
    """Also where the tests run in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(loop: Callable[..., Any], run: int = 1) -> Callable[..., Any]:
    """The loop, with Ctrl+C that it swallows in its so manieth run."""
    runs = 0

    def swallows(*args: Any, **kwargs: Any) -> Any:
        nonlocal runs
        runs += 1
        if runs == run:
            with suppress(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
        return loop(*args, **kwargs)

    return swallows


def test_the_engine_takes_it_for_a_fault_and_the_run_has_no_result() -> None:
    ticks = []

    def at_tick(row: object) -> None:
        ticks.append(row)
        if len(ticks) == 50:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run_scenario(draw(load_plan(CAMPAIGN), 1, "two", 0, ()), None, at_tick)
    assert len(ticks) >= 50
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_replay_of_a_campaign_prints_no_figure(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(single, "run_loop", interrupted(single.run_loop))
    with pytest.raises(typer.Exit) as left:
        campaign(CAMPAIGN, 1, replay="0")
    assert left.value.exit_code == 130
    assert capsys.readouterr() == ("", "interrupted: that run has no result\n")


@pytest.mark.parametrize("run", [1, 3])
def test_a_scene_that_is_made_simple_is_not_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, run: int
) -> None:
    """Nor does a simpler one count as judged, whose run Ctrl+C came into."""
    scenario = draw(load_plan(FALSIFY), 1, "two", 0, ())
    at, simple = tmp_path / "scene.json", tmp_path / "simple.json"
    at.write_text(text_of(scenario, {}))
    monkeypatch.setattr(single, "run_loop", interrupted(single.run_loop, run))
    with pytest.raises(typer.Exit) as left:
        falsify(FALSIFY, replay=at, shrink=simple)
    assert left.value.exit_code == 130
    assert capsys.readouterr() == ("", "interrupted: that scene has no result\n")
    assert not simple.exists()


def test_a_run_of_a_trial_has_no_result_either(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for module, name in ((wrong_signs, "run_loop"), (outages, "run_loop"), (press, "run")):
        monkeypatch.setattr(module, name, interrupted(lambda *_, **__: (None, 0.0, None)))
    monkeypatch.setattr(outages, "opened", lambda *_, **__: nullcontext())
    _, _, envelope = press.drawn("as-declared", 3, tmp_path)
    with pytest.raises(KeyboardInterrupt):
        wrong_signs.run(next(wrong_signs.cases()))
    with pytest.raises(KeyboardInterrupt):
        press.judged("as-declared", 3)
    with pytest.raises(KeyboardInterrupt):
        outages._spoiled("", 0.0, envelope, cast(Any, None), cast(Any, None), cast(Any, None))
    run = cast(Any, SimpleNamespace(results={"status": "interrupted"}))
    with pytest.raises(KeyboardInterrupt):
        whole._row(run, envelope.plan, 0.0, 0.0, 0.0)
