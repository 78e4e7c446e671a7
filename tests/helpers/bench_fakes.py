"""A bench of fakes in virtual time: hands, an arm that is led, and sensors that feel it."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

from stepload.errors import DeviceError
from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import RunOutcome
from stepload.rig.device import ArmConfiguration, Identity
from stepload.rig.samples import ArmSample, ForceSample
from stepload.setup.answers import Answers
from stepload.setup.bench import FORCE, SECOND, Bench, Setup
from stepload.setup.questions import Question
from stepload.setup.state import Found, State
from stepload.setup.yaml_keys import Value
from stepload_verify.emulators.physics import Tool

DAY = date(2026, 11, 22)
Feel = Callable[[tuple[float, float, float]], tuple[float, float, float]]


def sound(force: tuple[float, float, float]) -> tuple[float, float, float]:
    """A sensor mounted along the tool: it reads what acts on it."""
    return force


class VirtualClock:
    virtual = True

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_until(self, time_s: float) -> None:
        self.time_s = max(self.time_s, time_s)


@dataclass
class Rig:
    """The truth: what a hand and the weight do to the tool, and how each channel shows it."""

    feel: Feel = sound
    second_feel: Feel = sound
    arm_gain: float = 1.0
    noise_n: float = 0.1
    obstacle_m: float = math.inf
    clock: VirtualClock = field(default_factory=VirtualClock)
    tool: Tool = field(default_factory=lambda: Tool(0.8))
    position_m: float = 0.0
    follows: bool = True
    targets: list[float] = field(default_factory=list)
    safe_calls: int = 0
    openings: int = 0
    rate_hz: float = 500.0
    random: random.Random = field(default_factory=lambda: random.Random(1))

    def felt(self, feel: Feel) -> tuple[float, ...]:
        x, y, z = self.tool.force_n()
        z -= 50.0 if -self.position_m > self.obstacle_m else 0.0
        return tuple(part + self.random.gauss(0.0, self.noise_n) for part in feel((x, y, z)))


class FakeArm:
    SETTINGS_AT: Mapping[str, str] = {"safety": "the fake's own page"}
    has_force = True

    def __init__(self, rig: Rig) -> None:
        self.rig, self.period_s, self._count = rig, 1.0 / rig.rate_hz, 0

    def drain(self) -> list[ArmSample]:
        rig, self._count = self.rig, self._count + 1
        hand = rig.tool.hand_n[2] * rig.arm_gain + rig.random.gauss(0.0, 1.0)
        now_s = rig.clock.now_s()
        pose = (0.4, 0.0, 0.3, *rig.tool.turned)
        return [ArmSample(self._count, now_s, now_s, 0, rig.position_m, hand, pose)]

    def command(self, position_m: float) -> None:
        self.rig.targets.append(position_m)
        if self.rig.follows:
            self.rig.position_m = position_m

    def held_m(self) -> float:
        return self.rig.position_m

    def configuration(self) -> ArmConfiguration:
        return ArmConfiguration((0.1, 0.2, 0.3), (0.0, 0.0, 0.1, 0.0, 0.0, 0.0), 0.8, None, 1.0)

    def fault(self) -> None:
        return None

    def safe(self, timeout_s: float) -> None:
        self.rig.safe_calls += 1


class FakeSensor:
    def __init__(self, rig: Rig, feel: Feel) -> None:
        self.rig, self.feel, self._count = rig, feel, 0

    def drain(self) -> list[ForceSample]:
        self._count += 1
        now_s = self.rig.clock.now_s()
        wrench = (*self.rig.felt(self.feel), 0.0, 0.0, 0.0)
        return [ForceSample(self._count, now_s, now_s, 0, wrench, math.nan)]

    def fault(self) -> None:
        return None


def opener(rig: Rig) -> Callable[[Mapping[str, Value], bool], object]:
    @contextmanager
    def opened(values: Mapping[str, Value], with_sensors: bool) -> Iterator[Bench]:
        rig.openings += 1
        sensors = {FORCE: FakeSensor(rig, rig.feel)} if with_sensors else {}
        if with_sensors and f"{SECOND}.driver" in values:
            sensors[SECOND] = FakeSensor(rig, rig.second_feel)
        who = Identity("fake", "UR5", "2023", "PolyScope 5.12", "")
        yield Bench(FakeArm(rig), sensors, rig.clock, dict.fromkeys(("arm", *sensors), who))

    return opened


def failing(*_: object) -> object:
    """An opener whose arm is not there."""
    raise DeviceError("nobody answers", code="not_connected", hint="power")


class Hands:
    """A person who does what is asked; `push` is what the hands do, base frame, N."""

    def __init__(self, rig: Rig, push: tuple[float, float, float] = (0.0, 0.0, 30.0)) -> None:
        self.rig, self.push, self.said = rig, push, []

    def tell(self, line: str) -> None:
        self.said.append(line)
        tool = self.rig.tool
        if "push the tool AWAY" in line:
            tool.hand_n = self.push
        elif "let go" in line and "felt" in line:
            tool.hand_n = (0.0, 0.0, 0.0)
        elif "points sideways" in line:
            tool.turned = (0.0, math.pi / 2, 0.0)
        elif "straight down" in line or "start pose: above" in line:
            tool.turned = (0.0, math.pi, 0.0)

    def ask(self, question: Question) -> None:
        return None


def press_nothing(preflight: Preflight, out: Path) -> RunOutcome:
    """In place of a session, where no plan may be pressed."""
    raise AssertionError(f"{preflight.plan.name} was pressed")


def setup_of(rig: Rig, person: Hands | None = None, second: str = "arm", **answers: str) -> Setup:
    """A set-up whose arm and sensor have answered."""
    values = {"force.driver": Value("fake", ""), "second_force.source": Value(second, ""),
              "second_force.tolerance": Value("5 N", "")}  # fmt: skip
    if second == "sensor":
        values["second_force.sensor.driver"] = Value("fake", "")
    state = State(done={"sensor": Found(values, on=DAY.isoformat())})
    told = Answers(answers, person or Hands(rig), yes=True)
    return Setup(Path("rig.yaml"), state, told, opener(rig), press_nothing, DAY)
