"""A small good plan that the tests of this room alter."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

PAYLOAD = """\
name: ball
geometry: {shape: sphere, radius: 28.7 mm}
material: {name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}
plate: {name: aluminium, youngs_modulus: 70 GPa, poisson_ratio: 0.33}
"""

PLAN = """\
stepload: 1
payload: ball.yaml
rig: stvf
procedure: {step: 50 N, top_force: 300 N, surface_distance: 5 mm}
"""

WritePlan = Callable[..., Path]


@pytest.fixture
def write_plan(tmp_path: Path) -> WritePlan:
    """Writes the good plan with (old, new) replacements, beside its payload; gives its path."""

    def write(*changes: tuple[str, str]) -> Path:
        (tmp_path / "ball.yaml").write_text(PAYLOAD, encoding="utf-8")
        text = PLAN
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "plan.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
