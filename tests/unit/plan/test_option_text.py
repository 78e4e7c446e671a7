"""Driver options from words of a command line, or from the file that is named instead."""

from __future__ import annotations

import pytest

from stepload.errors import BadInputError
from stepload.plan.driver_options import options_from_words

GROUP, NAME = "stepload.arms", "ur"


def test_words_are_keys_with_values() -> None:
    words = ["host=127.0.0.1", "lookahead=50 ms", "approach=[0, 0, -1]"]
    options = options_from_words(GROUP, NAME, words)
    assert (options["host"], options["lookahead"]) == ("127.0.0.1", 0.05)
    assert options["approach"] == (0.0, 0.0, -1.0)
    assert options["upper_registers"] is False


@pytest.mark.parametrize("words", [["host=a", "lookahead"], ["host=a", "=3"], ["=3"]])
def test_a_word_that_is_neither_is_refused(words: list[str]) -> None:
    with pytest.raises(BadInputError, match=f"--options {words[-1]}") as caught:
        options_from_words(GROUP, NAME, words)
    assert "KEY=VALUE" in caught.value.hint
