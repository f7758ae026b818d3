"""What axe-core, the usual judge of accessible pages, finds on a page of the app."""

from importlib.resources import files
from typing import Any

AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
"""axe-core itself, as its wrapper for Python ships it."""
RUN = "rules => axe.run(document, { resultTypes: ['violations'], ...(rules && { runOnly: rules }) })"
NAMED_MS = 300
"""Until what has just come to the page has got its names."""
GRAVE = ("moderate", "serious", "critical")
"""Impacts that are mended before anything lands."""


def findings(page: Any, rules: list[str] | None = None) -> list[str]:
    """What it finds that is grave on what is seen now, one line for each kind; by some rules, or by all."""
    tab = page.page
    page.rest(NAMED_MS)
    if not tab.evaluate("() => typeof axe === 'object'"):
        tab.evaluate(AXE)
    found = []
    for violation in tab.evaluate(RUN, rules)["violations"]:
        if violation["impact"] in GRAVE:
            nodes = violation["nodes"]
            first = nodes[0]["html"][:160].replace("\n", " ")
            found.append(f"{violation['id']}, {len(nodes)} times: {violation['help']}, as in {first}")
    return found
