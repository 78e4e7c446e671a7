"""What is judged of ideal worlds, and of worlds that are not what they are taken for."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import HERTZ_K, World, hertz, press, straight_table, there_and_back, told

from stepload.contact.rough import RoughSphere
from stepload.errors import DomainError
from stepload.identification.branches import read_of
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.figures import SEAT, exponent
from stepload.identification.fit import FloatArray
from stepload.identification.lawfit import Whitened, fit_law
from stepload.identification.laws import BILINEAR, HERTZ_LINEAR, POWER
from stepload.identification.loops import Hold, Track
from stepload.identification.quantity import ResultVerdict
from stepload.identification.verdict import Judgement, judge

PLANE = "secant_from_mean_plane"
RUNS = 4


def chord_of(world: World, found: Judgement) -> float:
    """The true chord between the forces that the headline names."""
    at = np.array([found.headline.from_n, found.headline.to_n])
    return float(np.diff(at)[0] / np.diff(world.law(at))[0])


def holds(interval: tuple[float, float], truth: float) -> bool:
    return interval[0] <= truth <= interval[1]


def shown(found: Judgement) -> set[str]:
    """The signs that the errors do not explain."""
    return {part.name for part in found.inelastic.parts if part.shown_m}


def pad_over_stiff(force_n: FloatArray) -> FloatArray:
    return np.asarray(force_n / 12e6 + np.minimum(force_n, 90.0) / 5e6)


def stop(force_n: FloatArray) -> FloatArray:
    beyond = np.maximum(hertz(force_n) - hertz(np.array([180.0]))[0], 0.0)
    return np.asarray(hertz(force_n) - 0.5 * beyond)


def test_a_kink_is_read_at_the_ends_and_has_no_tangent() -> None:
    force_n = np.linspace(0.3, 300.0, 300)
    conditions = Conditions(Sources(None, position_noise_m=1e-6), 300.0, 3.0, 1e-6)
    held = 0
    for seed in range(RUNS):
        noise_m = 1e-6 * np.random.default_rng(seed).standard_normal(force_n.size)
        found = judge(there_and_back(force_n, stop(force_n) + noise_m, conditions))
        truth = chord_of(World(law=stop), found)
        held += holds(found.headline.interval_n_per_m, truth)
        assert found.quantities["tangent"].verdict is not ResultVerdict.IDENTIFIED
    assert held == RUNS


@pytest.mark.parametrize("points", [8, 12])
def test_a_few_points_far_apart_are_no_kink(points: int) -> None:
    force_n = np.linspace(5.0, 300.0, points)
    conditions = Conditions(Sources(None, position_noise_m=0.3e-6), 300.0, 3.0, 0.3e-6)
    held = 0
    for seed in range(RUNS):
        noise_m = 0.3e-6 * np.random.default_rng(seed).standard_normal(points)
        found = judge(there_and_back(force_n, hertz(force_n) + noise_m, conditions))
        held += holds(found.headline.interval_n_per_m, chord_of(World(), found))
    assert held == RUNS


@pytest.mark.parametrize(
    "world",
    [
        World(),
        World(law=lambda force: (force / 2.2e7) ** (1 / 1.2)),
        World(law=lambda force: force / 6e6),
        World(force_noise_n=6.0),
    ],
    ids=["sphere", "n 1.2", "flat", "2 % noise"],
)
def test_an_ideal_contact_is_identified_and_true(world: World) -> None:
    for seed in range(RUNS):
        found = judge(press(world, seed))
        assert found.headline.verdict == "identified", found.headline.why
        assert holds(found.headline.interval_n_per_m, chord_of(world, found))
        secant = found.quantities["secant_from_touch"]
        assert holds(secant.interval_n_per_m, secant.to_n / world.law(np.array([secant.to_n]))[0])


@pytest.mark.parametrize("law", [pad_over_stiff, stop])
def test_figures_hold_in_any_shape_and_the_exponent_is_not_identified(law: object) -> None:
    world = World(law=law)  # type: ignore[arg-type]
    for seed in range(RUNS):
        found = judge(press(world, seed))
        assert found.headline.verdict == "identified", found.headline.why
        assert holds(found.headline.interval_n_per_m, chord_of(world, found))
        secant = found.quantities["secant_from_touch"]
        assert holds(secant.interval_n_per_m, secant.to_n / world.law(np.array([secant.to_n]))[0])
        assert found.exponent is not None
        assert found.exponent.verdict != "identified"


@pytest.mark.parametrize(
    ("world", "signs"),
    [
        (World(creep=0.2), {"reload"}),
        (World(set_m=10e-6), {"set", "seat", "gap"}),
        (World(creep=0.2, hold_s=20.0), {"creep"}),
        (World(damping_s=0.15), {"rate", "seat"}),
        (World(cycles=1, loop=0.25), {"gap"}),
    ],
    ids=["creep", "set", "long holds", "damping", "loop of one cycle"],
)
def test_what_is_not_elastic_is_told_and_no_law_is_identified(
    world: World, signs: set[str]
) -> None:
    for seed in range(RUNS):
        found = judge(press(world, seed))
        assert signs <= shown(found)
        assert not found.elastic
        assert found.inelastic.share > found.within
        assert found.exponent is None or found.exponent.verdict != "identified"


@pytest.mark.parametrize(
    ("world", "line", "least"),
    [
        (World(drift_m_per_s=0.3e-6), "drift that is not even", 0.02),
        (World(set_m=10e-6), "drift that is not even", 0.04),
        (World(cycles=1, drift_m_per_s=0.1e-6), "drift (one cycle)", 0.01),
        (World(lateral=0.08), "lateral force", 0.02),
        (World(said={"zero_step_n": 40.0}), "zero of force", 0.1),
    ],
    ids=["drift", "set", "drift of one cycle", "lateral", "zero of force"],
)
def test_what_can_be_bounded_is_a_line_and_the_chord_holds(
    world: World, line: str, least: float
) -> None:
    held = 0
    for seed in range(3 * RUNS):
        found = judge(press(world, seed))
        assert line_of(found, line) > least
        held += holds(found.headline.interval_n_per_m, chord_of(world, found))
        narrow = found.headline.half_width <= 0.2
        assert (found.headline.verdict == "identified") == narrow
    assert held >= 3 * RUNS - 2  # of intervals that hold in 95 %


def test_a_loading_alone_is_never_identified() -> None:
    found = judge(press(World(cycles=1, unload=False)))
    assert found.headline.verdict == "marginal"
    assert "only a loading" in found.headline.why[0]


@pytest.mark.parametrize(("down_to", "identified"), [(0.8, False), (0.37, False), (0.33, True)])
def test_an_unloading_that_hardly_begins_is_no_check_of_the_loading(
    down_to: float, identified: bool
) -> None:
    """As in a run that is stopped at its first step down: a set shows little near the top."""
    run = press(World(cycles=1))
    [(number, loading, unloading)] = run.tracks
    assert unloading is not None
    kept = unloading.force_n > down_to * float(loading.force_n.max())
    parts = (unloading.time_s, unloading.force_n, unloading.travel_m, unloading.held)
    begun = Track(*(part[kept] for part in parts))
    found = judge(replace(run, tracks=[(number, loading, begun)]))
    assert (found.headline.verdict == "identified") == identified
    assert identified or "an unloading that ends at" in found.headline.why[0]


def test_a_secant_is_not_extrapolated() -> None:
    found = judge(press(World(top_n=100.0, said={"secant_force_n": 300.0})))
    secant = found.quantities["secant_from_touch"]
    assert secant.to_n == pytest.approx(100.0, rel=0.02)
    assert secant.verdict != "identified"
    assert found.headline.verdict == "identified"


def test_roughness_that_is_stated_gives_a_secant_from_the_mean_plane() -> None:
    run = press(World())
    silent = judge(told(run, rough_length_m=None))
    stated = judge(told(run, rough_length_m=1e-6))
    smooth = judge(told(run, rough_length_m=0.0))
    assert "secant_from_mean_plane" not in silent.quantities
    assert "secant_from_mean_plane" not in smooth.quantities
    assert stated.quantities["secant_from_mean_plane"].value_n_per_m > 0.0
    width = [each.quantities["secant_from_touch"].half_width for each in (silent, smooth)]
    assert width[0] > width[1]


def test_a_roughness_that_is_known_less_well_costs_width_and_is_in_the_budget() -> None:
    rough = RoughSphere(HERTZ_K, 2e-6, 60.0)

    def law(force_n: FloatArray) -> FloatArray:
        return np.array([rough.deformation(max(force, 0.0)) for force in force_n])

    run = press(World(law=law))
    found = [
        judge(told(run, rough_length_m=rough.scale_m, **sigma)).quantities[PLANE]
        for sigma in ({}, {"rough_length_sigma": 0.2}, {"rough_length_sigma": 0.6})
    ]
    default, least, wide = (each.half_width for each in found)
    assert default == least
    assert wide > 1.1 * least
    models = [line for line in found[2].lines if "roughness length known to ±60 %" in line.size]
    assert [line.source for line in models] == ["model (laws and zero)"]


def test_the_chord_begins_at_a_tenth_of_the_top_force() -> None:
    found = judge(press(World()))
    assert found.headline.from_n == pytest.approx(0.1 * found.headline.to_n, rel=1e-6)


def test_a_small_drift_is_taken_out() -> None:
    world = World(drift_m_per_s=0.06e-6, quantum_m=0.2e-6, smooth_m=0.1e-6)
    found = judge(press(world))
    assert found.drift_m_per_s == pytest.approx(0.06e-6, rel=0.1)
    assert found.headline.value_n_per_m == pytest.approx(chord_of(world, found), rel=0.015)


def test_doubts_from_elsewhere_block_every_figure() -> None:
    found = judge(replace(press(World()), doubts=("odd",)))
    assert all(each.verdict != "identified" for each in found.quantities.values())
    assert all("odd" in each.why for each in found.quantities.values())


def test_what_is_asked_for_decides() -> None:
    run = press(World())
    half = judge(run).headline.half_width
    assert judge(told(run, t=1.0 / (1.01 * half))).headline.verdict == "identified"
    assert judge(told(run, t=1.0 / (0.99 * half))).headline.verdict == "marginal"
    [why] = judge(told(run, t=1.0 / (half * (1.0 - 1e-6)))).headline.why
    shown, most = (float(each) for each in re.findall(r"±([\d.]+) %", why))
    assert shown > most


def test_a_force_that_eases_at_a_held_position_is_creep() -> None:
    hold = Hold(force_n=100.0, lasted_s=3.0, crept_m=0.0, eased_n=-2.0, samples=10)
    assert hold.creep(0.2e-6) == pytest.approx(0.4e-6)


def test_every_line_widens_the_interval() -> None:
    """A larger error of any source gives a wider headline."""
    run = press(World())
    narrow = judge(run).headline.half_width
    for wider in (
        {"system_stiffness_sigma_n_per_m": 0.0, "gain_sigma": 0.05},
        {"smooth_error_m": 3e-6},
        {"temperature_sigma_k": 3.0, "position_m_per_k": 1e-6},
        {"temperature_sigma_k": 5.0, "modulus_per_k": 0.01},
    ):
        wide = judge(told(run, **wider)).headline.half_width
        assert wide > 1.1 * narrow, wider
    # A chord of holds hardly feels a lag.
    assert narrow < judge(told(run, lag_sigma_s=0.05)).headline.half_width < 1.1 * narrow
    soft = told(run, system_stiffness_sigma_n_per_m=0.06 * 3.49e6)
    assert judge(soft).headline.half_width > 1.5 * narrow


def test_a_deformation_that_falls_is_refused() -> None:
    run = press(World(system_n_per_m=3.49e6))
    stiff = told(run, system_stiffness_n_per_m=1e6, **straight_table(1e6, 300.0))
    with pytest.raises(DomainError, match="does not rise"):
        judge(stiff)


def test_the_branches_of_a_loop_have_their_own_chords() -> None:
    world = World(loop=0.25)
    found = judge(press(world))
    assert shown(found) == {"gap"}
    assert not found.elastic
    loading, unloading, again = (
        found.quantities[kind] for kind in ("chord", "unloading_chord", "reloading_chord")
    )
    share = np.array([unloading.from_n, unloading.to_n]) / world.top_n
    top_m = world.law(np.array([world.top_n]))[0]
    late = 2.4 * world.loop * share * (1.0 - share) * top_m
    span_m = float(np.diff(world.law(share * world.top_n) + late)[0])
    truth = (unloading.to_n - unloading.from_n) / span_m
    assert holds(unloading.interval_n_per_m, truth)
    assert not holds(loading.interval_n_per_m, truth)
    assert holds(loading.interval_n_per_m, chord_of(world, found))
    assert again.value_n_per_m == pytest.approx(loading.value_n_per_m, rel=0.02)


def test_the_branch_that_is_asked_for_is_the_headline() -> None:
    run = press(World())
    found, requested = judge(run), judge(told(run, branch="unloading"))
    assert requested.headline == found.quantities["unloading_chord"] != found.headline
    assert requested.quantities == found.quantities
    with pytest.raises(DomainError, match="reloading"):
        judge(told(press(World(cycles=1)), branch="reloading"))


def test_a_cycle_that_was_cut_short_is_left_out() -> None:
    run = press(World())
    number, loading, _ = run.tracks[1]
    early = loading.force_n < 60.0
    first = int(np.argmin(early))
    cut = Track(*(getattr(loading, n)[:first] for n in ("time_s", "force_n", "travel_m", "held")))
    found = judge(replace(run, tracks=[run.tracks[0], (number, cut, None)]))
    alone = judge(replace(run, tracks=run.tracks[:1]))
    assert found.headline == alone.headline
    assert found.drift_m_per_s is None


def test_a_secant_below_the_chord_is_the_laws_word() -> None:
    found = judge(told(press(World()), secant_force_n=5.0))
    secant = found.quantities["secant_from_touch"]
    assert secant.verdict != "identified"
    assert "below the" in " ".join(secant.why)


def test_exponents_that_theory_knows_are_told_apart_where_the_data_can() -> None:
    fine = World(quantum_m=0.1e-6, smooth_m=0.05e-6, position_noise_m=0.05e-6)
    rows = {row.name: row for row in judge(press(fine)).laws}
    assert rows["power law, Hertz (n = 1.5)"].alike
    assert not rows["power law, cone (n = 2)"].alike
    assert not rows["power law, linear (n = 1)"].alike
    assert rows["power law"].counts
    assert not rows["power law, Hertz (n = 1.5)"].counts


def test_a_second_loading_alone_still_tells_what_has_set() -> None:
    run = press(World(set_m=10e-6))
    number, loading, _ = run.tracks[1]
    found = judge(replace(run, tracks=[run.tracks[0], (number, loading, None)]))
    assert "set" in shown(found)
    moved = found.inelastic.of("set")
    assert moved is not None
    assert moved.value_m == pytest.approx(0.85 * 10e-6, abs=2.0 * moved.sigma_m)


FINE = World(quantum_m=0.05e-6, position_noise_m=0.02e-6, smooth_m=0.05e-6, force_noise_n=0.1)


def line_of(found: Judgement, begins: str) -> float:
    return next(each.relative for each in found.headline.lines if each.source.startswith(begins))


def test_a_little_damping_is_a_rate_and_a_steady_contact_has_none() -> None:
    damped, steady = judge(press(replace(FINE, damping_s=0.03))), judge(press(FINE))
    assert "rate" in shown(damped) - shown(steady)
    assert holds(damped.headline.interval_n_per_m, chord_of(FINE, damped))


@pytest.mark.parametrize("hold_s", [0.5, 3.0])
@pytest.mark.parametrize("tau_s", [2.0, 10.0, 30.0])
def test_creep_at_the_pace_of_the_holds_is_about_what_the_chord_is_off(
    hold_s: float, tau_s: float
) -> None:
    """Short holds see little of it: what goes on between them counts as well."""
    world = replace(FINE, hold_s=hold_s, creep=0.05, creep_tau_s=tau_s, loop=0.0)
    found = judge(press(world))
    creep = found.inelastic.of("creep")
    assert creep is not None
    at_n = np.array([found.headline.from_n, found.headline.to_n])
    excess_m = np.diff(at_n)[0] / found.headline.value_n_per_m - np.diff(world.law(at_n))[0]
    assert 0.5 * excess_m - 0.1e-6 < creep.value_m < 1.1 * excess_m + 2.0 * creep.sigma_m


def test_points_that_tell_no_shape_of_a_law_leave_it_out() -> None:
    twice = Whitened(np.array([10.0, 10.0]), np.array([1e-6, 2e-6]), 1e-14 * np.eye(2))
    assert all(fit_law(twice, law) is None for law in (POWER, HERTZ_LINEAR, BILINEAR))


def test_short_holds_tell_less_of_creep() -> None:
    long, short = (judge(press(World(hold_s=hold_s))).inelastic for hold_s in (5.0, 0.5))
    sigmas = [part.sigma_m for each in (long, short) if (part := each.of("creep"))]
    assert sigmas[1] > 1.5 * sigmas[0]


def test_a_zero_of_force_that_moves_is_in_the_budget_and_one_that_is_not_known_is_told() -> None:
    run = press(World())
    moved, still = (judge(replace(run, zero_step_n=step_n)) for step_n in (1.0, 0.0))
    assert line_of(moved, "zero of force") > 0.002
    assert moved.headline.half_width > still.headline.half_width
    assert len(judge(run).notes) == len(still.notes) + 1


def test_a_stated_drift_counts_where_the_zero_was_not_looked_at_again() -> None:
    """It may be all that was read: then there is no stiffness."""
    run = press(World())

    def stated(drift_n_per_s: float, step_n: float | None = None) -> Judgement:
        return judge(told(run, zero_drift_n_per_s=drift_n_per_s, zero_step_n=step_n))

    assert not any(line.source == "zero of force" for line in stated(0.0).headline.lines)
    assert 0.0 < line_of(stated(0.01), "zero of force") < line_of(stated(0.1), "zero of force")
    assert stated(0.01).headline.verdict == "identified"
    assert stated(1e4).headline.verdict == "not identifiable"
    assert stated(3.0, 0.0).headline == stated(0.0).headline


def test_a_loading_that_may_have_ended_for_what_it_showed_counts_as_two_looks() -> None:
    run = press(World())
    once, twice = (judge(replace(run, looked=looked)) for looked in (False, True))
    for kind in ("chord", "secant_from_touch", "tangent"):
        (low, high), (lower, higher) = (
            found.quantities[kind].interval_n_per_m for found in (once, twice)
        )
        assert math.log(higher / lower) == pytest.approx(
            math.log(high / low) * 2.2414 / 1.95996, rel=0.04
        )


def test_what_gave_way_once_at_small_force_is_a_seat() -> None:
    """A seat of 7 µm within some 10 N: the chord does not feel it."""
    run = press(World())
    number, loading, unloading = run.tracks[1]
    lower = replace(loading, travel_m=loading.travel_m + 7e-6 * np.exp(-loading.force_n / 10.0))
    seated = judge(replace(run, tracks=[run.tracks[0], (number, lower, unloading)]))
    assert "seat" in shown(seated)
    assert not seated.elastic
    assert seated.headline.value_n_per_m == pytest.approx(judge(run).headline.value_n_per_m)
    sound, secant = (each.quantities["secant_from_touch"] for each in (judge(run), seated))
    [line] = [line for line in secant.lines if line.source == SEAT]
    seat = seated.inelastic.of("seat")
    assert seat is not None
    assert line.relative * secant.to_n / secant.value_n_per_m < seat.value_m / 1.7
    assert secant.half_width > 1.2 * sound.half_width


@pytest.mark.parametrize("loop", [0.0, 0.1, 0.25])
def test_the_work_lost_is_that_of_the_loop(loop: float) -> None:
    found = [judge(press(World(loop=loop), seed)).inelastic.loss for seed in range(3 * RUNS)]
    shares = np.array([each[0] for each in found if each is not None])
    assert shares.size == 3 * RUNS
    sigma = np.mean([each[1] for each in found if each is not None])
    assert np.mean(shares) == pytest.approx(loop, abs=3.0 * sigma / np.sqrt(shares.size))
    assert judge(press(World(cycles=1, unload=False), 0)).inelastic.loss is None


def test_n_rests_on_the_lengths_with_which_a_power_law_fits() -> None:
    errors = np.eye(30) * 1e-14
    force_n = np.linspace(10.0, 300.0, 30)
    data = Whitened(force_n, 1e-6 * force_n**0.6, errors)
    fit = fit_law(data, POWER)
    assert fit is not None
    run = press(World(), 0)
    reading = replace(read_of(run).reading, law_sets=[{POWER.name: fit}, {POWER.name: fit}, {}])
    n = exponent(reading)
    assert n is not None
    assert n.interval[0] < 1.0 / 0.6 < n.interval[1]
