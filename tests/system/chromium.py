"""A page in headless Chromium: what it logs, fetches and shows."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Locator, Page, sync_playwright

PATH = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE_MS = 60_000.0
WIDE: Any = {"width": 1100, "height": 900}
NARROW: Any = {"width": 400, "height": 900}


def needed(test: Any) -> Any:
    """Mark a test that looks into a browser."""
    skip = pytest.mark.skipif(PATH is None, reason="chromium is not installed: no browser to look")
    return pytest.mark.browser(skip(test))


@contextmanager
def tab(complaints: list[str], requests: list[str]) -> Iterator[Page]:
    """A tab of a fresh browser.

    Args:
        complaints: gets console errors and warnings, exceptions, and failed requests.
        requests: gets every address that is asked for, except data.
    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=PATH, args=FLAGS)
        page = browser.new_page(viewport=WIDE)
        page.set_default_timeout(PATIENCE_MS)
        page.on("console", lambda m: m.type == "log" or complaints.append(f"{m.type}: {m.text}"))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda r: r.url.startswith("data:") or requests.append(r.url))
        yield page
        browser.close()


def picture(element: Locator) -> NDArray[np.float32]:
    """Pixels (height, width, channels) of one element."""
    from matplotlib.image import imread

    pixels: NDArray[np.float32] = imread(io.BytesIO(element.screenshot()))
    return pixels


def ink(element: Locator) -> float:
    """Share of the pixels of an element that differ from its corner."""
    pixels = picture(element)[..., :3]
    return float((abs(pixels - pixels[0, 0]).max(axis=2) > 0.1).mean())
