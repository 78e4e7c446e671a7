"""The page of `stepload ui`: in a browser, at its door, and what it reads."""

from __future__ import annotations

import base64
import json
import os
import shutil
import signal
import ssl
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import anyio
import chromium
import numpy as np
import pytest
from real_runs import ENVIRONMENT, ROOT, Staged, in_process
from test_live import Growing
from websockets.sync.client import connect

from stepload.errors import BadInputError
from stepload.live.view import address_of, live_view
from stepload.record.reader import read_recording
from stepload.record.rows import Phase
from stepload.ui.app import apart
from stepload.ui.folder import check, curve, curves_of
from stepload.ui.follow import Follower

PLAN = (ROOT / "procedures" / "plastic-sphere.yaml").read_text()


class Served(NamedTuple):
    """A page that is served: where, and the token."""

    url: str
    token: str

    def ask(self, path: str, body: object = None, **headers: str) -> tuple[int, Any, Any]:
        """Status, headers and content of an answer; names of headers have _ for -."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data)
        for name, value in {"Content_Type": "application/json", **headers}.items():
            request.add_header(name.replace("_", "-"), value)
        unchecked = ssl._create_unverified_context() if self.url.startswith("https") else None
        try:
            with urllib.request.urlopen(request, timeout=120, context=unchecked) as answer:
                status, told, content = answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                status, told, content = error.code, error.headers, error.read()
        is_json = told.get("Content-Type") == "application/json"
        return status, told, json.loads(content) if is_json else content


@contextmanager
def served(directory: Path, *options: object) -> Iterator[Served]:
    """The page of a folder, in a process of its own, ended with Ctrl+C."""
    words = ["ui", directory, "--port", 0, "--json", *options]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "stepload", *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=ENVIRONMENT, cwd=directory,
    )  # fmt: skip
    with process:
        try:
            assert process.stdout is not None
            told = json.loads(process.stdout.readline())
            yield Served(told["url"].partition("/#")[0], told["token"])
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0


@pytest.fixture
def lab(tmp_path: Path, quick_run: Path) -> Path:
    """A folder with a run and a plan; outside it a payload and a run that a link leads to."""
    folder = tmp_path / "lab"
    shutil.copytree(quick_run, folder / "runs" / "first")
    shutil.copytree(quick_run, tmp_path / "other")
    shutil.copytree(ROOT / "procedures" / "payloads", folder / "payloads")
    shutil.copytree(ROOT / "procedures" / "payloads", tmp_path / "payloads")
    (folder / "plan.yaml").write_text(PLAN)
    (folder / "pickle.py").write_text("raise SystemExit")  # no process may import it
    (folder / "runs" / "linked").symlink_to(tmp_path / "other")
    (tmp_path / "secret.html").write_text("secret")
    os.mkfifo(folder / "runs" / "pipe.mcap")  # to open it would wait for ever
    (folder / "runs" / "third").mkdir()
    (folder / "runs" / "third" / "run.mcap").symlink_to(tmp_path / "other" / "run.mcap")
    (folder / "runs" / "second").mkdir()
    (folder / "runs" / "second" / "run.mcap").write_bytes(b"no record")
    (folder / "runs" / "second" / "report.html").symlink_to(tmp_path / "secret.html")
    return folder


def test_the_door_and_the_folder(lab: Path) -> None:
    with served(lab) as page:
        status, headers, content = page.ask("/")
        assert status == 200
        assert b"uPlot" in content
        assert "default-src 'self'" in headers["Content-Security-Policy"]
        port = page.url.rpartition(":")[2]
        for path, body, sent, expected in (
            ("/", None, {"Host": f"evil.example:{port}"}, 421),
            ("/api/runs", None, {"Sec_Fetch_Site": "cross-site"}, 403),
            ("/api/preflight", {"name": "", "text": PLAN}, {"Origin": "http://evil.example"}, 403),
            ("/api/preflight", {"name": "", "text": PLAN}, {"Content_Type": "text/plain"}, 415),
            ("/api/preflight", {"name": "", "text": "x" * 3_000_000}, {}, 400),
            ("/api/preflight", {"name": "../plan.yaml", "text": PLAN}, {}, 400),
            ("/api/preflight", [], {}, 400),
            ("/api/request", {"name": "runs/first", "text": "stop"}, {}, 401),
            ("/api/request", {"name": "runs/first", "text": "stop"}, {"Origin": page.url}, 401),
            ("/api/request", {"name": "runs/first", "text": "stop"},
             {"X_Stepload_Token": page.token, "Origin": "http://evil.example"}, 403),
            ("/api/request", {"name": "runs/first", "text": "start"},
             {"X_Stepload_Token": page.token}, 400),
            ("/api/curves?run=../other", None, {}, 400),
            (f"/api/curves?run={lab.parent / 'other'}", None, {}, 400),
            ("/api/curves?run=runs/linked", None, {}, 400),
            ("/api/curves?run=runs%00", None, {}, 400),
            ("/api/curves?run=plan.yaml", None, {}, 400),
            ("/api/curves?run=runs/second", None, {}, 400),
            ("/api/report?run=runs/second", None, {}, 400),
            ("/api/live?run=runs/first", None, {}, 400),
            ("/api/plan?name=../secret.html", None, {}, 400),
            ("/../pyproject.toml", None, {}, 404),
        ):  # fmt: skip
            assert page.ask(path, body, **sent)[0] == expected, (path, sent)
        row, damaged = page.ask("/api/runs")[2]["runs"]
        assert damaged["problem"]
        assert (row["key"], row["live"], row["simulated"]) == ("runs/first", False, True)
        assert page.ask("/api/plans")[2]["plans"] == ["plan.yaml"]
        _, headers, report = page.ask("/api/report?run=runs/first")
        assert report == (lab / "runs" / "first" / "report.html").read_bytes()
        assert "sandbox" in headers["Content-Security-Policy"]
        token = {"X_Stepload_Token": page.token, "Origin": page.url}
        status, _, told = page.ask("/api/request", {"name": "runs/first", "text": "stop"}, **token)
        assert (status, "error" in told) == (400, True)  # it is over
        status, _, on = page.ask("/api/request", {"name": "runs/first", "text": "resume"}, **token)
        assert status == 400
        assert on["error"] != told["error"]  # it would be refused if the run went on


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("300 N", "300 kg", 8),
        ("payload: ", "payload: ../", 4),
        ("payload: ", f"payload: {ROOT}/procedures/", 4),
        ("payload: payloads/plastic-sphere.yaml", "payload: link.yaml", 4),
    ],
)
def test_a_problem_of_a_plan_has_its_line(lab: Path, old: str, new: str, line: int) -> None:
    (lab / "link.yaml").symlink_to(lab.parent / "payloads" / "plastic-sphere.yaml")
    assert check(lab, "plan.yaml", PLAN)["verdict"] == "go"
    [problem] = check(lab, "plan.yaml", PLAN.replace(old, new))["problems"]
    assert (problem["line"], problem["here"]) == (line, True)


def test_a_finding_has_the_line_of_the_text_that_is_edited(lab: Path) -> None:
    told = check(lab, "plan.yaml", "# a line that is not saved\n" + PLAN.replace("300 N", "900 N"))
    assert told["verdict"] == "refused"
    first = told["findings"][0]
    assert (first["severity"], first["line"]) == ("refuse", 9)


def test_others_on_the_network_need_tls_and_the_token(lab: Path, tmp_path: Path) -> None:
    live = ("run", lab / "plan.yaml", "--dry-run", "--live", "--live-address", "0.0.0.0:0")
    for words in (("ui", lab, "--host", "0.0.0.0"), live):
        assert in_process(*words).returncode == 2
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed: no certificate")
    names = tmp_path / "c.pem", tmp_path / "k.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost",
         "-out", names[0], "-keyout", names[1]],
        check=True, capture_output=True,
    )  # fmt: skip
    tls = ("--certificate", names[0], "--key", names[1])
    with served(lab, "--host", "0.0.0.0", *tls) as page:
        assert page.url.startswith("https://")
        page = page._replace(url=f"https://localhost:{page.url.rpartition(':')[2]}")
        coded = base64.b64encode(f"anybody:{page.token}".encode()).decode()
        wrong = base64.b64encode(b"anybody:guess").decode()
        for path in ("/", "/page.js", "/api/runs"):
            assert page.ask(path)[0] == 401
            assert page.ask(path, Authorization=f"Basic {wrong}")[0] == 401
            assert page.ask(path, Authorization=f"Basic {coded}")[0] == 200
    pytest.importorskip("foxglove")
    with live_view(address_of("0.0.0.0:0", *names)) as view:
        assert view.address.url.startswith("wss://")
        url = view.address.url.replace("0.0.0.0", "localhost")
        known = ssl.create_default_context(cafile=names[0])
        known.check_hostname = False
        with connect(url, subprotocols=["foxglove.sdk.v1"], ssl=known) as viewer:
            assert json.loads(viewer.recv())["op"] == "serverInfo"


def test_points_of_a_run_while_it_grows(quick_run: Path, tmp_path: Path) -> None:
    growing = Growing(quick_run / "run.mcap", tmp_path / "run.mcap.part")
    follower, told, going = Follower(growing.path), [], True
    while going or not follower.ended:
        going = going and growing.grow(60_000)
        if (one := follower.step()) is not None:
            told.append(one)
        follower.ended = follower.ended and not going  # nobody holds the lock of this file
    follower.close()
    ticks = read_recording(quick_run / "run.mcap").ticks
    states = [each for each in told if "state" in each]
    high_n = [value for each in states for value in each["time"]["high_n"]]
    assert max(high_n) == pytest.approx(float(ticks.force_n.max()), abs=0.01)
    time_s = [value for each in states for value in each["time"]["time_s"]]
    assert np.all(np.diff(time_s) > 0.0)
    assert len(time_s) < 1000
    assert told[0]["run"]["virtual"] is True
    assert told[-1]["ended"] == "whole"
    assert states[-1]["left_s"] < 1.0
    bend = [value for each in states for value in each["curve"]["deformation_um"] if value]
    run = curves_of(quick_run.parent, quick_run.name)
    assert max(bend) == pytest.approx(
        max(each for each in run["curve"]["deformation_um"] if each), rel=0.1
    )


def test_points_of_a_curve_are_means_of_parts() -> None:
    bend = np.array([1.0, 3.0, np.nan, np.nan, 5.0, 7.0])
    told = curve(bend, np.arange(6.0), np.array([0, 2, 4]))
    assert told == {"deformation_um": [2.0, None, 6.0], "force_n": [0.5, 2.5, 4.5]}


def test_a_process_is_given_up_and_another_goes_on() -> None:
    async def work() -> None:
        with pytest.raises(BadInputError, match="2 s"):
            await apart(2.0, time.sleep, 60.0)
        assert await apart(120.0, divmod, 7, 2) == (3, 1)
        with pytest.raises(ZeroDivisionError):
            await apart(120.0, divmod, 7, 0)
        with pytest.raises(BadInputError):
            await apart(120.0, os._exit, 1)
        with pytest.raises(BadInputError, match="4 GiB"):
            await apart(120.0, bytearray, 5 << 30)
        assert await apart(120.0, os.getpriority, os.PRIO_PROCESS, 0) >= 10

    anyio.run(work)


@chromium.needed
def test_a_run_in_a_browser(stage: Callable[..., Staged], quick: Path, tmp_path: Path) -> None:
    folder, complaints, requests = tmp_path / "lab", list[str](), list[str]()
    shutil.copytree(ROOT / "procedures" / "payloads", folder / "payloads")
    plan = quick.read_text().replace(f"{ROOT}/procedures/", "")
    (folder / "plan.yaml").write_text(plan)
    with served(folder) as server, chromium.tab(complaints, requests) as page:
        page.goto(f"{server.url}/#token={server.token}")
        assert "stepload run" in page.inner_text(".empty code")
        assert server.token not in page.url
        out = folder / "runs" / "one"
        staged = stage(
            {"at": "HOLD 2", "wait": "stop 1"},
            "run", quick, "--dry-run", "--out", out, "--quiet",
        )  # fmt: skip
        staged.wait_until_there()
        page.click(".banner a")
        page.wait_for_selector("dt:text-is('Force') + dd:text-matches('^(19.|20.) N$')")
        assert "load, step 2 (200 N)" in page.inner_text(".phase")
        assert page.get_attribute(".phase", "aria-live") == "polite"
        assert page.locator(".margins b").count() > 8
        assert [chromium.ink(each) > 0.01 for each in page.locator(".chart").all()] == [True, True]
        colours = []
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
            colours.append(
                page.evaluate("getComputedStyle(document.documentElement).backgroundColor")
            )
        assert colours[0] != colours[1]
        for size in (chromium.NARROW, chromium.WIDE):
            page.set_viewport_size(size)
            assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        page.focus("button:text('Pause after step')")
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.textContent") == "Unload and stop"
        page.keyboard.press("Enter")
        code, _ = staged.finish()
        assert code == 130
        ticks = read_recording(out / "run.mcap").ticks
        assert ticks.phase[-1] == Phase.DONE
        assert abs(float(ticks.force_n[-1])) < 5.0
        page.wait_for_selector("iframe")
        assert page.locator(".facts dd").last.inner_text() == "interrupted"

        page.click("nav a:text('Preflight')")
        page.select_option("select", "plan.yaml")
        page.wait_for_selector("h1 .word.good, h1 .word.doubt")
        page.fill("textarea", plan.replace("hold: 0.3 s", "hold: 0.3 N"))
        wrong = plan.split("\n").index("  hold: 0.3 s") + 1
        page.wait_for_selector(".gutter .bad")
        assert page.inner_text(".gutter .bad") == str(wrong)
        page.click(".place")
        assert page.evaluate("document.activeElement.tagName") == "TEXTAREA"

        page.click("nav a:text('Compare')")
        page.check("tbody input")
        page.wait_for_selector(".legend .u-x, .legend i")
        page.click("nav a:text('Runs')")
        page.fill("input[type=search]", "nothing like this")
        page.wait_for_selector(".empty")
    assert complaints == []
    assert {each.partition("/api")[0].rpartition("/")[0] for each in requests} <= {
        server.url, f"{server.url}/uplot", server.url.rpartition("/")[0]
    }  # fmt: skip
    assert all(each.startswith(server.url) for each in requests)
