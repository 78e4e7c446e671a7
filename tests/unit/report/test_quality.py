"""How the contact of a run was made: from its record to objects, words and a figure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_runs import recorded

from stepload.identification.contact_quality import NOT_IN_DATA, ContactQuality
from stepload.identification.fit import Missing
from stepload.record.align import torques
from stepload.record.rows import Phase
from stepload.report.identified import Contact, contact_of
from stepload.report.press_data import press_data
from stepload.report.quality import quality_of


def twisted(axis: str = "+fz", beside_m: tuple[float, float] = (0.0, 3e-3)) -> ContactQuality:
    """The run of `recorded`, its wrench turned to another axis, with torques of a sensor 0.12 m off
    and drifting zeros."""
    run = recorded(noise_n=0.02)
    index, sign = "xyz".index(axis[2]), -1.0 if axis[0] == "-" else 1.0
    others = [i for i in range(3) if i != index]
    time_s = run.force.receive_time_s
    drift_n = 0.1 * time_s
    free = run.force.wrench[:, :3] - np.array([4.0, -2.0, 1.0]) - drift_n[:, None]
    force = np.zeros_like(free)
    force[:, index], force[:, others] = sign * free[:, 2], free[:, :2]
    place = np.zeros(3)
    place[index], place[others] = -0.12 * sign, beside_m
    wrench = np.zeros_like(run.force.wrench)
    wrench[:, :3] = force
    wrench[:, index] += sign * (1.0 + drift_n)
    wrench[:, 3:] = np.cross(place, force) + 0.3 + 0.01 * time_s[:, None]
    wrench[:, 3:] += np.random.default_rng(2).normal(0.0, 1e-3, force.shape)
    phase = run.ticks.phase.copy()
    phase[(time_s > 2.8) & (time_s < 3.4)] = int(Phase.HOLD)
    told = replace(
        run, force=run.force._replace(wrench=wrench),
        ticks=run.ticks._replace(phase=phase), metadata={"force_axis": axis},
    )  # fmt: skip
    found = quality_of(press_data(told), 0.12)
    assert isinstance(found, ContactQuality)
    return found


@pytest.mark.parametrize("axis", ["+fx", "-fx", "+fy", "-fy", "+fz", "-fz"])
def test_share_and_place_come_out_of_a_record_whatever_the_axis(axis: str) -> None:
    found = twisted(axis)
    assert found.branches[0].share == pytest.approx([0.072, 0.096], abs=2e-3)
    place = found.place
    assert not isinstance(place, Missing)
    assert place.beside_m == pytest.approx([0.0, 3e-3], abs=3e-4)


def test_torques_are_told_along_the_other_axes_first() -> None:
    wrench = np.arange(12.0).reshape(2, 6)
    assert torques(wrench, "+fx").tolist() == [[4, 5, 3], [10, 11, 9]]
    assert torques(wrench, "-fy").tolist() == [[3, 5, 4], [9, 11, 10]]
    assert torques(wrench, "+fz").tolist() == [[3, 4, 5], [9, 10, 11]]


def test_objects_hold_what_was_found() -> None:
    nothing = Contact.model_validate(contact_of(Missing(NOT_IN_DATA)))
    assert nothing.branches is nothing.place is None
    found = twisted()
    told = Contact.model_validate(contact_of(found))
    assert told.branches
    assert told.branches[0].share == pytest.approx(found.branches[0].share)
    assert told.place
    assert told.place_missing == ""
    assert told.place.beside_m == pytest.approx(found.place.beside_m)
    assert told.undetected_slip_n == found.undetected_n
