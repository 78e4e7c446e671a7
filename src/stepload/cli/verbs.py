"""stepload's own verbs: module, name, and the line that `stepload --help` shows."""

from __future__ import annotations

from typing import ClassVar

from stepload.cli.on_demand import Verb, VerbsOnDemand

LINES = {
    "plans.preflight": "Say before the run whether payload and rig can succeed. Exit 0: go or "
    "warn; 3: refused.",
    "plans.schema": "Print the JSON Schema of a plan, for editors, or that of results.json.",
    "plans.profiles": "List the rig profiles and the data sheets of force sensors that come with "
    "stepload.",
    "shipped.plans": "Plans that come with stepload, ready to run or to begin with.",
    "setup.setup": "Write a rig file step by step. It can be left at any time; the next start goes "
    "on.",
    "setup.init": "Write the plan of a payload from answers; preflight must let it through. Exit "
    "3: it does not.",
    "experiments.run": "Run a plan: preflight, press, record, identify, report.",
    "experiments.pause": "Pause a run after its step, unloaded; with --resume it tares, touches "
    "and goes on.",
    "live.layout": "Write a layout for Foxglove and Lichtblick: force and limits, curve, phase, "
    "margins.",
    "identify.identify": "Identify the contact law from a record or a CSV file; nothing is moved "
    "or changed.",
    "records.recover": "Repair what was not finished, verify it by reading back, and identify what "
    "is there.",
    "records.replay": "Run the supervisor over a record: where would it have tripped? Exit 4 if it "
    "would have.",
    "results.calibrate": "Measure the system stiffness K_s (26) and write its calibration record.",
    "results.compare": "Compare runs with each other and with an imported curve; nothing is moved "
    "or changed.",
    "data.runs": "List the runs of a directory: payload, specimen, date, verdict, stiffness, how "
    "they ended.",
    "data.export": "Write force–deformation curve, levels, touches and raw streams for other "
    "programs.",
    "snippets.snippet": "Print the identified law as contact parameters of a simulator, linearised "
    "at a force.",
    "devices.drivers": "Installed drivers, and the contract they must keep.",
    "doctor.doctor": "Examine a plan's rig: data, disk, clocks, that stop really stops. Exit 0: "
    "sound; 4: not.",
    "hazards.hazards": "Say what software cannot prevent on a rig, with its numbers; to be read "
    "and signed once.",
    "explain.explain": "Say what a code, key, threshold or word means and what to do.",
    "atlas.map": "Say which payloads a rig can measure, and what narrows their intervals.",
    "design.design": "Write the plan with the narrowest interval, below the elastic limit and "
    "within a time.",
    "pose.pose": "Say where to put the plate and how to hold the arm, so that it gives way least.",
}
"""The line of each verb, by its module and its name."""


def _verb(path: str) -> Verb:
    room, name = path.split(".")
    return Verb(name, f"stepload.cli.{room}", LINES[path])


class OwnVerbs(VerbsOnDemand):
    """The `stepload` command's group."""

    VERBS = tuple(map(_verb, LINES))
    ELSEWHERE: ClassVar = dict.fromkeys(
        ("campaign", "emulate", "falsify", "paper"),
        ("stepload-verify", 'pip install "stepload[verify]"'),
    )
