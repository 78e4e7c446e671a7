"""One self-contained HTML page from plain data: no script, no network, every text escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape


@dataclass(frozen=True, slots=True)
class Card:
    """One headline number."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Figure:
    """One picture; `alt` says in words what it shows."""

    name: str
    title: str
    caption: str
    alt: str
    svg: str


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text; `note` stands below."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Page:
    """A report from top to bottom; `mood` is "good", "doubt" or "bad"."""

    title: str
    subtitle: str
    mood: str
    verdict: str
    headline: str
    reasons: Sequence[str]
    stopped: str
    cards: Sequence[Card]
    figures: Sequence[Figure]
    tables: Sequence[Table]
    texts: Sequence[tuple[str, str]] = field(default=())


STYLE = """
:root{--ink:#1d2733;--soft:#5b6673;--line:#dfe4ea;--good:#2f7d4f;--doubt:#a8590f;--bad:#b3261e}
*{box-sizing:border-box}
body{margin:0;background:#f5f7f9;color:var(--ink);
font:15px/1.5 system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1000px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:22px;margin:0 0 2px}h2{font-size:17px;margin:34px 0 8px}
.sub{color:var(--soft);margin:0 0 18px}
.verdict{background:#fff;border:1px solid var(--line);border-left:8px solid var(--c);
border-radius:6px;padding:16px 20px}
.verdict b.word{color:var(--c);text-transform:uppercase;letter-spacing:.04em;font-size:14px}
.verdict p.head{font-size:21px;margin:4px 0 8px;line-height:1.35}
.verdict ul{margin:6px 0 0;padding-left:20px}
.good{--c:var(--good)}.doubt{--c:var(--doubt)}.bad{--c:var(--bad)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(190px,1fr));gap:10px;
margin:16px 0}
.card{background:#fff;border:1px solid var(--line);border-radius:6px;padding:10px 14px}
.card span{color:var(--soft);font-size:12.5px}.card strong{display:block;font-size:18px}
.card small{color:var(--soft)}
figure{background:#fff;border:1px solid var(--line);border-radius:6px;margin:14px 0;padding:14px}
figure img{width:100%;height:auto;display:block}
figcaption{color:var(--soft);font-size:13.5px;margin-top:6px}
figcaption b{color:var(--ink)}
.wide{overflow-x:auto}
table{border-collapse:collapse;background:#fff;border:1px solid var(--line);width:100%;
font-variant-numeric:tabular-nums}
th,td{padding:5px 10px;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
th{font-size:12.5px;color:var(--soft);font-weight:600}
.note{color:var(--soft);font-size:13.5px;margin:6px 0}
details{background:#fff;border:1px solid var(--line);border-radius:6px;padding:8px 14px;
margin:8px 0}
pre{overflow-x:auto;font-size:12.5px;line-height:1.4}
@media print{body{background:#fff}figure,table,.verdict{break-inside:avoid}}
"""


def _figure(figure: Figure) -> str:
    data = base64.b64encode(figure.svg.encode()).decode()
    return (
        f'<figure id="{escape(figure.name)}">'
        f'<img src="data:image/svg+xml;base64,{data}" alt="{escape(figure.alt)}">'
        f"<figcaption><b>{escape(figure.title)}.</b> {escape(figure.caption)}</figcaption></figure>"
    )


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return (
        f'<h2>{escape(table.title)}</h2><div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>{note}"
    )


def _parts(page: Page) -> Iterator[str]:
    yield f"<h1>{escape(page.title)}</h1><p class='sub'>{escape(page.subtitle)}</p>"
    yield f'<section class="verdict {escape(page.mood)}"><b class="word">{escape(page.verdict)}</b>'
    yield f'<p class="head">{escape(page.headline)}</p>'
    if page.stopped:
        yield f"<p>{escape(page.stopped)}</p>"
    if page.reasons:
        yield "<ul>" + "".join(f"<li>{escape(reason)}</li>" for reason in page.reasons) + "</ul>"
    yield "</section>"
    yield '<div class="cards">'
    for card in page.cards:
        yield (
            f'<div class="card"><span>{escape(card.label)}</span>'
            f"<strong>{escape(card.value)}</strong><small>{escape(card.note)}</small></div>"
        )
    yield "</div>"
    yield from map(_figure, page.figures)
    yield from map(_table, page.tables)
    for title, text in page.texts:
        yield (f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>")


def render(page: Page) -> str:
    """The page as one HTML text; it forbids itself scripts and any network request."""
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
        '<link rel="icon" href="data:,">'
        f"<title>{escape(page.title)} – {escape(page.verdict)}</title><style>{STYLE}</style></head>"
        f"<body><main>{''.join(_parts(page))}</main></body></html>\n"
    )
