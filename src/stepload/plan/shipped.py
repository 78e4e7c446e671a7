"""The plans that come with stepload: which there are, and copies of them to begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.references import about
from stepload.plan.source import read_source

PACKAGED = Path(__file__).parents[1] / "procedures"
CHECKOUT = Path(__file__).parents[3] / "procedures"
"""In a wheel the plans are part of the package; a checkout has them at its top."""


@dataclass(frozen=True, slots=True)
class ShippedPlan:
    """One plan that comes with stepload; `about` is what its own comment says of it."""

    name: str
    path: Path
    about: str


def shipped_plans() -> list[ShippedPlan]:
    """All of them, by name."""
    return [
        ShippedPlan(path.stem, path, about(read_source(path))) for path in map(plan_path, names())
    ]


def names() -> list[str]:
    """Their names; nothing is read."""
    return sorted(path.stem for path in _folder().glob("*.yaml"))


def plan_path(name: str) -> Path:
    """Where the plan of that name lies."""
    return _folder() / f"{name}.yaml"


def copy_plan(name: str, directory: Path) -> list[Path]:
    """Copy a plan, and the files it names, into a directory; the files that were written.

    Raises:
        BadInputError: no such plan, or a file of that name is there already; nothing was written.
    """
    plans = {plan.name: plan for plan in shipped_plans()}
    if name not in plans:
        raise BadInputError(
            f"no plan {name!r} comes with stepload", hint=f"there are {', '.join(plans)}"
        )
    plan = plans[name].path
    needed = [plan, *_named_by(plan)]
    texts = {directory / path.relative_to(plan.parent): path.read_bytes() for path in needed}
    for path, text in texts.items():
        if path.is_symlink() or (path.exists() and path.read_bytes() != text):
            raise BadInputError(
                f"{path} is there already, and is another file",
                hint="name another directory",
            )
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)
    return list(texts)


def _folder() -> Path:
    return PACKAGED if PACKAGED.is_dir() else CHECKOUT


def payload_folder() -> Path:
    """Where the payloads of the plans that come with stepload lie."""
    return _folder() / "payloads"


def _named_by(plan: Path) -> list[Path]:
    """The other files that a plan is made of."""
    names = (Path(source.name) for source in load_plan(plan).sources[1:])
    return [path for path in names if path.is_file()]
