"""Driver options from words of a command line, or from the file that is named instead."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.errors import BadInputError
from stepload.plan.driver_options import options_from_words
from stepload.plan.problems import PlanError

GROUP, NAME = "stepload.arms", "ur"


def test_words_are_keys_with_values() -> None:
    words = ["host=127.0.0.1", "lookahead=50 ms", "approach=[0, 0, -1]"]
    options = options_from_words(GROUP, NAME, words)
    assert (options["host"], options["lookahead"]) == ("127.0.0.1", 0.05)
    assert options["approach"] == (0.0, 0.0, -1.0)
    assert options["upper_registers"] is False


def test_a_text_needs_no_quotes() -> None:
    assert options_from_words(GROUP, NAME, ["host=3"])["host"] == "3"
    assert options_from_words(GROUP, NAME, ["host=a: b # c"])["host"] == "a: b # c"


def test_one_word_without_an_equals_sign_is_a_file(tmp_path: Path) -> None:
    path = tmp_path / "options.yaml"
    path.write_text("host: ur.local\nlookahead: 50 ms\n")
    assert options_from_words(GROUP, NAME, [str(path)])["host"] == "ur.local"
    path.write_text("host: ur.local\nlookahead: 50\n")
    with pytest.raises(PlanError, match=r"options\.yaml:2:12: lookahead: 50 has no unit"):
        options_from_words(GROUP, NAME, [str(path)])
    path.write_text("- host\n")
    with pytest.raises(PlanError, match="options are a mapping"):
        options_from_words(GROUP, NAME, [str(path)])


@pytest.mark.parametrize("words", [["host=a", "lookahead"], ["host=a", "=3"], ["=3"]])
def test_a_word_that_is_neither_is_refused(words: list[str]) -> None:
    with pytest.raises(BadInputError, match=f"--options {words[-1]}") as caught:
        options_from_words(GROUP, NAME, words)
    assert "KEY=VALUE" in caught.value.hint


def test_every_option_that_is_wrong_is_reported() -> None:
    with pytest.raises(PlanError) as caught:
        options_from_words(GROUP, NAME, ["hots=a", "lookahead=1 mm"])
    said = [p.message for p in caught.value.problems]
    assert set(said[:2]) == {"unknown key 'hots'", "lookahead: '1 mm' is a length, not a time"}
    assert "needs the option 'host'" in said[2]


def test_no_words_are_the_defaults() -> None:
    assert options_from_words("stepload.arms", "sim", [])["command_delay"] == 0.002


def test_a_driver_that_is_not_there_is_refused() -> None:
    with pytest.raises(BadInputError, match="no driver named"):
        options_from_words("stepload.arms", "nosuch", [])
