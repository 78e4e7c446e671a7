"""Real `stepload` processes: a quick plan, and a stage to stop them on."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from real_runs import QUICK, ROOT, Staged, stepload


@pytest.fixture
def quick(tmp_path: Path) -> Path:
    """A plan of about 8 s on the simulated rig, with every phase but unloading."""
    path = tmp_path / "quick.yaml"
    path.write_text(QUICK)
    return path


@pytest.fixture(scope="session")
def plastic_sphere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of one dry run of the paper's plastic sphere."""
    directory = tmp_path_factory.mktemp("plastic-sphere") / "run"
    plan = ROOT / "procedures" / "plastic-sphere.yaml"
    done = stepload("run", plan, "--dry-run", "--quiet", "--out", directory)
    assert done.returncode == 0, done.stderr
    return directory


@pytest.fixture
def stage() -> Iterator[Callable[..., Staged]]:
    """Starts staged processes and ends what is left of them."""
    started: list[Staged] = []

    def start(directions: dict[str, Any], *arguments: object) -> Staged:
        started.append(Staged(directions, arguments))
        return started[-1]

    yield start
    for staged in started:
        staged.close()
