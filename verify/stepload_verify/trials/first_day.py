"""The whole set-up of an emulated rig: `python -m stepload_verify.trials.first_day`, a transcript.

An emulated UR arm with an emulated sensor in real time, through the real drivers. What a person
would do with hands (push, lead the arm) is done to the emulated rig when the set-up asks for it.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from stepload.envelope.envelope import envelope_of
from stepload.errors import RefusedError
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload.run.rehearse import world_for
from stepload.setup.answers import Answers
from stepload.setup.questions import Question
from stepload.setup.story import set_up
from stepload_verify.emulators.rig_process import RigProcess

HAND_N = 40.0
TOOL_KG = 0.4
SURFACE_M = 5e-4
DOWN, ASIDE = f"lead 0 {math.pi} 0", f"lead 0 {math.pi / 2} 0"
BUSY = {
    "arm.max_age": "1.5 s", "arm.model_tolerance": "2 mm", "force.max_age": "1.5 s",
    "second_force.time": "100 ms", "system_stiffness.sigma": "2e3 N/m",
}  # fmt: skip
"""Emulators share a machine with the set-up, so the limits on the age of data are generous: never
to be copied to a real rig. Nor is `prove_watchdog`: the doctor proves the watchdog here."""


class Hands:
    """Writes down what is said, and does by hand what is asked for."""

    def __init__(self, rig: RigProcess, out: TextIO, push: str = f"push 0 0 {HAND_N}") -> None:
        self._rig, self._out, self._push = rig, out, push

    def tell(self, line: str) -> None:
        """What the set-up says; the emulated person does it."""
        self._out.write(line + "\n")
        self._out.flush()
        for asked, does in (
            ("push the tool AWAY", self._push), ("felt; let go", "push 0 0 0"),
            ("points straight down", DOWN), ("points sideways", ASIDE), ("start pose: above", DOWN),
        ):  # fmt: skip
            if asked in line:
                self._out.write(f"    [by hand: {does}]\n")
                self._rig.command(does)

    def ask(self, question: Question) -> str | None:
        """Every answer is given beforehand."""
        return None


def emulated_rig(host: str, **truth: object) -> RigProcess:
    """A UR5e with a sensor and a tool above the silicone ball, emulated at a loopback address."""
    spec = world_for(envelope_of(load_plan(plan_path("demo-wire"))))
    known = {"surface_m": SURFACE_M, "force_tool_mass_kg": TOOL_KG, **truth}
    return RigProcess(replace(spec, **known), ur=host)  # type: ignore[arg-type]


def answers_for(rig: RigProcess) -> dict[str, str]:
    """All answers of the first day on that rig."""
    busy = [f"{key}={value}" for key, value in BUSY.items()]
    return {
        "name": "emulated", "host": str(rig.options["ur"]["host"]),
        "arm_options": "max_age=1.5 s\nleash=1.5 s\nwatchdog=1 Hz\nprove_watchdog=false",
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

    A doctor that finds this machine too busy for an emulated rig is called again, at most twice:
    the set-up is taken up where it was left.

    Raises:
        RefusedError: a step was refused, the doctor's three times.
    """
    for left in range(2, -1, -1):
        answers = Answers(answers_for(rig), Hands(rig, out), yes=True)
        try:
            return set_up(folder / "rig.yaml", answers, until=until)
        except RefusedError as refused:
            if not left or "the doctor finds" not in refused.message:
                raise
            out.write(f"\nrefused: {refused}\n\n")
    raise AssertionError


def main(show: Callable[[str], object] = sys.stdout.write) -> None:
    """Write the transcript, then the files that came of it."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--host", default="127.0.77.1")
    words.add_argument("--until", default="")
    chosen = words.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with emulated_rig(chosen.host) as rig:
            first_day(folder, rig, sys.stdout, chosen.until)
        for path in sorted(folder.glob("*.yaml")):
            show(f"\n--- {path.name}\n{path.read_text(encoding='utf-8')}")


if __name__ == "__main__":
    main()
