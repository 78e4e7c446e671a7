"""A report page carries hostile text as text and asks for nothing from outside."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from stepload.report.model import Document, Figure, Table, Verdict
from stepload.report.page import render

SVG = "<svg xmlns='http://www.w3.org/2000/svg'/>"


def a_page(text: str) -> Document:
    return Document(
        title=text, subtitle=text, verdict=Verdict("good", text, text), ended=text, reasons=[text],
        tables=[Table(text, [text], [[text]], [text])],
        figures=[Figure("figure", text, text, text, lambda: SVG)], texts=[(text, text)],
    )  # fmt: skip


@given(st.text(min_size=1, max_size=60))
def test_text_from_outside_never_becomes_markup(text: str) -> None:
    plain = re.findall(r"<[a-z!/]+", render(a_page("x")))
    assert re.findall(r"<[a-z!/]+", render(a_page(text))) == plain


def test_attack_in_every_field_is_escaped() -> None:
    page = render(a_page('"><script>alert(1)</script><img src=//x onerror=y>'))
    assert "<script" not in page
    assert "<img src=//x" not in page


def test_no_script_no_network() -> None:
    page = render(a_page("x"))
    assert "default-src 'none'" in page
    assert not re.search(r"""(?:src|href)=["'](?!data:|#)""", page)
