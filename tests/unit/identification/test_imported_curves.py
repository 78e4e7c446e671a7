"""CSV curves: what is found in them, what is assumed and said, and which doubts can be raised."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from long_ones import long

from stepload.errors import BadInputError
from stepload.identification.curve_channels import (
    is_exact,
    quantum,
    white_noise,
)
from stepload.identification.fit import Flag, FloatArray
from stepload.identification.identifiability import identifiability
from stepload.identification.identify import Identification
from stepload.identification.quantity import ResultVerdict
from stepload.record.curves import Curve
from stepload.report.conditions import Stated, with_payload
from stepload.report.curve import PreparedCurve, deformation_curve, prepare
from stepload.report.from_file import identify_file, system_results_of_file

K, N, KS = 6.57e8, 1.5, 3.49e6
SECANT = 300.0 ** (1 - 1 / N) * K ** (1 / N)
NOTHING = Stated()
RIG = Stated(system_stiffness_n_per_m=KS, system_stiffness_sigma_n_per_m=35e3)
Found = tuple[Identification, str]


def course(top_n: float = 300.0, rate_hz: int = 100) -> FloatArray:
    """Free air for 1 s, then steps of 50 N with ramps of 1 s and holds of 1 s."""
    parts = [np.zeros(rate_hz)]
    for level in np.arange(0.0, top_n, 50.0):
        parts += [level + 50.0 * np.arange(1, rate_hz + 1) / rate_hz, np.full(rate_hz, level + 50)]
    return np.concatenate(parts)


def travel(force_n: FloatArray, k: float = K, gap_m: float = 30e-6) -> FloatArray:
    position = (force_n / k) ** (1 / N) + force_n / KS
    free = int(np.argmax(force_n > 0))
    position[:free] = np.linspace(-gap_m, 0.0, free, endpoint=False)
    return position


@pytest.fixture(scope="module")
def known() -> dict[tuple[Stated, bytes], Found]:
    """What was identified already: several tests begin with the same columns."""
    return {}


@pytest.fixture
def identified(tmp_path: Path, known: dict[tuple[Stated, bytes], Found]) -> Callable[..., Found]:
    def write_and_identify(wishes: Stated = NOTHING, /, **columns: FloatArray) -> Found:
        path = tmp_path / "curve.csv"
        table = np.column_stack(list(columns.values()))
        np.savetxt(path, table, "%.10g", ",", header=",".join(columns), comments="")
        key = wishes, path.read_bytes()
        if key not in known:
            found, notes = identify_file(path, wishes)
            known[key] = found, "\n".join(notes)
        return known[key]

    return write_and_identify


def test_a_clean_curve_gives_its_law_back(identified: Callable[..., Found]) -> None:
    force = np.linspace(1.0, 300.0, 300)
    found, notes = identified(displacement_m=(force / K) ** (1 / N), force_n=force)
    for name in ("rs_btls", "rs_rtls", "joint"):
        assert found.fits[name].n == pytest.approx(N, abs=1e-4), name
        assert found.fits[name].secant_n_per_m == pytest.approx(SECANT, rel=1e-4), name
    assert "taken from the residuals" in notes
    assert "guided axis" not in notes


def test_numbers_without_noise_or_steps_identify_nothing(
    identified: Callable[..., Found],
) -> None:
    force = np.linspace(1.0, 300.0, 300)
    found, _ = identified(displacement_m=(force / K) ** (1 / N), force_n=force)
    judged = found.judgement
    assert judged is not None
    assert judged.exponent is not None
    assert math.isinf(judged.exponent.interval[1])
    assert all(math.isinf(each.interval_n_per_m[1]) for each in judged.quantities.values())
    verdicts = {each.verdict for each in (judged.exponent, *judged.quantities.values())}
    assert ResultVerdict.IDENTIFIED not in verdicts


def covers(found: Identification) -> bool:
    assert found.interval_secant_n_per_m is not None
    low, high = found.interval_secant_n_per_m
    return low < SECANT < high


@pytest.mark.parametrize("bias_n", [0.0, 12.0, *long([-20.0])])
def test_force_in_free_air_is_taken_out(identified: Callable[..., Found], bias_n: float) -> None:
    rng = np.random.default_rng(1)
    force = course()
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=travel(force) + rng.normal(0, 0.3e-6, force.size),
        force_n=force + bias_n + rng.normal(0, 0.5, force.size),
    )  # fmt: skip
    assert found.selected == "joint"
    assert found.fit.n == pytest.approx(N, abs=0.05)
    assert covers(found)
    assert "touch taken where the force passes 3" in notes
    assert ("taken out" in notes) == (bias_n != 0.0)


def test_only_the_first_loading_counts(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(2)
    up = course()
    force = np.concatenate([up, up[::-1], 1.01 * up])
    position = travel(force)
    position[up.size : 2 * up.size] += 5e-6
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=position + rng.normal(0, 0.3e-6, force.size),
        force_n=force + rng.normal(0, 0.5, force.size),
    )  # fmt: skip
    assert "first loading only" in notes
    assert found.fit.secant_n_per_m == pytest.approx(SECANT, rel=0.01)
    assert covers(found)


def test_data_that_begin_in_contact_are_told_and_found(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(3)
    force = np.linspace(30.0, 300.0, 2000)
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=3e-3 + travel(force) + rng.normal(0, 0.3e-6, force.size),
        force_n=force + rng.normal(0, 0.3, force.size),
    )  # fmt: skip
    assert "the data begin in contact, at 30" in notes
    assert found.selected == "joint"
    # At the first sample payload and system are bent by 30 N already.
    assert found.fit.zero_m == pytest.approx(-((30 / K) ** (1 / N) + 30 / KS), abs=1e-6)
    assert covers(found)


def test_a_spike_in_free_air_is_no_touch(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(4)
    force = course()
    spiked = force + rng.normal(0, 0.3, force.size)
    spiked[40] = 80.0
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100, position_m=travel(force), force_n=spiked
    )
    assert abs(found.fit.zero_m) < 8e-6
    assert covers(found)


@pytest.mark.parametrize(("row", "newton", "metre"), [
    (500, 3000.0, 0.0), (430, 0.0, 1e-3),
    pytest.param(610, -200.0, -50e-6, marks=pytest.mark.long),
])  # fmt: skip
def test_a_glitch_is_dropped_counted_and_told(
    identified: Callable[..., Found], row: int, newton: float, metre: float
) -> None:
    rng = np.random.default_rng(8)
    force = np.concatenate([course(), course()[::-1]])
    position = travel(force) + rng.normal(0, 5e-8, force.size)
    noisy = force + rng.normal(0, 0.3, force.size)
    clean, _ = identified(RIG, position_m=position, force_n=noisy)
    noisy[row] += newton
    position[row] += metre
    found, notes = identified(RIG, position_m=position, force_n=noisy)
    assert f"1 of {force.size} row dropped" in notes
    assert f"row {row + 1}," in notes
    assert found.headline is not None
    assert clean.headline is not None
    assert found.headline.value_n_per_m == pytest.approx(clean.headline.value_n_per_m, rel=2e-3)
    assert found.headline.verdict is clean.headline.verdict


@pytest.mark.parametrize("name", ["Displacement [mm]", *long(["Compression (mm)", "disp_mm"])])
def test_a_displacement_of_a_testing_machine_is_doubted(
    identified: Callable[..., Found], name: str
) -> None:
    """It may be its crosshead's, and all of the machine's compliance is in it."""
    rng = np.random.default_rng(4)
    up = np.linspace(0.0, 300.0, 400)
    force = np.concatenate([up, up[::-1]])
    position = 1e3 * ((force / K) ** (1 / N) + force / KS + rng.normal(0, 5e-8, force.size))
    noisy = force + rng.normal(0, 0.3, force.size)
    found, _ = identified(**{name: position, "force_n": noisy})
    assert found.verdict != "identified"
    assert any("the machine's own deflection" in why for why in found.reasons)
    found, _ = identified(RIG, **{name: position, "force_n": noisy})
    assert found.headline is not None
    assert found.headline.verdict == "identified"
    low, high = found.headline.interval_n_per_m
    ends = np.array([found.headline.from_n, found.headline.to_n])
    assert low < np.diff(ends)[0] / np.diff((ends / K) ** (1 / N))[0] < high
    for own in ("displacement_mm", "Depth [mm]"):
        found, _ = identified(**{own: position, "force_n": noisy})
        assert not any("own deflection" in why for why in found.reasons)


def flags(found: Identification) -> set[Flag]:
    return {doubt.flag for fit in found.fits.values() for doubt in fit.doubts}


def test_noise_and_quanta_leave_points_without_logarithm(identified: Callable[..., Found]) -> None:
    rng = np.random.default_rng(5)
    force = course()
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=np.round((travel(force) + rng.normal(0, 3e-7, force.size)) / 2e-6) * 2e-6,
        force_n=np.round((force + rng.normal(0, 0.5, force.size)) / 1.5) * 1.5,
    )  # fmt: skip
    assert flags(found) >= {Flag.NOT_POSITIVE, Flag.EXPONENT_UNDETERMINED}
    assert found.conditions.position_resolution_m == pytest.approx(2e-6)
    assert covers(found)


def test_a_payload_beyond_the_rig_is_not_identified(identified: Callable[..., Found]) -> None:
    force = course()
    position = np.round(travel(force, k=8.87e10) / 2e-6) * 2e-6
    found, _ = identified(
        RIG, time_s=np.arange(force.size) / 100, position_m=position, force_n=force
    )
    assert found.verdict != "identified"


def test_few_samples_are_flagged_and_fewer_refused(identified: Callable[..., Found]) -> None:
    force = np.linspace(10.0, 300.0, 30)
    found, _ = identified(displacement_m=(force / K) ** (1 / N), force_n=force)
    assert Flag.TOO_FEW_POINTS in flags(found)
    assert found.fit.n == pytest.approx(N, abs=1e-3)
    few = np.linspace(0.0, 300.0, 6)
    with pytest.raises(BadInputError, match="only 5 points"):
        identified(displacement_m=few * 1e-7, force_n=few)


@pytest.mark.parametrize("count", [7, 12, *long([10])])
def test_a_short_table_of_both_branches_is_identified(
    identified: Callable[..., Found], count: int
) -> None:
    up = np.linspace(0.0, 300.0, count)
    force = np.concatenate([up, up[-2::-1]])
    rng = np.random.default_rng(count)
    depth = (force / K) ** (1 / N) + rng.normal(0, 5e-8, force.size)
    found, _ = identified(displacement_m=depth, force_n=force + rng.normal(0, 0.1, force.size))
    headline = found.headline
    assert headline is not None
    assert headline.verdict == "identified"
    low, high = headline.interval_n_per_m
    span_m = (headline.to_n / K) ** (1 / N) - (headline.from_n / K) ** (1 / N)
    assert low < (headline.to_n - headline.from_n) / span_m < high


def test_k_max_rests_on_a_resolution_that_the_travel_shows(
    identified: Callable[..., Found],
) -> None:
    force = np.linspace(0.0, 300.0, 600)
    noisy = force + np.random.default_rng(1).normal(0, 0.3, force.size)
    smooth = (force / K) ** (1 / N) + force / KS
    found, notes = identified(RIG, position_m=smooth, force_n=noisy)
    assert np.isnan(found.k_max_n_per_m)
    assert not any("K_max" in reason for reason in found.reasons)
    assert "K_max (34) is not known" in notes
    assert "taken as a guided axis" in notes
    found, notes = identified(RIG, position_m=np.round(smooth / 1e-6) * 1e-6, force_n=noisy)
    assert "position resolution for K_max (34): 1 µm, its least step" in notes
    assert found.k_max_n_per_m == pytest.approx(
        identifiability(found.peak_force_n, 1e-6, KS).k_max_n_per_m, rel=1e-6
    )
    found, notes = identified(
        Stated(system_stiffness_n_per_m=KS, position_noise_m=2e-6), position_m=smooth, force_n=noisy
    )
    assert "position resolution for K_max (34): 4 µm, twice the stated noise" in notes


@pytest.mark.parametrize("signs", [(1, -1), (-1, 1), *long([(-1, -1)])])
def test_signs_of_others_are_turned_and_told(
    identified: Callable[..., Found], signs: tuple[int, int]
) -> None:
    rng = np.random.default_rng(6)
    force = course()
    found, notes = identified(
        RIG, time_s=np.arange(force.size) / 100,
        position_m=signs[0] * (0.3 + travel(force) + rng.normal(0, 0.3e-6, force.size)),
        force_n=signs[1] * (force + 8.0 + rng.normal(0, 0.5, force.size)),
    )  # fmt: skip
    assert covers(found)
    assert ("the travel falls towards the payload" in notes) == (signs[0] < 0)
    assert ("pressing is negative" in notes) == (signs[1] < 0)


@pytest.mark.long
def test_intervals_without_a_stated_smooth_error_cover(identified: Callable[..., Found]) -> None:
    """Nominal 95 %: fewer than 16 of 20 inside would happen by chance once in 400 times."""
    inside = 0
    force = np.linspace(3.0, 300.0, 150)
    grid = np.linspace(0.0, 300.0, 61)
    root = np.linalg.cholesky(
        np.exp(-0.5 * (np.subtract.outer(grid, grid) / 50) ** 2) + 1e-9 * np.eye(61)
    )
    for seed in range(20):
        draw = 0.54e-6 * root @ np.random.default_rng(seed).standard_normal(61)
        found, _ = identified(
            displacement_m=(force / K) ** (1 / N) + np.interp(force, grid, draw), force_n=force
        )
        assert found.interval_secant_n_per_m is not None
        low, high = found.interval_secant_n_per_m
        inside += low < SECANT < high
    assert inside >= 16


def test_noise_is_told_from_curvature_and_quantum_from_noise() -> None:
    rng = np.random.default_rng(0)
    force = np.linspace(10, 300, 40)
    law = (force / K) ** (1 / N)
    assert white_noise(law) < 3e-8
    assert white_noise(law[:7]) == 0.0
    noise = rng.normal(0, 2.0, 5000)
    assert white_noise(noise) == pytest.approx(2.0, rel=0.1)
    assert quantum(law) == 0.0
    assert is_exact(law)
    assert not is_exact(law + rng.normal(0, 1e-9, 40))
    assert not is_exact(np.round(np.repeat(law, 3) / 1e-7) * 1e-7)
    assert quantum(np.round(rng.normal(0, 2e-5, 500) / 2e-6) * 2e-6) == pytest.approx(2e-6)


def indentation(
    top_n: float = 300.0, lead_in_m: float = 40e-6, count: int = 2000, seed: int = 0
) -> tuple[FloatArray, FloatArray]:
    """Deformation and force with a lead-in through free air and noise of 0.1 % of either."""
    rng = np.random.default_rng(seed)
    deep = (top_n / K) ** (1 / N)
    depth = np.linspace(-lead_in_m, deep, count)
    force = K * np.maximum(depth, 0.0) ** N
    return (
        depth + lead_in_m + rng.normal(0, 1e-3 * deep, count),
        force + rng.normal(0, 1e-3 * top_n, count),
    )


@pytest.mark.parametrize("bias", [0.0, 0.2, *long([-0.3])])
def test_a_lead_in_of_a_deformation_is_found(identified: Callable[..., Found], bias: float) -> None:
    """Kept, it makes n = 4.65 of 1.5."""
    depth, force = indentation()
    found, notes = identified(displacement_m=depth, force_n=force + bias * 300.0)
    assert found.fit.n == pytest.approx(N, abs=0.05)
    assert covers(found)
    assert "touch taken where the force passes 3" in notes
    assert ("taken out" in notes) == (bias != 0.0)


def test_free_air_that_tilts_is_taken_out_as_a_line(identified: Callable[..., Found]) -> None:
    depth, force = indentation(lead_in_m=200e-6)
    found, notes = identified(displacement_m=depth, force_n=force + depth * 15.0 / 200e-6)
    assert "taken out as a straight line" in notes
    assert found.fit.n == pytest.approx(N, abs=0.06)
    assert covers(found)


def curve(**columns: FloatArray | None) -> Curve:
    given = {"time_s": None, "position_m": None, "displacement_m": None} | columns
    return Curve(**given)  # type: ignore[arg-type]


def test_adhesion_before_the_touch_is_told(identified: Callable[..., Found]) -> None:
    depth, force = indentation()
    near = (depth > 36e-6) & (depth < 40e-6)
    pulled = np.where(near, -24.0, force)
    assert prepare(curve(displacement_m=depth, force_n=pulled), NOTHING).run.adhesive
    assert not prepare(curve(displacement_m=depth, force_n=force), NOTHING).run.adhesive
    _, notes = identified(displacement_m=depth, force_n=pulled)
    assert "a law with adhesion is tried too" in notes


def cycles(tops: tuple[float, ...]) -> tuple[FloatArray, FloatArray, PreparedCurve]:
    """Free air, then load, hold and unload to zero for each top."""
    rng = np.random.default_rng(1)
    force = [np.zeros(200)]
    for top in tops:
        force += [np.linspace(0, top, 300), np.full(100, top), np.linspace(top, 0, 200)]
    pressed = np.concatenate(force)
    depth = (pressed / K) ** (1 / N)
    depth[:200] = np.linspace(-30e-6, 0.0, 200)
    lateral = np.stack([0.06 * pressed + 3.0, 0.08 * pressed - 4.0])
    given = curve(
        time_s=np.arange(pressed.size) / 100.0,
        displacement_m=depth + rng.normal(0, 1e-8, pressed.size),
        force_n=pressed + rng.normal(0, 0.1, pressed.size), lateral_n=lateral,
    )  # fmt: skip
    return depth, pressed, prepare(given, NOTHING)


def test_cycles_have_one_zero_and_two_branches() -> None:
    _, _, found = cycles((300.0, 300.0))
    (one, first, _), (other, _, _) = found.run.tracks
    assert (one, other) == (1, 2)
    deep = (300.0 / K) ** (1 / N)
    for _, loading, unloading in found.run.tracks:
        assert unloading is not None
        held = loading.held == 1
        assert loading.force_n[~held][-1] == pytest.approx(297.0, abs=4.0)
        assert np.count_nonzero(held) == pytest.approx(103, abs=5)
        assert unloading.force_n[-1] == pytest.approx(0.0, abs=4.0)
        at_touch = (3.0 / K) ** (1 / N)
        assert loading.travel_m[held].mean() == pytest.approx(deep - at_touch, rel=0.02)
    assert first.force_n[0] == pytest.approx(3.0, abs=1.2)
    assert found.run.timed
    assert found.run.lateral_force.share == pytest.approx(0.1, rel=0.03)


def test_of_growing_cycles_only_what_is_new_is_a_first_loading() -> None:
    _, _, found = cycles((100.0, 200.0, 300.0))
    [(_, loading, unloading)] = found.run.tracks
    assert unloading is not None
    assert np.unique(loading.held).tolist() == [0, 1]
    assert (loading.force_n == found.selected.force_n).all()
    assert "of 3 growing cycles" in "\n".join(found.notes)
    assert found.selected.force_n.max() == pytest.approx(300.0, abs=1.0)
    reached = np.maximum.accumulate(found.selected.force_n)
    assert (reached - found.selected.force_n).max() < 2.0, "no reloading among it"


@pytest.mark.parametrize("scale", [1e-4 / 300.0, 1e4 / 300.0, *long([1e-3 / 300.0, 1.0])])
def test_a_stated_error_counts_at_every_force(
    identified: Callable[..., Found], scale: float
) -> None:
    """The same curve in other units of force has the same relative interval."""
    force = np.linspace(1.0, 300.0, 300)
    depth = (force / K) ** (1 / N)
    found, _ = identified(
        Stated(
            smooth_error_m=0.5e-6, force_noise_n=1.5 * scale, position_noise_m=1e-8,
            secant_force_n=300.0 * scale, nonlinearity=0.0,
        ),
        displacement_m=depth, force_n=force * scale,
    )  # fmt: skip
    assert found.interval_secant_n_per_m is not None
    low, high = found.interval_secant_n_per_m
    assert np.log(high / low) / 2 == pytest.approx(0.0368, rel=0.03)
    assert found.fits["odr"].n == pytest.approx(N, abs=1e-3)


@pytest.mark.parametrize(("top_n", "at_n"), [(1e-3, 1e-3), (300, 300), (2000, 300), (1e4, 1e4)])
def test_the_secant_is_taken_at_a_force_of_the_curve(top_n: float, at_n: float) -> None:
    force = np.linspace(0.01, 1.0, 300) * top_n
    given = curve(displacement_m=1e-4 * (force / top_n) ** (1 / N), force_n=force)
    assert prepare(given, NOTHING).run.conditions.secant_force_n == pytest.approx(at_n)
    assert prepare(given, Stated(secant_force_n=0.5 * top_n)).run.conditions.secant_force_n == (
        pytest.approx(0.5 * top_n)
    )


def test_the_length_of_the_smooth_error_can_be_stated(identified: Callable[..., Found]) -> None:
    depth, force = indentation()
    widths = []
    for length_n in (10.0, 50.0, 1000.0):
        found, notes = identified(
            Stated(smooth_error_m=1e-6, smooth_length_n=length_n),
            displacement_m=depth, force_n=force,
        )  # fmt: skip
        assert found.secant_sigma is not None
        assert "--smooth-length" not in notes
        widths.append(found.secant_sigma)
    assert widths[1] > 3.0 * widths[2], "over so long a force it is an offset, and fitted"
    assert len({round(width, 6) for width in widths}) == 3


def test_magnitudes_that_a_payload_cannot_have_are_doubted(
    identified: Callable[..., Found],
) -> None:
    payload = Path(__file__).parents[3] / "procedures" / "payloads" / "plastic-sphere.yaml"
    wishes = with_payload(payload, Stated())
    assert wishes.theory_n == 1.5
    depth, force = indentation()
    depth, force = np.concatenate([depth, depth[::-1]]), np.concatenate([force, force[::-1]])
    assert identified(wishes, displacement_m=depth, force_n=force)[0].verdict == ("identified")
    for wrong in (
        {"displacement_m": 1e3 * depth, "force_n": force},
        {"displacement_m": depth, "force_n": 1e-3 * force},
    ):
        found, _ = identified(wishes, **wrong)
        assert found.verdict == "marginal"
        assert "payload's law gives" in found.reasons[0]


@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1)])
def test_a_system_of_other_signs_and_zeros(tmp_path: Path, signs: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    force, path = course(), tmp_path / "flat.csv"
    flat = travel(force, k=5e11) + rng.normal(0, 2e-7, force.size)
    pressed = force + rng.normal(0, 0.5, force.size)
    columns = np.arange(force.size) / 100, signs[0] * flat, signs[1] * pressed - 20.0
    header = "time_s,position_m,force_n"
    np.savetxt(path, np.column_stack(columns), "%.8g", ",", header=header, comments="")
    assert system_results_of_file(path)[0].stiffness_n_per_m == pytest.approx(KS, rel=0.01)


def test_a_curve_to_compare_with_gets_the_same_care() -> None:
    depth, force = indentation()
    there_and_back = np.concatenate([depth, depth[::-1]])
    found = deformation_curve(
        curve(displacement_m=-there_and_back, force_n=-np.concatenate([force, force[::-1]]) - 30.0)
    )
    assert found.displacement_m is not None
    assert found.displacement_m[-1] == pytest.approx((300.0 / K) ** (1 / N), rel=0.01)
    assert found.force_n[-1] == pytest.approx(300.0, rel=0.02)
    with pytest.raises(BadInputError):
        deformation_curve(curve(position_m=depth, force_n=force))
    with pytest.raises(BadInputError):
        deformation_curve(
            curve(displacement_m=depth, force_n=force, perhaps_machine="Displacement")
        )


@pytest.mark.parametrize(("preload", "lead_in"), [(0.0, 200), (0.0, 0), (20.0, 0)])
def test_a_secant_needs_a_zero_of_force_that_somebody_saw(
    identified: Callable[..., Found], preload: float, lead_in: int
) -> None:
    """A preload that was tared away leaves no trace: the chord bears it, a secant does not."""
    rng = np.random.default_rng(12)
    up = np.linspace(preload, 300.0, 400)
    loaded = np.concatenate([np.zeros(lead_in), up, up[::-1], np.zeros(lead_in)])
    depth = (loaded / K) ** (1 / N)
    depth[:lead_in] = np.linspace(-5e-5, 0.0, lead_in)
    depth[depth.size - lead_in :] = np.linspace(0.0, -5e-5, lead_in)
    columns = {
        "displacement_m": depth + rng.normal(0, 5e-8, depth.size),
        "force_n": loaded - preload + rng.normal(0, 0.1, depth.size),
    }
    found, notes = identified(Stated(smooth_error_m=2e-7), **columns)
    assert ("no free air" in notes) is (lead_in == 0)
    assert found.headline is not None
    assert found.headline.verdict == "identified"
    secant = found.quantities["secant_from_touch"]
    assert (secant.verdict == "identified") is (lead_in > 0)
    assert any("no free air" in why for why in secant.why) is (lead_in == 0)
    vouched, _ = identified(Stated(smooth_error_m=2e-7, tared=True), **columns)
    why = vouched.quantities["secant_from_touch"].why
    assert not any("no free air" in each for each in why)
