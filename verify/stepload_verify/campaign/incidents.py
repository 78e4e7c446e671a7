"""Incidents on the program's side of a rig: signals, exceptions, a full disk."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from stepload.engine.operator import Operator, StopLevel
from stepload.engine.tick import Engine
from stepload.record.rows import TickRow
from stepload.rig.clock import Clock
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample
from stepload.rig.world import SimulatedRig
from stepload_verify.campaign.mishaps import ERRORS, Incident


class Killed(BaseException):
    """The program was killed; nothing that it would have done happens any more."""


def _nothing(_sample: object) -> None:
    """Discard: nothing is recorded."""


class NullRecorder:
    """A recorder that keeps only the number of levels given up; its disk can be full."""

    def __init__(self, on_tick: Callable[[TickRow], None] = _nothing) -> None:
        self.force: Callable[[ForceSample], None] = _nothing
        self.second_force: Callable[[ForceSample], None] = _nothing
        self.arm: Callable[[ArmSample], None] = _nothing
        self.displacement: Callable[[DisplacementSample], None] = _nothing
        self.tick = on_tick
        self.full = False
        self.levels_missed = 0

    def event(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        """Discard: nothing is recorded."""
        self.levels_missed += kind == "level_missed"

    def problem(self) -> str:
        return "no space left on device" if self.full else ""


class WatchedClock:
    """The rig's clock, which triggers incidents at their time."""

    virtual = True

    def __init__(self, inner: Clock) -> None:
        self._inner = inner
        self._due: list[tuple[float, Callable[[], None]]] = []
        self.now_s = inner.now_s

    def at(self, time_s: float, happens: Callable[[], None]) -> None:
        """Call `happens` once this time has passed."""
        self._due.append((time_s, happens))
        self._due.sort(key=lambda row: row[0])

    def sleep_until(self, time_s: float) -> None:
        self._inner.sleep_until(time_s)
        while self._due and self._due[0][0] <= self.now_s():
            self._due.pop(0)[1]()


class FailingOperator(Operator):
    """An operator whose request cannot be read once `error` is set: that tick fails."""

    __slots__ = ("_level", "error")

    def __init__(self) -> None:
        self.error = ""
        super().__init__()

    @property
    def stop_level(self) -> int:
        error, self.error = self.error, ""
        if error:
            raise ERRORS[error](f"simulated {error} in tick")
        return self._level

    @stop_level.setter
    def stop_level(self, level: int) -> None:
        self._level = level


class FailingSample:
    """A sample whose values cannot be read, so that the rule that evaluates it fails."""

    def __init__(self, error: str) -> None:
        self._error = error

    def __getattr__(self, name: str) -> Any:
        raise ERRORS[self._error](f"simulated {self._error} in check")


class SpoiltOnce:
    """A force sensor whose next samples cannot be read; after them it works again."""

    def __init__(self, rig: Any, error: str) -> None:
        self._rig, self._sound, self._error = rig, rig.force, error

    def drain(self) -> list[Any]:
        self._rig.force = self._sound
        return [FailingSample(self._error)]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sound, name)


class Failing:
    """Stands in for an object whose `method` raises from `start_s` on."""

    def __init__(
        self, inner: Any, method: str, now_s: Callable[[], float], start_s: float, error: str
    ) -> None:
        self._inner = inner

        def fails(*args: Any, **kwargs: Any) -> Any:
            if now_s() >= start_s:
                raise ERRORS[error](f"simulated {error} in {method}")
            return getattr(inner, method)(*args, **kwargs)

        setattr(self, method, fails)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def install(
    incidents: Sequence[Incident],
    rig: SimulatedRig,
    engine: Engine,
    operator: Operator,
    recorder: NullRecorder,
) -> Any:
    """Prepare the incidents; the recorder to run with is returned."""
    if not incidents:
        return recorder
    rig.clock = clock = WatchedClock(rig.clock)
    wrapped: Any = recorder
    for incident in incidents:
        if incident.kind == "signal_int":
            clock.at(incident.start_s, operator.press)
        elif incident.kind == "signal_term":
            clock.at(incident.start_s, lambda: operator.request_stop(StopLevel.NOW))
        elif incident.kind == "killed":
            clock.at(incident.start_s, lambda: _kill(rig))
        elif incident.kind == "recorder_full":
            clock.at(incident.start_s, lambda: setattr(recorder, "full", True))
        else:
            wrapped = _break(incident, rig, engine, clock, wrapped)
    return wrapped


class _Unreached:
    """The arm of a killed program: nothing is sent to it."""

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s

    def retract(self, distance_m: float, speed_m_s: float, timeout_s: float) -> None:
        """Not sent."""

    def safe(self, timeout_s: float) -> None:
        """Not sent."""


def _kill(rig: Any) -> None:
    rig.arm = _Unreached(rig.arm.period_s)
    raise Killed


def _break(incident: Incident, rig: Any, engine: Any, clock: WatchedClock, recorder: Any) -> Any:
    component, error = incident.detail.split()
    name, method = component.split(".")

    def raising() -> None:
        raise ERRORS[error](f"simulated {error} in {method}")

    def failing(inner: Any) -> Any:
        return Failing(inner, method, clock.now_s, incident.start_s, error)

    if name == "clock":
        clock.at(incident.start_s, lambda: _raise(error))
    elif name == "engine":
        clock.at(incident.start_s, lambda: setattr(engine.operator, "error", error))
    elif name == "supervisor":
        clock.at(incident.start_s, lambda: setattr(rig, "force", SpoiltOnce(rig, error)))
    elif name == "procedure":
        clock.at(incident.start_s, lambda: setattr(engine.course, "sequence", iter(raising, None)))
    elif name == "recorder":
        return failing(recorder)
    elif name == "arm":
        rig.arm = failing(rig.arm)
    else:
        rig.force = failing(rig.force)
    return recorder


def _raise(error: str) -> None:
    raise ERRORS[error](f"simulated {error} in the clock")
