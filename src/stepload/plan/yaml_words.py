"""Explains in plain words why a text is no YAML: parsers speak of blocks and tokens."""

from __future__ import annotations

from typing import Any, NamedTuple


class Mistake(NamedTuple):
    """What is wrong, what to do, and the parser's mark of the place."""

    message: str
    hint: str
    mark: Any


_COLUMN = "keys of one section begin in the same column, those of a section inside it further right"
_BRACES = {"}": ("{", "mapping"), "]": ("[", "list")}


def mistake(problem: str, context: str, mark: Any, context_mark: Any) -> Mistake | None:
    """The mistake behind a parser's complaint; None where it is not known.

    Args:
        problem, context: what the parser says.
        mark, context_mark: where it noticed, and where what it was reading began.
    """
    if "mapping values are not allowed" in problem:
        return Mistake(
            "this key stands where none may stand",
            f"{_COLUMN}; or the line above lacks the space behind its colon; or a text with"
            " a colon in it needs quotes",
            mark,
        )
    if "found '<block mapping start>'" in problem or "<block end>" in problem:
        return Mistake("this line is indented otherwise than the keys above it", _COLUMN, mark)
    if "could not find expected ':'" in problem:
        return Mistake(
            "a key without its colon", "write `key: value`, with a space behind the colon",
            context_mark or mark,
        )  # fmt: skip
    if "expected ',' or" in problem:
        opening, noun = _BRACES["]" if "']'" in problem else "}"]
        return Mistake(
            f"a comma is missing before this, or the {opening} of its {noun} is never closed",
            f"the {opening} stands at line {context_mark.line + 1}, column"
            f" {context_mark.column + 1}" if context_mark else "",
            mark,
        )  # fmt: skip
    if "quoted scalar" in context:
        return Mistake(
            "a quote that is never closed", "put the same quote behind the text",
            context_mark or mark,
        )  # fmt: skip
    if "cannot start any token" in problem:
        return Mistake("no value begins with this letter", "put the whole value in quotes", mark)
    return None
