"""A printed number next to a computed one, and whether they agree."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One comparison. There is no percentage that counts as agreement: the printed number, within
    half a unit of its last digit, has to meet what was computed.

    Attributes:
        quantity: what it is, with its unit.
        printed: the number as the paper prints it.
        computed: ours.
        span: (lowest, highest) that `computed` can be, where it is computed from rounded numbers;
            None: it is one number.
        why: where it differs, why.
    """

    quantity: str
    printed: str
    computed: float
    span: tuple[float, float] | None = None
    why: str = ""

    @property
    def deviation(self) -> float:
        """Relative deviation of computed from printed."""
        return self.computed / float(self.printed) - 1.0

    @property
    def agrees(self) -> bool:
        """Whether printed and computed can be the same number."""
        low, high = self.span or (self.computed, self.computed)
        return meets(self.printed, low, high)


def meets(printed: str, low: float, high: float) -> bool:
    """Whether a printed number, within half a unit of its last digit, meets [low, high]."""
    half = half_digit(printed) * 1.000001
    return low - half <= float(printed) <= high + half


def half_digit(printed: str) -> float:
    """Half a unit of the last printed digit: 0.5e-2 for "1.64", 0.5e6 for "6.57e8"."""
    mantissa, _, exponent = printed.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(0.5 * 10.0 ** (int(exponent or 0) - decimals))


def table(rows: list[Row]) -> list[str]:
    """The rows as a Markdown table; with a column of spans where there are any."""
    spans = any(row.span for row in rows)
    lines = [
        f"| quantity | printed | computed |{' can be |' if spans else ''} deviation | |",
        f"|---|---|---|{'---|' if spans else ''}---|---|",
    ]
    for row in rows:
        low, high = row.span or (row.computed, row.computed)
        span = f" {number(low)} to {number(high)} |" if spans else ""
        verdict = "agrees" if row.agrees else "**differs**"
        note = f"{verdict}; {row.why}" if row.why else verdict
        lines.append(
            f"| {row.quantity} | {row.printed} | {number(row.computed)} |{span} "
            f"{100 * row.deviation:+.2f} % | {note} |"
        )
    return lines


def number(value: float) -> str:
    """Four significant digits, exponents as the paper writes them: 6.573e8, 1.640, 727.0."""
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:#.4g}".rstrip(".")
    mantissa, exponent = f"{value:.3e}".split("e")
    return f"{mantissa}e{int(exponent)}"
