"""The whole set-up of an emulated rig: `python -m stepload_verify.trials.first_day`, a transcript.

An emulated UR arm with an emulated sensor in real time, through the real drivers. What a person
would do with hands (push, lead the arm) is done to the emulated rig when the set-up asks for it.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from stepload.engine.rehearse import world_for
from stepload.errors import DeviceError, RefusedError, SteploadError
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload.session.experiment import press
from stepload.setup.answers import Answers
from stepload.setup.questions import Question
from stepload.setup.state import read_state
from stepload.setup.wizard import STEPS, set_up
from stepload_verify.emulators.rig_process import RigProcess

HAND_N = 40.0
NOISE_N = 0.05
SURFACE_M = 5e-4
PERIOD_S = 2e-3
TRIES = 4
BUSY_SHARE = 0.02
"""Share of late periods of the emulated arm above which the machine is called busy. A client that
keeps only the newest package loses as many; the doctor has the same limit."""
DOWN = f"lead 0 {math.pi} 0"
BUSY = {
    "arm.max_age": "1.5 s", "arm.model_tolerance": "2 mm", "force.max_age": "1.5 s",
    "second_force.time": "100 ms", "system_stiffness.sigma": "2e3 N/m",
}  # fmt: skip
"""Emulators share a machine with the set-up, so the limits on the age of data are generous: never
to be copied to a real rig. Nor is `prove_watchdog`: the doctor proves the watchdog here."""


class Hands:
    """Writes down what the set-up says, and does on the emulated rig what it asks for."""

    def __init__(self, rig: RigProcess, out: TextIO, push: str = f"push 0 0 {HAND_N}") -> None:
        self._rig, self._out, self._push = rig, out, push

    def tell(self, line: str) -> None:
        """Write a line of the set-up down, and do what it asks for by hand."""
        self._out.write(line + "\n")
        self._out.flush()
        for requested, does in (
            ("push the tool AWAY", self._push), ("felt; let go", "push 0 0 0"),
            ("start pose: above", DOWN),
        ):  # fmt: skip
            if requested in line:
                self._out.write(f"    [by hand: {does}]\n")
                self._rig.command(does)

    def ask(self, question: Question) -> str | None:
        """Give no answer, since all answers are given beforehand."""
        return None


def emulated_rig(host: str, **truth: object) -> RigProcess:
    """A UR5e with a sensor and a tool above the silicone ball, emulated at a loopback address."""
    spec = world_for(preflight_of(load_plan(plan_path("demo-wire"))))
    known = {"surface_m": SURFACE_M, "force_noise_n": NOISE_N, **truth}
    return RigProcess(replace(spec, **known), ur=host)  # type: ignore[arg-type]


def answers_for(rig: RigProcess) -> dict[str, str]:
    """All answers of the first day on that rig."""
    busy = [f"{key}={value}" for key, value in BUSY.items()]
    return {
        "name": "emulated", "host": str(rig.options["ur"]["host"]),
        "arm_options": "max_age=1.5 s\ncommand_timeout=1.5 s\nwatchdog=1 Hz\nprove_watchdog=false",
        "sensor": "bota-sensone-serial",
        "sensor_options": f"port={rig.options['bota_serial']['port']}\nmax_age=1.5 s",
        "keys": "\n".join(busy), "hazards_read_by": "nobody, this rig is emulated", "back": "2 mm",
        "payload_name": "silicone ball", "shape": "sphere", "radius": "25 mm",
        "material": "silicone rubber, 50 Shore A", "force_limit": "100 N",
        "surface_distance": f"{1e3 * SURFACE_M:g} mm", "surface_uncertainty": "0.2 mm",
        "procedure": "tare=1 s\nwarm_up=0 s\nhold=0.2 s\ntouches=1\nretract=6 mm",
    }  # fmt: skip


def first_day(folder: Path, rig: RigProcess, out: TextIO, until: str = "") -> list[str]:
    """Set the emulated rig up in `folder`; returns the steps that are left.

    A step that was refused while the emulated arm was late is tried again, up to `TRIES` times in
    all, once the arm keeps its period; the set-up continues where it stopped. A step that was
    refused while the arm was on time is not tried again.

    Raises:
        SteploadError: a step was refused, or a device failed.
    """
    for left in range(TRIES - 1, -1, -1):
        answers = Answers(answers_for(rig), Hands(rig, out), yes=True)
        began = rig.state()
        try:
            return set_up(folder / "rig.yaml", answers, press=press, until=until)
        except (RefusedError, DeviceError) as error:
            late = lateness(began, rig.state())
            if not left or late < BUSY_SHARE:
                raise
            out.write(f"\nrefused: {error}\n")
            out.write(f"but the machine was busy: {told_late(late)}; once more\n\n")
        wait_for_rest(rig)
    raise AssertionError


def lateness(before: Mapping[str, Any], after: Mapping[str, Any]) -> float:
    """Share of its periods between two states that the emulated arm began late, or never."""
    periods = round((after["time_s"] - before["time_s"]) / PERIOD_S)
    late = sum(after[key] - before[key] for key in ("periods_late", "periods_skipped"))
    return float(late / max(1, periods))


def told_late(share: float) -> str:
    """The share of late periods as a clause of a sentence."""
    return f"the emulated arm began {share:.1%} of its periods late or never"


def wait_for_rest(rig: RigProcess) -> None:
    """Return when the emulated arm keeps its period, or after a minute."""
    for _ in range(30):
        began = rig.state()
        time.sleep(2.0)
        if lateness(began, rig.state()) < 0.5 * BUSY_SHARE:
            return


def why_it_ended(folder: Path, error: SteploadError, late: float) -> str:
    """Say in which step the first day ended, why, and whether this machine was too busy."""
    done = read_state(folder / "rig.yaml").done
    step = next((name for name in STEPS if name not in done), "none")
    busy = (
        f"This machine was busy: {told_late(late)}. Try again when nothing else works on it."
        if late >= BUSY_SHARE
        else f"This machine kept up: {told_late(late)}."
    )
    return f"\nthe first day ended in its step `{step}`: {error}\n{busy}\n"


def main(show: Callable[[str], object] = sys.stdout.write) -> None:
    """Write the transcript, then the files made; exit with the error's code where a step fails."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--host", default="127.0.77.1")
    words.add_argument("--until", default="")
    chosen = words.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            with emulated_rig(chosen.host) as rig:
                began = rig.state()
                try:
                    first_day(folder, rig, sys.stdout, chosen.until)
                except (RefusedError, DeviceError) as error:
                    show(why_it_ended(folder, error, lateness(began, rig.state())))
                    sys.exit(int(error.exit_code))
        except SteploadError as error:
            show(f"the first day could not begin: {error}\n")
            sys.exit(int(error.exit_code))
        for path in sorted(folder.glob("*.yaml")):
            show(f"\n--- {path.name}\n{path.read_text(encoding='utf-8')}")


if __name__ == "__main__":
    main()
