"""A page as a PDF, made by Chromium or WeasyPrint in a process of its own.

Neither is needed for anything else: where both are missing, or both fail, a message says so. The
converter gets no network: the page forbids any request, and the browser resolves no name.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
PAPERS = {"a4": "A4", "letter": "letter"}
"""Sizes of paper by their names on the command line, as CSS calls them."""
TIMEOUT_S = 90.0
_NO_NETWORK = (
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--proxy-server=127.0.0.1:9",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-domain-reliability",
    "--disable-sync",
    "--disable-extensions",
    "--disable-quic",
)
_WEASYPRINT = """
import sys
from weasyprint import HTML
def nothing(url, *args, **kwargs):
    raise ValueError(f"not fetched: {url[:80]}")
def only_data(url, *args, **kwargs):
    if not url.startswith("data:"):
        nothing(url)
    from weasyprint.urls import URLFetcher
    return URLFetcher().fetch(url)
HTML(filename=sys.argv[1], url_fetcher=only_data, base_url="about:blank").write_pdf(sys.argv[2])
"""


@dataclass(frozen=True, slots=True)
class Printed:
    """Result of a conversion: `by` made the PDF, or `problem` says why there is none."""

    path: Path
    by: str = ""
    problem: str = ""

    @property
    def line(self) -> str:
        """The result as a line of text."""
        return f"pdf: {self.path}" if self.by else f"no PDF: {self.problem}"


def print_page(page: Path, paper: str = "a4", *, timeout_s: float = TIMEOUT_S) -> Printed:
    """Write the PDF of an HTML page next to it, with the same name; never raises.

    Args:
        page: one that `stepload.results.page.render` made.
        paper: a name in `PAPERS`.
        timeout_s: time after which a converter is ended.
    """
    target = page.with_suffix(".pdf")
    try:
        with tempfile.TemporaryDirectory(prefix="stepload-pdf-") as place:
            return _printed(page, target, paper, Path(place), timeout_s)
    except OSError as error:
        return Printed(target, problem=f"{error.filename or target}: {error.strerror or error}")


def _printed(page: Path, target: Path, paper: str, place: Path, timeout_s: float) -> Printed:
    source, made = place / "page.html", place / "page.pdf"
    source.write_text(sized(page.read_text(encoding="utf-8"), paper), encoding="utf-8")
    problems = []
    for name, command in _converters(source, made, place):
        problem = _convert(command, place, timeout_s)
        if not problem and _is_pdf(made):
            _put(made, target)
            return Printed(target, by=name)
        problems.append(f"{name} {problem or 'wrote no PDF'}")
    if not problems:
        problems.append(
            "neither Chromium nor WeasyPrint is installed (pip install 'stepload[pdf]', or print "
            f"{page} from any browser)"
        )
    return Printed(target, problem="; ".join(problems))


def sized(page: str, paper: str) -> str:
    """The page for one size of paper; without it, the size is chosen when printing."""
    return page.replace("</style>", f"@page{{size:{PAPERS[paper]}}}\n</style>", 1)


def _converters(source: Path, made: Path, place: Path) -> list[tuple[str, Sequence[str]]]:
    found: list[tuple[str, Sequence[str]]] = []
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is not None:
        as_root = ["--no-sandbox"] if os.geteuid() == 0 else []  # it refuses to start else
        command = [
            browser, "--headless", "--disable-gpu", "--no-first-run", *as_root, *_NO_NETWORK,
            f"--user-data-dir={place / 'profile'}", "--no-pdf-header-footer",
            f"--print-to-pdf={made}", source.as_uri(),
        ]  # fmt: skip
        found.append((Path(browser).name, command))
    if find_spec("weasyprint") is not None:
        found.append(("WeasyPrint", [sys.executable, "-c", _WEASYPRINT, str(source), str(made)]))
    return found


def _convert(command: Sequence[str], place: Path, timeout_s: float) -> str:
    """Run a converter with all its child processes; returns "" or what went wrong."""
    with (place / "said").open("wb") as said:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, cwd=place,
            start_new_session=True,
        )  # fmt: skip
        try:
            code = process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return f"was ended after {timeout_s:g} s"
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    if code == 0:
        return ""
    lines = (place / "said").read_text(errors="replace").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return f"ended with exit code {code}: {last[:200]}".rstrip(": ")


def _is_pdf(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(5) == b"%PDF-"
    except OSError:
        return False


def _put(made: Path, target: Path) -> None:
    """Move the complete file to its place; a link of that name is replaced, not followed."""
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        shutil.copyfile(made, partial)
        os.replace(partial, target)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise
