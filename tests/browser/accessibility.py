"""What axe-core, run in a page, finds that shuts people out."""

from __future__ import annotations

from typing import Any

from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page

GRAVE = ("moderate", "serious", "critical")
"""Impacts of axe-core's that nothing of ours may have; what is left is "minor"."""

RUN = """async ours => (await axe.run(
    {include: ours.map(selector => [selector])}, {resultTypes: ["violations"]},
)).violations"""


def find_grave(page: Page, *ours: str) -> list[str]:
    """Return what axe-core calls moderate or worse: the rule, the element, and what is wrong.

    Args:
        page: the page that is shown.
        ours: CSS selectors of the parts that we have made; each must be there. Without any, all.
    """
    for selector in ours:
        assert page.locator(selector).count(), f"nothing on the page is {selector}"
    page.evaluate(AXE_SCRIPT)
    violations: list[dict[str, Any]] = page.evaluate(RUN, list(ours or ("html",)))
    return [
        f"{violation['id']}: {node['html'][:200]}: {node['failureSummary']}"
        for violation in violations
        if violation["impact"] in GRAVE
        for node in violation["nodes"]
    ]
