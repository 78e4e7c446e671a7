"""The examples in the docstrings of theory and estimators give what they say."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize(
    "module",
    [
        "stepload.contact.power_law",
        "stepload.contact.elastic",
        "stepload.identification.ls",
        "stepload.identification.recursive",
        "stepload.identification.inverse_law",
    ],
)
def test_examples(module: str) -> None:
    found = doctest.testmod(importlib.import_module(module))
    assert found.attempted > 0
    assert found.failed == 0
