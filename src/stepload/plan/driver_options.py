"""Checks a driver's options against what the driver declares; touches no device."""

from __future__ import annotations

import json
from collections.abc import Sequence as SequenceABC
from pathlib import Path

from stepload.declaration.sections import UNKNOWN, keys
from stepload.errors import BadInputError
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import expected, read_section
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Broken, Mapping, Place, parse_tree
from stepload.rig.plugins import load_driver


def read_options(
    group: str,
    name: str,
    at: Place,
    given: object,
    problems: list[Problem],
    device: str = "",
    missing: list[Problem] | None = None,
) -> dict[str, object]:
    """Options of driver `name` of `group` in SI, the driver's defaults filled in.

    `at` is where the driver is named; `given` the `options` mapping of the plan, if it has one,
    `device` what errors call the device, such as "rig.arm"; `missing` takes the problems of
    required options that are not given, None: `problems` does.
    """
    missing = problems if missing is None else missing
    try:
        declared = load_driver(group, name).OPTIONS
    except BadInputError as error:
        problems.append(at.problem(error.message, error.hint))
        return {}
    node = given if isinstance(given, Mapping) else Mapping(at)
    place = at if node.place.source.path is None else node.place
    called = f"{device}: driver {name!r}" if device else f"driver {name!r}"
    told = {each.name: each for each in keys(declared)}
    absent = [key for key, each in told.items() if each.required and key not in node.entries]
    whole = Mapping(
        node.place,
        {**node.entries, **{key: Broken(place) for key in absent}},
        {**node.keys, **dict.fromkeys(absent, place)},
    )
    section = read_section(declared, whole, at, problems)
    for key in absent:
        message = f"{called} needs the option {key!r}"
        hint = f"{device}.options.{key}: " if device else ""
        missing.append(place.problem(message, hint + expected(told[key])))
    values = {key: getattr(section, each.field) for key, each in told.items()}
    return {key: each for key, each in values.items() if each is not None and each is not UNKNOWN}


def options_from_words(group: str, name: str, words: SequenceABC[str]) -> dict[str, object]:
    """Options in SI from KEY=VALUE words, or from the one YAML file that is named instead.

    Raises:
        BadInputError: no such driver, or a word that is neither.
        PlanError: every option that the driver does not take as given.
    """
    texts = {key.name for key in keys(load_driver(group, name).OPTIONS) if key.is_text}
    if len(words) == 1 and "=" not in words[0]:
        return _checked(group, name, read_source(Path(words[0])))
    lines = []
    for word in words:
        key, equals, value = word.partition("=")
        if not (key and equals):
            raise BadInputError(
                f"--options {word}", hint='KEY=VALUE, such as rate="1 kHz", or one YAML file'
            )
        value = json.dumps(value, ensure_ascii=False) if key in texts else value
        lines.append(f"{key}: {value}")
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
