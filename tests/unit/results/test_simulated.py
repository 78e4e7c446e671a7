"""What came from a simulated rig says so on top, in a terminal and on a page."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stepload.results.model import SIMULATED, Document, Verdict
from stepload.results.page import render
from stepload.results.terminal import Output

MEASURED = Document("ball", Verdict("good", "identified", "5 MN/m"))


def test_the_first_line_and_the_verdict_say_it(capsys: pytest.CaptureFixture[str]) -> None:
    Output(as_json=False).show(replace(MEASURED, simulated=True))
    lines = capsys.readouterr().out.splitlines()
    assert lines == ["SIMULATED, IDENTIFIED   5 MN/m"]


def test_a_measurement_does_not(capsys: pytest.CaptureFixture[str]) -> None:
    Output(as_json=False).show(MEASURED)
    assert "SIMULATED" not in capsys.readouterr().out
    assert "simulated · " not in render(MEASURED)


def test_the_page_says_it_in_title_banner_and_verdict() -> None:
    page = render(replace(MEASURED, simulated=True))
    assert "<title>SIMULATED – ball" in page
    body = page.partition("<main>")[2]
    assert body.index(SIMULATED) < body.index("<h1>")
    assert body.index("simulated · </b>") < body.index('<b class="word">identified')
