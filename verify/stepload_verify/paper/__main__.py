"""`python -m stepload_verify.paper`: print the paper's numbers beside ours into docs/paper.md."""

from __future__ import annotations

import argparse
from pathlib import Path

from stepload_verify.paper.document import generate


def main() -> None:
    """Write the document and say what differs."""
    parser = argparse.ArgumentParser(
        prog="python -m stepload_verify.paper", description=main.__doc__
    )
    parser.add_argument("--out", type=Path, default=Path("docs/paper.md"))
    out: Path = parser.parse_args().out
    for row in generate(out):
        print(f"differs: {row.quantity}: {row.printed} printed, {row.computed:.4g} computed")
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
