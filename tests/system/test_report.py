"""The report in a real browser: nothing on the console, nothing fetched, every figure shown."""

from __future__ import annotations

import hashlib
from pathlib import Path

import chromium
import pytest

from stepload.report.provenance import UNFINISHED

FIGURES = ["law", "residuals", "time", "limit"]


@pytest.mark.browser
@pytest.mark.skipif(chromium.PATH is None, reason="chromium is not installed: no browser to look")
def test_the_report_in_chromium(cycles_again: Path, tmp_path: Path) -> None:
    with chromium.page(tmp_path / "profile") as page:
        page.open(cycles_again / "report.html")
        assert page.evaluate("document.querySelector('.word').textContent") == "identified"
        shown = page.evaluate("[...document.querySelectorAll('figure')].map(f => f.id)")
        assert shown == FIGURES
        broken = page.evaluate(
            "[...document.images].filter(i => !i.complete || !i.naturalWidth || !i.alt).length"
        )
        assert broken == 0
        for name in FIGURES:
            pixels = page.picture(f"#{name} img")
            assert min(pixels.shape[:2]) > 200
            ink = (abs(pixels[..., :3] - pixels[0, 0, :3]).max(axis=2) > 0.1).mean()
            assert ink > 0.01, f"{name} is blank"
        for width in (1100, 400):
            page.call(
                "Emulation.setDeviceMetricsOverride",
                width=width, height=900, deviceScaleFactor=1, mobile=False,
            )  # fmt: skip
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.call("Emulation.setEmulatedMedia", media="print")
        lost = "e => e.scrollHeight > e.clientHeight + 1 || e.scrollWidth > e.clientWidth + 1"
        assert page.evaluate(f"[...document.querySelectorAll('pre')].filter({lost}).length") == 0
        assert page.evaluate("document.querySelectorAll('pre').length") > 4
        assert page.complaints == []
        assert page.requests == []


def test_the_report_knows_the_record_that_lies_beside_it(cycles_run: Path) -> None:
    page = (cycles_run / "report.html").read_text()
    assert hashlib.sha256((cycles_run / "run.mcap").read_bytes()).hexdigest() in page
    assert "messages, force" in page
    assert UNFINISHED not in page
