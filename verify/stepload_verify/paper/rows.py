"""A printed number beside a computed one, and whether they agree."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One comparison.

    Attributes:
        quantity: what it is, with its unit.
        printed: the number as the paper prints it.
        computed: ours.
        limit: largest relative deviation that counts as agreement; None: all printed digits.
        why: where it differs, why.
    """

    quantity: str
    printed: str
    computed: float
    limit: float | None = None
    why: str = ""

    @property
    def deviation(self) -> float:
        """Relative deviation of computed from printed."""
        return self.computed / float(self.printed) - 1.0

    @property
    def agrees(self) -> bool:
        """Whether the deviation is within the limit."""
        if self.limit is None:
            return abs(self.computed - float(self.printed)) <= half_digit(self.printed) * 1.000001
        return abs(self.deviation) <= self.limit


def half_digit(printed: str) -> float:
    """Half a unit of the last printed digit: 0.5e-2 for "1.64", 0.5e6 for "6.57e8"."""
    mantissa, _, exponent = printed.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(0.5 * 10.0 ** (int(exponent or 0) - decimals))


def table(rows: list[Row]) -> list[str]:
    """The rows as a Markdown table."""
    lines = [
        "| quantity | printed | computed | deviation | limit | |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        limit = "all digits" if row.limit is None else f"{100 * row.limit:.3g} %"
        verdict = "agrees" if row.agrees else "**differs**"
        note = f"{verdict}; {row.why}" if row.why else verdict
        lines.append(
            f"| {row.quantity} | {row.printed} | {number(row.computed)} "
            f"| {100 * row.deviation:+.2f} % | {limit} | {note} |"
        )
    return lines


def number(value: float) -> str:
    """Four significant digits, exponents as the paper writes them: 6.573e8, 1.640, 727.0."""
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:#.4g}".rstrip(".")
    mantissa, exponent = f"{value:.3e}".split("e")
    return f"{mantissa}e{int(exponent)}"
