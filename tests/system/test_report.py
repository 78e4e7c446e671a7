"""The report in a real browser: nothing on the console, nothing fetched, every figure shown."""

from __future__ import annotations

from pathlib import Path

import chromium
import pytest

FIGURES = ["time", "limit", "law", "residuals", "ellipse"]


@pytest.mark.browser
@pytest.mark.skipif(chromium.PATH is None, reason="chromium is not installed: no browser to look")
def test_the_report_in_chromium(cycles_run: Path, tmp_path: Path) -> None:
    with chromium.page(tmp_path / "profile") as page:
        page.open(cycles_run / "report.html")
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
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert page.complaints == []
        assert page.requests == []
