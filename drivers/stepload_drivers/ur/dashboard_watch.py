"""Watches the dashboard while an arm does not answer, for any sign that a person controls it.

The controller does not record that a person took control and returned it. So its dashboard is
polled for as long as a retract is tried, and a single sign counts permanently. A dashboard that
does not answer shows nothing.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.client import REMOTE, Dashboard
from stepload_drivers.ur.state import Problem

EVERY_S = 0.1
ASK_LIMIT_S = 0.5
_log = logging.getLogger(__name__)

LOADED = "get loaded program"
QUESTIONS = (
    "is in remote control", "safetystatus", "safetymode", "robotmode", "programState", LOADED,
)  # fmt: skip
"""`safetymode` for older controllers, which do not know `safetystatus`."""

NORMAL = ("NORMAL", "REDUCED")
UNCERTAIN = ("", "NO_CONTROLLER", "DISCONNECTED")
"""Robot modes that give no information on the arm."""

STOPS = {
    "PROTECTIVE_STOP": FaultCode.PROTECTIVE_STOP,
    "SAFEGUARD_STOP": FaultCode.SAFEGUARD_STOP,
    "AUTOMATIC_MODE_SAFEGUARD_STOP": FaultCode.SAFEGUARD_STOP,
    "SYSTEM_THREE_POSITION_ENABLING_STOP": FaultCode.SAFEGUARD_STOP,
    "SYSTEM_EMERGENCY_STOP": FaultCode.EMERGENCY_STOP,
    "ROBOT_EMERGENCY_STOP": FaultCode.EMERGENCY_STOP,
}

_HINT = "ask who is at the arm; move it clear by hand on the pendant, then start anew"


class Answers(NamedTuple):
    """One round of answers; None and "": the controller does not know the question."""

    remote: bool | None
    safety: str
    mode: str
    program: str
    loaded: str

    @property
    def nobody(self) -> bool:
        """Whether they say that nobody has control: required for a motion that nobody can watch."""
        safe = self.safety in NORMAL and self.mode == "RUNNING"
        return safe and self.remote is not False and self.program == "STOPPED"


def answers_from(replies: list[str]) -> Answers:
    """From the dashboard's replies to `QUESTIONS`."""
    remote, status, safety, mode, program, loaded = replies
    state = program.upper().split(" ", 1)[0]
    return Answers(
        REMOTE.get(remote.lower()),
        _after("Safetystatus:", status) or _after("Safetymode:", safety),
        _after("Robotmode:", mode),
        state if state in ("STOPPED", "PLAYING", "PAUSED") else "",
        _known(loaded),
    )


def _after(name: str, reply: str) -> str:
    word, _, value = reply.partition(":")
    return value.strip().upper() if f"{word}:".lower() == name.lower() else ""


def _known(reply: str) -> str:
    return "" if "understand" in reply.lower() else reply


def sign_in(answers: Answers, loaded: str) -> Problem | None:
    """Signs that a person, or the safety system, has control; `loaded`: the earlier program."""
    if answers.safety and answers.safety not in NORMAL:
        code = STOPS.get(answers.safety, FaultCode.DEVICE_REPORTS)
        return Problem(code, f"the dashboard told of {answers.safety}", _HINT)
    if answers.mode not in (*UNCERTAIN, "RUNNING"):
        told = f"the dashboard told of an arm in mode {answers.mode}"
        return Problem(FaultCode.DEVICE_REPORTS, told, _HINT)
    if answers.remote is False:
        return Problem(FaultCode.NOT_REMOTE, "the dashboard told of local control", _HINT)
    if answers.program == "PAUSED":
        return Problem(FaultCode.PROGRAM_STOPPED, "the dashboard told of a paused program", _HINT)
    if answers.loaded and loaded and answers.loaded != loaded:
        told = f"another program was loaded ({answers.loaded!r}, before {loaded!r})"
        return Problem(FaultCode.PROGRAM_STOPPED, told, _HINT)
    return None


def require_nobody(host: str, answers: Answers | None) -> None:
    """Require that the dashboard reports that nobody has control, for a motion nobody can watch.

    Raises:
        DeviceError: NOT_CONNECTED, there is no such report now.
    """
    if answers is not None and answers.nobody:
        return
    what = "does not answer"
    if answers is not None:
        what = (
            "sends no data, and its dashboard does not say that nobody has the arm (safety: "
            f"{answers.safety or 'not told'}, arm: {answers.mode or 'not told'}, program: "
            f"{answers.program or 'not told'})"
        )
    raise DeviceError(
        f"{host} {what}: no retract is sent until it does",
        code=FaultCode.NOT_CONNECTED,
        hint="use the emergency stop if the arm presses on",
    )


class DashboardWatch:
    """Polls the dashboard of `host` every `EVERY_S` in a thread of its own, and on request.

    `sign` is the first sign of a person. It stays.

    Args:
        own_program_s: a program that plays for longer is not ours,
        ours: unless this says so.
        loaded: which program was loaded before, "" where that is not known.
    """

    def __init__(
        self, host: str, own_program_s: float, ours: Callable[[], bool], loaded: str = ""
    ) -> None:
        self.sign: Problem | None = None
        self._host = host
        self._own_program_s = own_program_s
        self._ours = ours
        self._loaded = loaded
        self._plays_since_s = math.inf
        self._dashboard: Dashboard | None = None
        self._lock = threading.Lock()
        self._closed = threading.Event()

    def start(self) -> None:
        """Begin to watch. If no thread can be started it is only polled before each sending."""
        with contextlib.suppress(RuntimeError):
            threading.Thread(target=self._watch, name="dashboard watch", daemon=True).start()

    def close(self) -> None:
        """Returns at once; the thread ends within `ASK_LIMIT_S`."""
        self._closed.set()

    def ask(self) -> Answers | None:
        """The present answers of the dashboard; None without an answer within `ASK_LIMIT_S`."""
        with self._lock:
            answers = self._answers(time.monotonic() + ASK_LIMIT_S)
            self._judge(answers)
            return answers

    def _watch(self) -> None:
        while not self._closed.wait(EVERY_S):
            self.ask()
        with self._lock:
            self._hang_up()

    def _answers(self, deadline_s: float) -> Answers | None:
        try:
            self._dashboard = self._dashboard or Dashboard(self._host, deadline_s)
            return answers_from([self._dashboard.ask(q, deadline_s) for q in QUESTIONS])
        except DeviceError:  # a late answer would be taken for the next question's
            self._hang_up()
            return None

    def _hang_up(self) -> None:
        if self._dashboard is not None:
            self._dashboard.close()
            self._dashboard = None

    def _judge(self, answers: Answers | None) -> None:
        now_s = time.monotonic()
        plays = answers is not None and answers.program == "PLAYING" and not self._ours()
        self._plays_since_s = min(self._plays_since_s, now_s) if plays else math.inf
        if answers is None:
            return
        self._loaded = self._loaded or answers.loaded
        if self.sign is not None:
            return
        self.sign = sign_in(answers, self._loaded)
        if self.sign is None and now_s - self._plays_since_s > self._own_program_s:
            told = "the dashboard told of a program that runs and is not ours"
            self.sign = Problem(FaultCode.PROGRAM_STOPPED, told, _HINT)
        if self.sign is not None:
            _log.warning("%s: %s: %s", self._host, self.sign.code.value, self.sign.message)


def loaded_program(host: str) -> str:
    """The program loaded according to the dashboard, "" where it gives no answer."""
    deadline_s = time.monotonic() + ASK_LIMIT_S
    try:
        with contextlib.closing(Dashboard(host, deadline_s)) as dashboard:
            return _known(dashboard.ask(LOADED, deadline_s))
    except DeviceError:
        return ""
