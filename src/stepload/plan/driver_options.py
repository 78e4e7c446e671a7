"""Checks a driver's options against what the driver declares; touches no device."""

from __future__ import annotations

import json
from collections.abc import Sequence as SequenceABC
from pathlib import Path

from stepload.declaration.sections import keys
from stepload.errors import BadInputError
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import expected, in_words, validated
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Mapping, Node, Place, parse_tree
from stepload.rig.plugins import WORLDS, options_of


def read_options(
    group: str,
    name: str,
    at: Place,
    given: Node | None,
    problems: list[Problem],
    device: str = "",
    missing: list[Problem] | None = None,
) -> dict[str, object]:
    """Options of driver or world `name` of `group` in SI, the driver's defaults filled in.

    `at` is where the driver is named; `given` the `options` mapping of the plan, if it has one,
    `device` what errors call the device, such as "rig.arm"; `missing` takes the problems of
    required options that are not given, None: `problems` does.
    """
    try:
        declared = options_of(group, name)
    except BadInputError as error:
        problems.append(at.problem(error.message, error.hint))
        return {}
    node = given if isinstance(given, Mapping) else Mapping(at)
    place = at if node.place.source.path is None else node.place
    called = f"{'world' if group == WORLDS else 'driver'} {name!r}"
    called = f"{device}: {called}" if device else called
    told = {option.name: option for option in keys(declared)}
    section, errors = validated(declared, node, problems)
    absent = [str(each["loc"][-1]) for each in errors if each["type"] == "missing"]
    for each in errors:
        if each["type"] != "missing":
            problems += in_words(declared, node, at, each)
    for key in absent:
        where = "world_options" if group == WORLDS else "options"
        hint = f"{device}.{where}.{key}: " if device else ""
        problem = place.problem(f"{called} needs the option {key!r}", hint + expected(told[key]))
        (problems if missing is None else missing).append(problem)
    if len(absent) < len(errors):
        return {}
    read = {} if section else {
        key: validated(told[key].hint, inner, problems)[0] for key, inner in node.entries.items()
    }  # fmt: skip
    values = {
        key: getattr(section, option.field) if section else read.get(key, option.info.default)
        for key, option in told.items()
        if key not in absent
    }
    return {key: value for key, value in values.items() if value is not None}


def options_from_words(group: str, name: str, words: SequenceABC[str]) -> dict[str, object]:
    """Options in SI from KEY=VALUE words, or from the one YAML file that is named instead.

    Raises:
        BadInputError: no such driver, or a word that is neither.
        PlanError: every option that the driver does not take as given.
    """
    texts = {key.name for key in keys(options_of(group, name)) if key.is_text}
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
    root: Node = Mapping(start)
    if source.text.strip():
        root, problems = parse_tree(source)
        if not isinstance(root, Mapping):
            problems.append(start.problem("options are a mapping", "one `key: value` a line"))
    options = read_options(group, name, start, root, problems)
    if problems:
        raise PlanError(tuple(problems))
    return options
