"""What mkdocs does beside its own work: generated pages, blocks that run, formulas as MathML, checks."""

import html
import re
import sys
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
import blocks
import reference

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
_shown: dict[str, blocks.Shown] = {}


def on_files(files: Files, config: Any) -> Files:
    """Run all blocks and examples, and add the pages that are made of code."""
    examples = {f"examples/{path.name}": path.read_text() for path in sorted((blocks.ROOT / "examples").glob("[0-9]*.py"))}
    pages = {file.src_uri: blocks.blocks_of(file.content_string) for file in files.documentation_pages()}
    cells = {name: blocks.cells_of(text)[1] for name, text in examples.items()}
    _shown.update(blocks.run_all(cells | {f"docs/{name}": page for name, page in pages.items()}))
    made: dict[str, str | bytes] = {**reference.python_pages(), **reference.command_pages()}
    made |= {**reference.format_pages(), **reference.robots_page(), **gallery(examples)}
    font = package_files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf"
    made["math.ttf"] = font.read_bytes()
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    _in_navigation(config.nav, list(made))
    return files


def gallery(examples: dict[str, str]) -> dict[str, str | bytes]:
    """A page for each example, with what it shows, and one of all."""
    made: dict[str, str | bytes] = {}
    index = "# Gallery\n\nThe files of `examples`, run when this site was built.\n\n<div class=\"grid cards gallery\" markdown>\n\n"
    for name, text in examples.items():
        stem, (about, cells), shown = Path(name).stem, blocks.cells_of(text), _shown[name]
        title = about.strip().split("\n")[0].rstrip(".") or stem
        code = "".join(f"\n```python\n{cell['text'].strip()}\n```\n{blocks.output(out)}" for cell, out in zip(cells, shown, strict=True))
        made[f"gallery/{stem}.md"] = f"# {title}\n\n`{name}`\n{code}"
        seen = ""
        if data := blocks.picture(shown):
            made[f"gallery/{stem}.png"] = data
            seen = f"![]({stem}.png)\n\n    "
        index += f"-   {seen}[{title}]({stem}.md)\n\n"
    return {"gallery/index.md": index + "</div>\n", **made}


def _in_navigation(nav: Any, made: list[str]) -> None:
    """Put generated pages where the navigation names their folder."""
    for i, entry in enumerate(nav):
        ((title, inside),) = entry.items() if isinstance(entry, dict) else (("", entry),)
        if isinstance(inside, list):
            _in_navigation(inside, made)
        elif inside.endswith("/"):
            deep = [name for name in made if name.startswith(inside) and name.endswith(".md")]
            nav[i] = {title: [name for name in deep if not re.search(r"finlab\.(\w+\.)?[A-Z]\w*\.md$", name)]}


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Show what the blocks of a page gave."""
    source = f"docs/{page.file.src_uri}"
    return blocks.with_output(markdown, _shown[source]) if _shown.get(source) else markdown


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Formulas become MathML, which browsers draw themselves."""

    def draw(match: re.Match[str]) -> str:
        return convert(html.unescape(match.group(2)), display="inline" if match.group(1) == "span" else "block")

    return FORMULA.sub(draw, content)


def on_post_build(config: Any) -> None:
    """Refuse pages that load something from elsewhere, and a first page of more than a megabyte."""
    site = Path(config.site_dir)
    for page in site.rglob("*.html"):
        if found := re.search(r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text()):
            raise PluginError(f"{page}: loads from elsewhere: {found.group()}")
