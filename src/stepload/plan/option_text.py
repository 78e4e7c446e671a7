"""Driver options from a command line or a file of their own, checked as those of a plan."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from stepload.errors import BadInputError
from stepload.plan.driver_options import read_options
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Mapping, Place, parse_tree
from stepload.rig.plugins import load_driver


def options_from_words(group: str, name: str, words: Sequence[str]) -> dict[str, object]:
    """Options in SI from KEY=VALUE words, or from the one YAML file that is named instead.

    Raises:
        BadInputError: no such driver, or a word that is neither.
        PlanError: every option that the driver does not take as given.
    """
    declared = load_driver(group, name).OPTIONS
    if len(words) == 1 and "=" not in words[0]:
        return _checked(group, name, read_source(Path(words[0])))
    lines = []
    for word in words:
        key, equals, value = word.partition("=")
        if not (key and equals):
            raise BadInputError(
                f"--options {word}", hint='KEY=VALUE, such as rate="1 kHz", or one YAML file'
            )
        is_text = key in declared and declared[key].kind == "text"
        lines.append(f"{key}: {json.dumps(value, ensure_ascii=False) if is_text else value}")
    text = "\n".join(lines)
    return _checked(group, name, Source("--options", None, text, text.encode()))


def _checked(group: str, name: str, source: Source) -> dict[str, object]:
    start = Place(source, 1, 1)
    problems: list[Problem] = []
    root: object = Mapping(start)
    if source.text.strip():
        root, problems = parse_tree(source)
        if not isinstance(root, Mapping):
            problems.append(start.problem("options are a mapping", "one `key: value` a line"))
    options = read_options(group, name, start, root, problems)
    if problems:
        raise PlanError(tuple(problems))
    return options
