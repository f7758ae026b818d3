"""What `make docs` does with blocks and names, apart from building the whole site."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import finlab

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip("mkdocs")


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """The module that runs the blocks of pages, with a cache of its own."""
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


@pytest.mark.parametrize(
    "page", ["```sh\nfinlab nothing\n```\n", "```python\n1 / 0\n```\n", "```\nx\n```\n"]
)
def test_a_block_that_fails_or_has_no_language_ends_the_build(site: Any, page: str) -> None:
    with pytest.raises(site.PluginError, match="exit status 2|ZeroDivisionError|has no language"):
        site.run("docs/page.md", site.notebook_of(page), "")


def test_every_name_of_the_package_has_a_page(site: Any) -> None:
    import reference

    pages = reference.python_pages()
    assert {f"reference/python/finlab.{name}.md" for name in finlab._MODULE_OF_NAME} <= set(pages)
    assert "reference/python/finlab.swim.simulation.ClosedLoop.md" in pages


def test_a_numbered_equation_has_an_anchor_and_its_number(site: Any) -> None:
    import hooks

    page = SimpleNamespace(file=SimpleNamespace(src_uri="theory/nowhere.md"))
    markdown = hooks.on_page_markdown("$$a = 1$$\n\n$$b = 2 \\tag{7}$$\n", page)
    assert markdown.count("<a id=") == 1 and markdown.index('<a id="eq-7"') > markdown.index(
        "a = 1"
    )
    content = hooks.on_page_content('<div class="arithmatex">\\[b = 2 \\tag{7}\\]</div>', page)
    assert content.endswith("<span>(7)</span></div>") and "tag" not in content


def test_names_of_a_package_stand_below_it_in_the_navigation(site: Any) -> None:
    import hooks

    names = (
        "index",
        "finlab",
        "finlab.Layout",
        "finlab.swim.simulation",
        "finlab.swim.simulation.ClosedLoop",
    )
    grouped = hooks._by_package([f"reference/python/{name}.md" for name in names])
    assert grouped[0] == "reference/python/index.md"
    sections = {title: pages for entry in grouped[1:] for title, pages in entry.items()}
    assert [list(page) for page in sections["finlab.swim.simulation"]] == [
        ["All names"],
        ["ClosedLoop"],
    ]
    assert sections["finlab"][1] == {"Layout": "reference/python/finlab.Layout.md"}
