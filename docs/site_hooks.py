"""What the site needs beside the pages: links that leave docs/ are shown as the names they have."""

from __future__ import annotations

import re
from typing import Any

_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+([^)#]+)(?:#[^)]*)?\)")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Links to files of the repository outside of docs/ become their names: a site has none."""

    def told(match: re.Match[str]) -> str:
        if match[2].endswith(".md") and not match[2].startswith(("README", "CONTRIB")):
            return match[0]  # another page
        return f"{match[1]} (`{match[2]}` of the repository)"

    return _OUTSIDE.sub(told, markdown)
