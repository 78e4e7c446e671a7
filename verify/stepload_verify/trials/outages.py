"""What is left of the force after an outage of the arm's controller, and what was said of it.

    python -m stepload_verify.trials.outages [--kind KIND ...] [--seconds S ...]

Whole runs in real time, the real UR driver against the emulated rig. While the arm presses, its
controller goes away in one way for some time, or a person takes over, or both. Prints a line a run:
force at the outage and at the end (the emulator's truth), how far the arm moved after somebody had
taken over, and what safing said.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from stepload.engine.loop import run_loop
from stepload.engine.open_rig import opened
from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.envelope.envelope import Envelope, envelope_of
from stepload.errors import DeviceError
from stepload.plan.load import load_plan
from stepload.plan.model import DriverChoice, Plan
from stepload.plan.shipped import plan_path
from stepload.record.outcome import RunOutcome
from stepload.record.rows import Phase
from stepload.runner.interrupts import interruptible
from stepload_verify.campaign.incidents import NullRecorder
from stepload_verify.emulators.rig_process import RigProcess

HOST = "127.31.0.1"
PRESSING_N = 6.0
SECONDS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
PERSON_S = 1.5
"""After each act of a person inside an outage; the first comes with the outage."""
WAIT_S = 3.0
"""After the run; whatever still moves shows itself."""

Act = Callable[[RigProcess], object]


def _line(*lines: str) -> Act:
    return lambda rig: [rig.command(line) for line in lines]


OUTAGES: dict[str, tuple[Act, Act]] = {
    "drop": (_line("drop", "refuse on"), _line("refuse off")),
    "freeze": (_line("freeze on"), _line("freeze off")),
    "blackhole": (_line("blackhole on"), _line("blackhole off")),
    "controller stopped": (
        lambda rig: os.kill(rig.pid, signal.SIGSTOP), lambda rig: os.kill(rig.pid, signal.SIGCONT)
    ),
}  # fmt: skip
"""How the controller goes away, and comes back."""

PERSONS: dict[str, tuple[Act, Act]] = {
    "stopped at the pendant": (_line("kill-program"), _line()),
    "safeguard": (_line("safeguard on"), _line("safeguard off")),
    "protective stop": (_line("protective-stop"), _line("unlock")),
    "emergency stop": (_line("emergency-stop"), _line("release")),
    "local control": (_line("local on", "kill-program"), _line("local off")),
}
"""How a person takes over, and gives the arm back without consent to a motion."""


def _inside(outage: str, *lines: str) -> tuple[Act, Act]:
    """A person does `lines` inside an outage, and the controller answers again afterwards."""
    lost, back = OUTAGES[outage]

    def begin(rig: RigProcess) -> None:
        lost(rig)
        for line in lines:
            rig.command(line)
            time.sleep(PERSON_S)

    return begin, back


_INSIDE = {
    "protective stop": ("protective-stop", "unlock"),
    "safeguard": ("safeguard on", "safeguard off"),
    "emergency stop": ("emergency-stop", "release"),
    "local control": ("local on", "local off"),
    "program loaded": ("load other.urp",),
    "slider": ("slider 0.5",),
    "tool turned": ("kill-program", "lead 0 3.0916 0"),
    "stop button": ("kill-program",),
}
INSIDE = {
    f"{person} in {outage}": _inside(outage, *lines)
    for outage in ("freeze", "drop")
    for person, lines in _INSIDE.items()
}
"""Acts of a person inside an outage: in a freeze the dashboard answers, in a drop nothing does."""


@dataclass(frozen=True)
class Told:
    """One run with an outage; forces are the emulator's truth."""

    kind: str
    seconds: float
    before_n: float
    left_n: float
    moved_m: float
    outcome: RunOutcome
    lines: tuple[tuple[float, str], ...]

    @property
    def words_after_s(self) -> float:
        """From the decision to stop to the line that says so."""
        cause = self.outcome.cause
        return self.lines[0][0] - cause.time_s if cause and self.lines else float("nan")

    @property
    def row(self) -> str:
        said = "; ".join(text.removeprefix("safing: ") for _, text in self.lines[1:])
        return (
            f"{self.kind:26} {self.seconds:5.1f} s  {self.before_n:5.1f} N {self.left_n:6.2f} N "
            f"{self.moved_m * 1e3:7.3f} mm  {self.outcome.end_s - self.outcome.start_s:5.1f} s "
            f"{self.words_after_s * 1e3:5.1f} ms  {said}"
        )


def pressing_plan(host: str, options: dict[str, dict[str, Any]]) -> Plan:
    """The demo's plan, shortened, on an emulated rig with driver `options`."""
    plan = load_plan(plan_path("demo-wire"))
    procedure = replace(
        plan.procedure, tare_s=0.25, warm_up_s=0.0, touches=1, hold_s=0.2, unload=False,
        surface_distance_m=3e-5, surface_uncertainty_m=2e-5, retract_m=3e-4, levels_n=(15.0,),
        top_force_n=15.0, load_rate_n_per_s=30.0,
    )  # fmt: skip
    arm, force = plan.rig.arm, plan.rig.force
    ur = {**arm.driver.options, **options.get("ur", {}), "host": host, "prove_watchdog": False,
          "max_age": 0.3, "leash": 0.3, "watchdog": 5.0}  # fmt: skip
    read = {**options.get(force.driver.name, force.driver.options), "max_age": 1.5}
    rig = replace(
        plan.rig,
        arm=replace(arm, rate_hz=500.0, driver=DriverChoice("ur", ur)),
        force=replace(force, driver=DriverChoice(force.driver.name, read)),
    )
    payload = replace(plan.payload, declared_force_limit_n=60.0)
    identify = replace(plan.identify, accept_unidentifiable="short steps")
    return replace(plan, payload=payload, procedure=procedure, rig=rig, identify=identify)


def run_with_outage(kind: str, seconds: float, host: str = HOST) -> Told:
    """Press, lose the controller for `seconds`, end the run.

    `kind` is one of OUTAGES, PERSONS or INSIDE.
    """
    begin, end = (OUTAGES | PERSONS | INSIDE)[kind]
    bare = pressing_plan(host, {})
    spec = replace(world_for(envelope_of(bare)), surface_m=bare.procedure.surface_distance_m)
    with RigProcess(spec, ur=host, sensors=(bare.rig.force.driver.name,)) as rig:
        envelope = envelope_of(pressing_plan(host, rig.options))
        return _spoiled(kind, seconds, envelope, rig, begin, end)


def _spoiled(
    kind: str, seconds: float, envelope: Envelope, rig: RigProcess, begin: Act, end: Act
) -> Told:
    before: list[dict[str, Any]] = []
    lines: list[tuple[float, str]] = []

    def outage() -> None:
        begin(rig)
        time.sleep(seconds)
        end(rig)

    worker = threading.Thread(target=outage)

    def watch(engine: Engine) -> None:
        row = engine.row
        if not before and row and row.phase == Phase.LOAD and row.force_n > PRESSING_N:
            before.append(rig.state())
            worker.start()

    with opened(envelope, dry_run=False) as devices:
        with interruptible():
            outcome = run_loop(
                Engine(envelope, Operator()), devices, NullRecorder(), on_progress=watch,
                say=lambda text: lines.append((time.monotonic(), text)),
            )  # fmt: skip
        if not before:
            raise RuntimeError(f"the run ended before it pressed: {outcome.why}")
        worker.join()
        time.sleep(WAIT_S)
    truth = rig.state()
    moved_m = abs(truth["position_m"] - before[0]["position_m"])
    return Told(
        kind, seconds, before[0]["contact_n"], truth["contact_n"], moved_m, outcome, tuple(lines)
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--kind", nargs="*", choices=[*OUTAGES, *PERSONS, *INSIDE])
    parser.add_argument("--seconds", nargs="*", type=float, default=list(SECONDS))
    options = parser.parse_args()
    print("kind                       outage   before   left    moved      run      words  said")
    left = []
    for kind in options.kind or [*OUTAGES, *PERSONS, *INSIDE]:
        for seconds in options.seconds if kind in OUTAGES else [1.0]:
            try:
                told = run_with_outage(kind, seconds)
            except (RuntimeError, DeviceError) as error:
                print(f"{kind:26} {seconds:5.1f} s  {error}", flush=True)
                continue
            left.append(told)
            print(told.row, flush=True)
    words_ms = sorted(t.words_after_s * 1e3 for t in left if t.outcome.cause)
    if not words_ms:
        return 0
    middle_ms = words_ms[len(words_ms) // 2]
    print(f"decision to words: median {middle_ms:.1f} ms, max {words_ms[-1]:.1f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
