"""Line charts as small SVG files that are equal from run to run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from stepload_verify.paper.step_load import FloatArray

_COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#d68910", "#555555")
_WIDTH, _HEIGHT = 640.0, 400.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 76.0, 16.0, 36.0, 52.0


@dataclass(frozen=True, slots=True)
class Line:
    """One curve; `dots` draws its points instead, `dashed` marks a limit; no label, no legend."""

    label: str
    x: FloatArray
    y: FloatArray
    dots: bool = False
    dashed: bool = False


def chart(
    title: str, x_label: str, y_label: str, lines: Sequence[Line], *, log_log: bool = False
) -> str:
    """The chart as SVG text; axes from the data, logarithmic in both on `log_log`."""
    every_x = np.concatenate([line.x for line in lines])
    every_y = np.concatenate([line.y for line in lines])
    across = _Axis.of(every_x, _LEFT, _WIDTH - _RIGHT, log=log_log)
    up = _Axis.of(every_y, _HEIGHT - _BOTTOM, _TOP, log=log_log)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="#fff"/>',
        f'<text x="{_LEFT:g}" y="20" font-size="14">{escape(title)}</text>',
    ]
    bottom, left, right = _HEIGHT - _BOTTOM, _LEFT, _WIDTH - _RIGHT
    for value in across.ticks():
        at = across.at(value)
        parts.append(
            f'<path d="M{at:.1f} {_TOP:g}V{bottom:g}" stroke="#ddd"/><text x="{at:.1f}" '
            f'y="{bottom + 16:g}" text-anchor="middle">{_tick(value)}</text>'
        )
    for value in up.ticks():
        at = up.at(value)
        parts.append(
            f'<path d="M{left:g} {at:.1f}H{right:g}" stroke="#ddd"/><text x="{left - 6:g}" '
            f'y="{at + 4:.1f}" text-anchor="end">{_tick(value)}</text>'
        )
    middle = 0.5 * (_TOP + bottom)
    parts += [
        f'<text x="{0.5 * (left + right):g}" y="{_HEIGHT - 14:g}" text-anchor="middle">'
        f"{escape(x_label)}</text>",
        f'<text x="18" y="{middle:g}" text-anchor="middle" '
        f'transform="rotate(-90 18 {middle:g})">{escape(y_label)}</text>',
    ]
    for i, line in enumerate(lines):
        colour = _COLOURS[i % len(_COLOURS)]
        places = [
            (across.at(float(x)), up.at(float(y))) for x, y in zip(line.x, line.y, strict=True)
        ]
        key_y = _TOP + 14 + 16 * i
        if line.dots:
            dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in places)
            parts.append(
                f'<path d="{dots}" stroke="{colour}" stroke-width="{3 if len(places) > 9 else 7}" '
                'stroke-linecap="round"/>'
            )
        else:
            dash = ' stroke-dasharray="6 4"' if line.dashed else ""
            course = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
            parts.append(
                f'<path d="M{course}" fill="none" stroke="{colour}" stroke-width="1.5"{dash}/>'
            )
        if line.label:
            parts.append(
                f'<path d="M{left + 10:g} {key_y - 4:g}h18" stroke="{colour}" stroke-width="3"/>'
                f'<text x="{left + 34:g}" y="{key_y:g}" stroke="#fff" stroke-width="3" '
                f'paint-order="stroke">{escape(line.label)}</text>'
            )
    return "\n".join([*parts, "</svg>", ""])


@dataclass(frozen=True, slots=True)
class _Axis:
    low: float
    high: float
    start: float
    end: float
    log: bool

    @classmethod
    def of(cls, values: FloatArray, start: float, end: float, *, log: bool) -> _Axis:
        low, high = float(values.min()), float(values.max())
        if log:
            return cls(math.floor(math.log10(low)), math.ceil(math.log10(high)), start, end, True)
        step = _step(high - low)
        return cls(step * math.floor(low / step), step * math.ceil(high / step), start, end, False)

    def at(self, value: float) -> float:
        place = math.log10(value) if self.log else value
        return self.start + (self.end - self.start) * (place - self.low) / (self.high - self.low)

    def ticks(self) -> list[float]:
        if self.log:
            return [10.0**e for e in range(int(self.low), int(self.high) + 1)]
        step = _step(self.high - self.low)
        count = round((self.high - self.low) / step)
        return [self.low + i * step for i in range(count + 1)]


def _step(span: float) -> float:
    rough = span / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough * 0.999999)


def _tick(value: float) -> str:
    return f"{value + 0.0:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0 else f"{value:.0e}"
