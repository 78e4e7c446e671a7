"""What the README and the docs show works, and what they link to exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def plans_in(page: Path) -> list[str]:
    blocks = re.findall(r"^```yaml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
    return [block for block in blocks if block.startswith("stepload: 1")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_plans_shown_are_plans(page: Path, tmp_path: Path) -> None:
    for text in plans_in(page):
        plan = tmp_path / "plan.yaml"
        plan.write_text(text.replace("payloads/", f"{ROOT}/procedures/payloads/"))
        assert preflight_of(load_plan(plan)).verdict in ("go", "warn")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_readme_shows_a_plan() -> None:
    assert plans_in(ROOT / "README.md")
