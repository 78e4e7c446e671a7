"""Arguments and options that several verbs share: plans, runs by path or id, quantities."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

RUNS = "STEPLOAD_RUNS"
"""Environment variable of the directory in which a run id is looked up; by default `runs`."""


def runs_directory() -> Path:
    """The directory of the runs."""
    return Path(os.environ.get(RUNS) or "runs")


def run_path(text: str) -> Path:
    """The path for a text: a file, a directory, or the record of the run with this id.

    Raises:
        BadInputError: no run or more than one has an id that begins with it.
    """
    if os.path.lexists(text) or not _may_be_id(text):
        return Path(text)
    from stepload.data.catalog import find_run

    return find_run(text, runs_directory())


def run_directory(text: str) -> Path:
    """The directory of the run named by a text; raises as `run_path`."""
    path = run_path(text)
    return path.parent if path.is_file() else path


def _may_be_id(text: str) -> bool:
    return 6 <= len(text) <= 12 and all(letter in "0123456789abcdef" for letter in text.lower())


def run_ids(incomplete: str) -> list[str]:
    """Ids of runs that begin with a text, for the shell's completion; it completes paths itself."""
    if not _may_be_id(incomplete.ljust(6, "0")) or not runs_directory().is_dir():
        return []
    from stepload.data.catalog import rows

    return [row.run_id for row in rows(runs_directory()) if row.run_id.startswith(incomplete)]


def names_of(groups: Iterable[str], incomplete: str) -> list[str]:
    """Drivers or worlds whose names begin with a text, for the shell's completion."""
    from stepload.rig.plugins import driver_names

    names = {name for group in groups for name in driver_names(group)}
    return sorted(name for name in names if name.startswith(incomplete))


def rig_names(incomplete: str) -> list[str]:
    """Rig profiles whose names begin with a text, for the shell's completion."""
    from stepload.plan.references import profiles

    return [name for name in profiles() if name.startswith(incomplete)]


def quantity(flag: str, unit: str, help: str, **how: Any) -> Any:
    """An option whose text with a unit becomes a float in `unit`; its errors name the flag."""

    def parse(text: str | float) -> float:
        from stepload.units import parse_named

        return text if isinstance(text, float) else parse_named(flag, text, unit)

    return Option(flag, parser=parse, metavar="QUANTITY", help=help, **how)


PlanFile = Annotated[Path, Argument(help="Plan (YAML).", show_default=False)]
RigName = Annotated[
    str,
    Argument(
        help="Rig profile, or a rig file (YAML).", show_default=False,
        autocompletion=rig_names,
    ),
]  # fmt: skip
PayloadFile = Annotated[
    Path | None, Option("--payload", help="Another payload file than the plan's.")
]
DryRun = Annotated[
    bool, Option("--dry-run", help="On the simulated rig, in virtual time; moves nothing.")
]
World = Annotated[
    str,
    Option(
        "--world", help="Simulator of a dry run, in place of the plan's.",
        autocompletion=lambda incomplete: names_of(("stepload.worlds",), incomplete),
    ),
]  # fmt: skip
OutDirectory = Annotated[
    Path | None, Option("--out", help="Directory for the run's files (a new one).")
]
Seed = Annotated[int | None, Option("--seed", min=0, help="Seed of the simulated rig.")]
RunPath = Annotated[
    Path,
    Argument(
        parser=run_path, metavar="RUN", help="A run: its directory, its record, or its id.",
        autocompletion=run_ids,
    ),
]  # fmt: skip
RunOrCurve = Annotated[
    Path,
    Argument(
        parser=run_path, metavar="FILE", help="A run (directory, record, id), or a CSV curve."
    ),
]
Certificate = Annotated[
    Path | None, Option(help="Certificate (PEM) of an address that others reach.")
]
Key = Annotated[Path | None, Option(help="Its private key (PEM).")]
Rough = Annotated[
    bool, Option("--rough", help="Multiply a curve's deformation by the factor of (10).")
]
Plastic = Annotated[
    bool, Option("--plastic", help="Multiply a curve's deformation by the factor of (15).")
]
Surface = Annotated[
    str | None, Option(help='σ_eq and hardness of a factor, "7.5 um, 0.7 GPa"; the payload\'s.')
]
TipRadius = Annotated[
    float | None, quantity("--tip-radius", "m", 'Tip radius of a factor, "3.3 mm"; the payload\'s.')
]
