"""Ctrl+C into a simulated run: the engine takes it for a fault, but the run has no result."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import typer

from stepload.plan.load import load_plan
from stepload_verify.campaign import single
from stepload_verify.campaign.scenario import draw
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign_verb import campaign

ROOT = Path(__file__).parents[3]
CAMPAIGN = ROOT / "procedures/campaign.yaml"
KINDS = ("force_gain",)


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
        run_scenario(draw(load_plan(CAMPAIGN), 1, "one", 0, KINDS), None, at_tick)
    assert len(ticks) >= 50
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_replay_of_a_campaign_prints_no_figure(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(single, "run_loop", interrupted(single.run_loop))
    with pytest.raises(typer.Exit) as left:
        campaign(CAMPAIGN, 1, replay="one-0")
    assert left.value.exit_code == 130
    assert capsys.readouterr() == ("", "interrupted: that run has no result\n")
