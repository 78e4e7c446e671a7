"""The glossary: words and symbols of plans, pages and reports, read from their table."""

from __future__ import annotations

import tomllib
from importlib import resources


def words() -> list[tuple[list[str], str, str]]:
    """Names, meaning and page of each, in the order of the page."""
    text = (resources.files("stepload.explain") / "words.toml").read_text(encoding="utf-8")
    return [(each["names"], each["means"], each["page"]) for each in tomllib.loads(text)["word"]]


def page() -> str:
    """The page of docs/ that holds the glossary, as Markdown."""
    lines = ["# Glossary", "", "`stepload explain WORD` prints what stands here."]
    for names, means, place in words():
        lines += ["", f"**{', '.join(names)}**: {means} [More]({place})"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
