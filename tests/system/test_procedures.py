"""Every plan that comes with stepload is valid and says what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.plan.load import load_payload, load_plan

PROCEDURES = Path(__file__).parents[2] / "procedures"
PLANS = sorted(PROCEDURES.glob("*.yaml"))
PAYLOADS = sorted((PROCEDURES / "payloads").glob("*.yaml"))


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
def test_every_plan_loads(path: Path) -> None:
    assert load_plan(path).name == path.stem
    assert path.read_text().startswith("# ")


@pytest.mark.parametrize("path", PAYLOADS, ids=lambda path: path.stem)
def test_every_payload_loads_by_itself(path: Path) -> None:
    load_payload(path)
    assert path.read_text().startswith("# ")


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
def test_every_payload_fits_every_plan_of_its_rig(path: Path) -> None:
    other = PROCEDURES / "payloads" / "stiff-flat.yaml"
    assert load_plan(path, payload=other).payload.name == "flat aluminium pad"
