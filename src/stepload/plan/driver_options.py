"""Checks a driver's options against what the driver declares; touches no device."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence as SequenceABC
from pathlib import Path

from stepload.errors import BadInputError, printable
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import unknown_key
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence, parse_tree
from stepload.rig.options import Option
from stepload.rig.plugins import load_driver
from stepload.units import QuantityError, parse_quantity


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
    options = {
        key: option.default for key, option in declared.items() if option.default is not None
    }
    for key, value in node.entries.items():
        if key not in declared:
            problems.append(unknown_key(node.keys[key], key, list(declared)))
        elif not isinstance(value, Broken):
            _read_one(key, declared[key], value, options, problems)
    place = at if node.place.source.path is None else node.place
    called = f"{device}: driver {name!r}" if device else f"driver {name!r}"
    for key, option in declared.items():
        if option.required and key not in node.entries:
            message = f"{called} needs the option {key!r}"
            hint = f"{device}.options.{key}: " if device else ""
            missing.append(place.problem(message, f"{hint}{option.help}; {expected(option)}"))
    return options


def expected(option: Option) -> str:
    """What may be written for `option`."""
    if option.choices:
        return "one of " + ", ".join(option.choices)
    noun = {
        "text": "a text",
        "integer": "a whole number",
        "number": "a plain number",
        "boolean": "true or false",
        "quantity": f"a quantity in {option.unit}",
        "vector": "a list of three plain numbers",
    }[option.kind]
    low = f" from {option.low:g}" if option.low is not None else ""
    high = f" to {option.high:g}" if option.high is not None else ""
    return f"{noun}{low}{high}{' ' + option.unit if option.unit and low + high else ''}"


def _read_one(
    key: str, option: Option, node: Node, options: dict[str, object], problems: list[Problem]
) -> None:
    try:
        value = _value(option, node)
    except QuantityError as error:
        problems.append(node.place.problem(error.message, error.hint))
        return
    if value is None:
        shown = printable(str(node.value)) if isinstance(node, Scalar) else "this"
        problems.append(
            node.place.problem(f"{key}: {shown} is not {expected(option)}", option.help)
        )
        return
    options[key] = value


def _value(option: Option, node: Node) -> object:
    """The option in SI; None where it is not what the driver takes."""
    if option.kind == "vector":
        return _vector(node)
    value = node.value if isinstance(node, Scalar) else None
    match option.kind:
        case "quantity":
            return _within(option, parse_quantity(value, option.unit))
        case "boolean":
            return value if isinstance(value, bool) else None
        case "text":
            if not isinstance(value, str) or not value.isprintable() or len(value) > 400:
                return None
            return value if not option.choices or value in option.choices else None
        case "integer":
            number: float | None = (
                value if isinstance(value, int) and not isinstance(value, bool) else None
            )
        case "number":
            number = value if isinstance(value, (int, float)) and type(value) is not bool else None
    return None if number is None else _within(option, number)


def _within(option: Option, number: float) -> float | None:
    low = -math.inf if option.low is None else option.low
    high = math.inf if option.high is None else option.high
    return number if math.isfinite(number) and low <= number <= high else None


def _vector(node: Node) -> tuple[float, float, float] | None:
    items = (
        [n.value for n in node.items if isinstance(n, Scalar)] if isinstance(node, Sequence) else []
    )
    numbers = tuple(
        float(v) for v in items if isinstance(v, (int, float)) and not isinstance(v, bool)
    )
    if len(numbers) != 3 or len(items) != 3 or not all(map(math.isfinite, numbers)):
        return None
    return numbers


def options_from_words(group: str, name: str, words: SequenceABC[str]) -> dict[str, object]:
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
