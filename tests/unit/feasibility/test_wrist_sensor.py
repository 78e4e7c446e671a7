"""What a UR10e's own sensor is good for, by the figures of docs/devices/ur-force.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from stepload.feasibility.preflight import derive
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.plan.load import load_plan

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "devices" / "ur-force.md").read_text()
(EXAMPLE,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
PLAN = """stepload: 1
payload: {payload}
rig:
  profile: ur10e
  arm:
    options: {{host: 192.168.1.10}}
{channels}
  system_stiffness: {{stuck_ratio: {ratio}}}
procedure: {{top_force: {top}, step: {step}, surface_distance: 5 mm, surface_uncertainty: 0.5 mm}}
"""


def judged(tmp_path: Path, payload: str, top: str, step: str, stuck_ratio: float = 2.6):
    path = tmp_path / "plan.yaml"
    channels = "\n".join(f"  {line}" for line in EXAMPLE.splitlines())
    payload_path = ROOT / "procedures" / "payloads" / f"{payload}.yaml"
    path.write_text(
        PLAN.format(payload=payload_path, channels=channels, top=top, step=step, ratio=stuck_ratio)
    )
    return derive(load_plan(path))


@pytest.mark.parametrize("payload", ["plastic-sphere", "plastic-cone", "plastic-cube"])
def test_payloads_stiffer_than_rubber_are_refused_with_the_reason(tmp_path, payload):
    preflight = judged(tmp_path, payload, "90 N", "30 N")
    assert preflight.verdict is PlanVerdict.REFUSED
    refusing = {r.code: r.message for r in preflight.reasons if r.severity is Severity.REFUSE}
    assert refusing["unidentifiable"]
    assert refusing["top_force_above_safe_limit"]


def test_no_payload_is_pressed_beyond_the_sensors_range(tmp_path):
    preflight = judged(tmp_path, "plastic-sphere", "300 N", "50 N")
    assert "sensor_range" in {r.code for r in preflight.reasons}
