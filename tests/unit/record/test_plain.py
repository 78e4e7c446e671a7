"""JSON that every reader takes: no NaN, no numpy, nothing lost."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from stepload.record.plain import plain, to_json


class Colour(Enum):
    RED = "red"


@dataclass
class Part:
    value: float
    places: tuple[float, ...]


DATA = {
    "whole": 3,
    "yes": True,
    "none": None,
    "part": Part(math.inf, (1.0, math.nan)),
    "array": np.array([1.5, -np.inf]),
    "number": np.float64("nan"),
    "count": np.int64(7),
    "colour": Colour.RED,
    "set": {2.5},
    1: "key",
}


def test_programs_get_null_where_there_is_no_number() -> None:
    assert json.loads(json.dumps(plain(DATA), allow_nan=False)) == {
        "whole": 3, "yes": True, "none": None, "part": {"value": None, "places": [1.0, None]},
        "array": [1.5, None], "number": None, "count": 7, "colour": "red", "set": [2.5],
        "1": "key",
    }  # fmt: skip


def test_a_record_keeps_which_number_it_was_not() -> None:
    found = json.loads(to_json(DATA))
    assert found["part"] == {"value": "inf", "places": [1.0, "nan"]}
    assert found["array"] == [1.5, "-inf"]
    assert math.isnan(float(found["number"]))
    finite = {"a": np.float64(0.1), "b": [np.int64(2)], "c": "ü"}
    assert json.loads(to_json(finite)) == {"a": 0.1, "b": [2], "c": "ü"}
