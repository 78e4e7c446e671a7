"""The report in a real browser: nothing on the console, nothing fetched, every figure shown."""

from __future__ import annotations

import hashlib
from pathlib import Path

import chromium

from stepload.report.provenance import UNFINISHED

FIGURES = ["law", "residuals", "time", "limit"]


@chromium.needed
def test_the_report_in_chromium(cycles_again: Path) -> None:
    complaints: list[str] = []
    requests: list[str] = []
    url = (cycles_again / "report.html").as_uri()
    with chromium.tab(complaints, requests) as page:
        page.goto(url)
        assert page.text_content(".word") == "identified"
        assert page.evaluate("[...document.querySelectorAll('figure')].map(f => f.id)") == FIGURES
        broken = "i => !i.complete || !i.naturalWidth || !i.alt"
        assert page.evaluate(f"[...document.images].filter({broken}).length") == 0
        for name in FIGURES:
            image = page.locator(f"#{name} img")
            assert min(chromium.picture(image).shape[:2]) > 200
            assert chromium.ink(image) > 0.01, f"{name} is blank"
        for size in (chromium.WIDE, chromium.NARROW):
            page.set_viewport_size(size)
            assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        page.emulate_media(media="print")
        lost = "e => e.scrollHeight > e.clientHeight + 1 || e.scrollWidth > e.clientWidth + 1"
        assert page.evaluate(f"[...document.querySelectorAll('pre')].filter({lost}).length") == 0
        assert page.evaluate("document.querySelectorAll('pre').length") > 4
    assert complaints == []
    assert requests == [url]


def test_the_report_knows_the_record_that_lies_beside_it(cycles_run: Path) -> None:
    page = (cycles_run / "report.html").read_text()
    assert hashlib.sha256((cycles_run / "run.mcap").read_bytes()).hexdigest() in page
    assert "messages, force" in page
    assert UNFINISHED not in page
