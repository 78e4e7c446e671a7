"""Thinning keeps extremes; every figure is drawn, also from awkward data."""

from __future__ import annotations

import io
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from long_ones import long
from matplotlib.figure import Figure

from stepload.record.rows import Phase
from stepload.report import figures, run_figures


@given(st.integers(1, 20_000), st.integers(0, 2**32 - 1))
def test_thinning_keeps_first_last_and_extremes(size: int, seed: int) -> None:
    value = np.random.default_rng(seed).normal(size=size)
    index = figures.thin(500, value)
    assert len(index) <= 700
    assert np.all(np.diff(index) > 0)
    assert {0, size - 1} <= set(index.tolist())
    whole = value[: size // max(1, size) * size]
    if size <= 500:
        assert value[index].max() == whole.max()
    else:
        width = int(np.ceil(2.0 * size / 500))
        covered = value[: size // width * width]
        assert covered.max() in value[index]
        assert covered.min() in value[index]


def trace(count: int) -> Any:
    time_s = np.linspace(0.0, 10.0, count)
    phase = np.full(count, int(Phase.LOAD))
    phase[: count // 2] = int(Phase.TARE)
    return SimpleNamespace(
        time_s=time_s, force_n=30.0 * time_s, travel_m=1e-5 * time_s, phase=phase
    )


def curves(data: Any, laws: Mapping[str, run_figures.Law]) -> str:
    x, y, none = data.travel_m, data.force_n, np.empty(0)
    return run_figures.force_deformation(
        (x, y), (none, none), laws, "joint", (x, 0.9 * y, 1.1 * y), [("predicted", (x, y))]
    )


@pytest.mark.parametrize("count", [2, *long([10]), 10_000])
def test_every_figure_is_an_svg(count: int) -> None:
    data = trace(count)
    law: dict[str, run_figures.Law] = {"joint": lambda x: 3e6 * np.maximum(x, 0.0)}
    limits = {"F_c": 400.0, "F_lim": 350.0}
    for svg in (
        run_figures.over_time(data),
        run_figures.against_limit(data, data.force_n, data.time_s, limits),
        curves(data, law),
        figures.lines([(data.time_s, data.force_n, ".", {"label": "a"})], "x", "y", zero=True),
        figures.intervals([("a", 3e6, 2e6, 4e6)], "K_s"),
    ):
        assert svg.lstrip().startswith("<?xml")
        assert "</svg>" in svg


@pytest.mark.parametrize("rows", [1, *long([3])])
def test_a_figure_is_what_saving_would_make_of_it_by_itself(rows: int) -> None:
    made = []
    for draw in (figures.svg_of, saved):
        with figures.figure_of(4.0, rows) as (figure, axes):
            for number, each in enumerate(axes):
                each.plot([0.0, 1.0, 2.0], [1e-6, 5e3 * 10**number, 2.0], label="a line")
                each.set_ylabel(r"stiffness in N/$\mu$m")
                each.legend()
            axes[-1].set_xlabel("time in s")
            made.append(draw(figure))
    assert made[0] == made[1]


def saved(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()
