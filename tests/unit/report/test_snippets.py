"""Contact parameters: what they say, and that a parser takes them."""

from __future__ import annotations

import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from pressed_runs import there_and_back

from stepload.contact.power_law import ContactLaw
from stepload.errors import BadInputError
from stepload.identification.conditions import Conditions, Sources
from stepload.identification.identify import Identification, identify
from stepload.identification.quantity import ResultVerdict, without_interval
from stepload.identification.samples import select
from stepload.report.snippets import IMPEDANCE, SIMULATORS, Spring, snippet, spring_of

LAW = ContactLaw(6.57e8, 1.5, "(7)")
SPRING = Spring("tangent", 150.0, 150.0, 6.0e6, (5.5e6, 6.5e6), 300.0,
                ResultVerdict.IDENTIFIED, ())  # fmt: skip


@pytest.fixture(scope="module")
def found() -> Identification:
    rng = np.random.default_rng(5)
    force = np.linspace(3.0, 300.0, 3000)
    deep = (force / LAW.k) ** (1 / LAW.n) + rng.normal(0.0, 2e-8, force.size)
    sources = Sources(None, force_noise_n=0.1, position_noise_m=2e-8, smooth_error_m=5e-8)
    given = Conditions(sources, 300.0, 0.0, 1e-8, rough_length_m=0.0)
    run = there_and_back(force, deep, given)
    return identify(select(deep, force), run)


def chord(law: ContactLaw, at_n: float) -> float:
    return 0.9 * at_n / (law.deformation(at_n) - law.deformation(0.1 * at_n))


@pytest.mark.parametrize(("kind", "of"), [("tangent", ContactLaw.tangent), ("chord", chord)])
@pytest.mark.parametrize("at_n", [60.0, 150.0, 290.0])
def test_stiffness_and_interval_are_those_of_the_law_at_that_force(found, kind, of, at_n):
    spring = spring_of(found, at_n=at_n, kind=kind)
    assert spring.stiffness_n_per_m == pytest.approx(of(LAW, at_n), rel=0.02)
    low, high = spring.interval_n_per_m
    assert low < of(LAW, at_n) < high
    assert high / low < 1.4
    assert spring.from_n == (at_n if kind == "tangent" else pytest.approx(0.1 * at_n))


def test_nothing_is_said_beyond_the_data(found):
    for at_n in (found.peak_force_n * 1.001, 0.0, -5.0, math.nan):
        with pytest.raises(BadInputError, match="operating force"):
            spring_of(found, at_n=at_n)
    assert spring_of(found).at_n == pytest.approx(0.5 * found.peak_force_n)


def test_what_is_not_identified_warns_in_every_language(found):
    doubted = replace(found, run=replace(found.run, doubts=("too -- wide -->", "two\nlines")))
    spring = spring_of(doubted)
    for name in SIMULATORS:
        text = snippet(spring, name)
        assert "WARNING: the result is MARGINAL" in text
        ElementTree.fromstring(text)
        assert "WARNING" not in snippet(spring_of(found, kind="chord"), name)


def test_no_interval_and_a_force_near_zero_warn(found):
    unknown = replace(found.judgement, headline=without_interval(found.headline))
    spring = spring_of(replace(found, judgement=unknown), kind="chord")
    assert spring.interval_n_per_m is None
    assert "no interval" in spring.warnings[0]
    assert "the zero decides" in spring_of(found, at_n=20.0, kind="chord").warnings[-1]
    assert not spring_of(found, at_n=150.0, kind="chord").warnings


def numbers(text: str, attribute: str) -> list[float]:
    pair = ElementTree.fromstring(text).find("contact/pair")
    return [float(number) for number in pair.get(attribute).split()]


@pytest.mark.parametrize("mass", [0.2, 1.0, 5.0])
def test_mujoco_obeys_the_spring_that_was_asked_for(mass):
    # (A + R) f = a_ref − a_0, A = 1/m, R = (1 − d)/d A, a_ref = −b v − k r,
    # k = stiffness d(r)/dwidth², b = damping/dwidth: MuJoCo, Modeling, solver parameters.
    text = snippet(SPRING, "mujoco", mass_kg=mass)
    stiffness, damping = (-number for number in numbers(text, "solref"))
    d0, dwidth = numbers(text, "solimp")[:2]
    assert d0 == dwidth == IMPEDANCE
    k, b = stiffness * d0 / dwidth**2, damping / dwidth
    inverse = 1.0 / mass
    whole = inverse + (1.0 - d0) / d0 * inverse

    def force(r, v, a_0):
        return (-b * v - k * r - a_0) / whole

    # At rest under 150 N the acceleration is 0: f = −m a_0 at the depth 150/S.
    assert force(-150.0 / 6.0e6, 0.0, -150.0 / mass) == pytest.approx(150.0, rel=1e-5)
    # Free motion: m a = f with a = a_0 + f/m; the inertia is 1 % more.
    r, v = -2e-5, -0.01
    acceleration = force(r, v, 0.0) / mass
    more = mass * d0 / (1.0 - d0)
    assert (mass + more) * acceleration == pytest.approx(-6.0e6 * r, rel=1e-5)


def test_drake_combines_two_of_them_to_the_contact():
    root = ElementTree.fromstring(snippet(SPRING, "drake"))
    drake = "{http://drake.mit.edu}"
    assert root.tag == f"{drake}proximity_properties"
    one = float(root.find(f"{drake}point_contact_stiffness").text)
    assert one * one / (one + one) == pytest.approx(6.0e6, rel=1e-5)
    assert root.find(f"{drake}hunt_crossley_dissipation") is None
