"""What `make docs` does with blocks and names, apart from building the whole site."""

from pathlib import Path
from typing import Any

import pytest

import finlab

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip("mkdocs")


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "tools" / "site"))
    import blocks

    monkeypatch.setattr(blocks, "KEPT", tmp_path)
    return blocks


def test_blocks_share_names_and_files_and_show_what_they_print(site: Any) -> None:
    page = '```text title="a.txt"\nhello\n```\n```python\nx = open("a.txt").read()\n```\n'
    page += "```sh\nwc -l a.txt\n```\n"
    page += '```sh title="Not run here"\nexit 1\n```\n```python\nx.strip()\n```\n'
    ran = site.run("docs/page.md", site.notebook_of(page), "")
    shown = site.with_output(page, ran)
    assert shown.count(".output") == 2 and "\n1 a.txt\n" in shown and "\n'hello'\n" in shown


@pytest.mark.parametrize("page", ["```sh\nfinlab nothing\n```\n", "```python\n1 / 0\n```\n", "```\nx\n```\n"])
def test_a_block_that_fails_or_has_no_language_ends_the_build(site: Any, page: str) -> None:
    with pytest.raises(site.PluginError, match="exit status 2|ZeroDivisionError|has no language"):
        site.run("docs/page.md", site.notebook_of(page), "")


def test_every_name_of_the_package_has_a_page(site: Any) -> None:
    import reference

    pages = reference.python_pages()
    assert {f"reference/python/finlab.{name}.md" for name in finlab._HOME} <= set(pages)
    assert "reference/python/finlab.sim.ClosedLoop.md" in pages
