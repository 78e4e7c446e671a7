"""Patterns are data: what could be slow or ambiguous is refused before a port is opened."""

import pytest

from stepload.errors import BadInputError
from stepload_drivers.line.codec import line_pattern, number_of
from stepload_drivers.line.force import DEFAULT_PATTERN

SOUND = {
    DEFAULT_PATTERN: "-1.25",
    r"ST,GS,\s*(?P<force>[+-]?\d+\.\d+)kg": "ST,GS,  12.5kg",
    r"(?P<force>[+-]?\d{4}\.\d{2}) (?:kg|lb)": "+0012.50 kg",
    r"(?:\w++,)*+(?P<force>\d+\.\d)[)*+\]]{1,2}": "a,b,2.5)+",
    r"\(\*\+(?P<force>\d+)": "(*+25",
    r"\(\?x(?P<force>\d+)[(?x]": "(?x25x",
    r"ST,\s*(?P<force>[+-]?\d+(?:\.\d+)?)(?:kg|lb)": "ST, 2.5kg",
    r"\d?" * 15 + r"(?P<force>\d{2})": "25",
}
SLOW = [
    r"(\d+)+(?P<force>\d)",
    r"(?:\s*\d*)*(?P<force>\d)",
    r"(?:a|aa)+(?P<force>\d)",
    r"(?:a?){40}(?P<force>\d)",
    r"(?:(?:a+)b){2,}(?P<force>\d)",
    r"(?:a+)+?(?P<force>\d)",
    r".*.*.*(?P<force>\d+)",
    r"\d{0,64}\d{0,64}\d{0,64}(?P<force>\d+)",
    r"\d?" * 24 + r"(?P<force>\d)x",
    r"\d{,1}" * 24 + r"(?P<force>\d)x",
    r"(?:\d|\d\d)" * 24 + r"(?P<force>\d)x",
    r"\d?\d??\d?\d?\d+\d+(?P<force>\d+)x",
]
HIDDEN = {
    r"(?x) (?P<force> (\d + ) + ) kg": "'(?x'",
    r"(?ix)(?P<force>(\d+) +)kg": "'(?i'",
    r"(?x:(?P<force>(\d+) +))kg": "'(?x'",
    r"(?P<force>((?:\d+)(?#+)+))kg": "'(?#'",
    r"(x)?(?(1)a+)+(?P<force>\d)": "'(?('",
    r"(?P<force>\d)(?P=force)+": "'(?P'",
}


@pytest.mark.parametrize("pattern", SOUND)
def test_usual_patterns_are_taken(pattern):
    number = number_of(line_pattern(pattern, "force"), "force", 2.0)
    assert abs(number(SOUND[pattern])) in (2.5, 5.0, 25.0, 50.0)


@pytest.mark.parametrize("pattern", SLOW)
def test_patterns_that_may_take_for_ever_are_refused(pattern):
    with pytest.raises(BadInputError, match="hold the run up") as caught:
        line_pattern(pattern, "force")
    assert "possessive" in caught.value.hint


@pytest.mark.parametrize("pattern", HIDDEN)
def test_what_would_hide_a_repetition_is_refused(pattern):
    with pytest.raises(BadInputError) as caught:
        line_pattern(pattern, "force")
    assert f"holds {HIDDEN[pattern]}: no flags" in caught.value.message
    assert "both cases" in caught.value.hint
