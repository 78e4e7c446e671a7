"""The glossary: words and symbols of plans, pages and reports, read from their table."""

from __future__ import annotations

import tomllib
from importlib import resources

from stepload.explain.model import Explanation

WORD = "word"
"""Group name of words, which are no codes."""


def _words() -> list[tuple[list[str], str, str]]:
    """Names, meaning and page of each, in the order of the page."""
    text = (resources.files("stepload.explain") / "words.toml").read_text(encoding="utf-8")
    return [(each["names"], each["means"], each["page"]) for each in tomllib.loads(text)["word"]]


def words_called(name: str) -> tuple[Explanation, ...]:
    """The words or symbols with this name, `_` for spaces, in large or small letters."""
    return tuple(
        Explanation(WORD, ", ".join(names), means, "", page)
        for names, means, page in _words()
        if name.casefold() in {each.replace(" ", "_").casefold() for each in names}
    )


def page() -> str:
    """The page of docs/ that holds the glossary, as Markdown."""
    lines = [
        "# Glossary",
        "",
        "`stepload explain WORD` prints what stands here.",
    ]
    for names, means, place in _words():
        lines += ["", f"**{', '.join(names)}**: {means} [More]({place})"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
