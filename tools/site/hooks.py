"""What mkdocs does beside its own work: generated pages, blocks that run, formulas as MathML, checks."""

import html
import io
import json
import re
import sys
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import tostring

from latex2mathml.converter import convert_to_element
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from PIL import Image

sys.path.insert(0, str(Path(__file__).parent))
import blocks
import reference
from demo import demo_files

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
_shown: dict[str, blocks.Shown] = {}


def on_files(files: Files, config: Any) -> Files:
    """Run all blocks and examples, and add the pages that are made of code."""
    examples = {
        f"examples/{path.name}": path.read_text()
        for path in sorted((blocks.ROOT / "examples").glob("[0-9]*.py"))
    }
    pages = {file.src_uri: blocks.blocks_of(file.content_string) for file in files.documentation_pages()}
    cells = {name: blocks.cells_of(text)[1] for name, text in examples.items()}
    _shown.update(blocks.run_all(cells | {f"docs/{name}": page for name, page in pages.items()}))
    made: dict[str, str | bytes] = {**reference.python_pages(), **reference.command_pages()}
    made |= {**reference.format_pages(), **reference.robots_page(), **gallery(examples)}
    picture = io.BytesIO()
    Image.open(blocks.ROOT / "docs" / "app-jets.png").convert("RGB").save(picture, "webp", quality=82)
    made["app-jets.webp"] = picture.getvalue()  # a quarter of the bytes, for the first page
    font = package_files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf"
    made["math.ttf"] = font.read_bytes()
    made |= {f"demo/{name}": content for name, content in demo_files().items()}
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    _in_navigation(config.nav, list(made))
    return files


def gallery(examples: dict[str, str]) -> dict[str, str | bytes]:
    """A page for each example, with what it shows, and one of all."""
    made: dict[str, str | bytes] = {}
    index = "# Gallery\n\nThe files of `examples`, run when this site was built.\n\n"
    index += '<div class="grid cards gallery" markdown>\n\n'
    for name, text in examples.items():
        stem, (title, cells), shown = Path(name).stem, blocks.cells_of(text), _shown[name]
        page = "" if cells[0]["language"] == "markdown" else f"# {title}\n"
        for cell, out in zip(cells, shown, strict=True):
            code = f"```python\n{cell['text']}```\n{blocks.output(out)}"
            page += "\n" + (cell["text"] if cell["language"] == "markdown" else code)
        made[f"gallery/{stem}.md"] = f"{page}\nThis is `{name}`, which runs as it is.\n"
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
            nav[i] = {title: [name for name in made if name.startswith(inside) and name.endswith(".md")]}


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Show what the blocks of a page gave."""
    source = f"docs/{page.file.src_uri}"
    return blocks.with_output(markdown, _shown[source]) if _shown.get(source) else markdown


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Formulas become MathML, which browsers draw themselves."""

    def draw(match: re.Match[str]) -> str:
        shown = "inline" if match.group(1) == "span" else "block"
        formula = convert_to_element(html.unescape(match.group(2)), display=shown)
        for part in formula.iter("msub"):
            if shown == "block" and part[0].text in ("min", "max"):
                part.tag = "munder"
        return tostring(formula, encoding="unicode").replace("&amp;#", "&#")

    return FORMULA.sub(draw, content)


def on_post_build(config: Any) -> None:
    """Refuse pages that load something from elsewhere, and a first page of more than a megabyte."""
    site = Path(config.site_dir)
    index = site / "search" / "search_index.json"
    found = json.loads(index.read_text())
    for each in found["docs"]:  # every page loads them: words alone, and of the reference its first ones
        words = " ".join(re.sub(r"<[^<>]*>", " ", each["text"]).split())
        each["text"] = words[:300] if each["location"].startswith("reference/") else words
    index.write_text(json.dumps(found, separators=(",", ":")))
    first = (site / "index.html").read_text()
    loaded = {name for name in re.findall(r'(?:src|href)="([^"#?]+)"', first) if (site / name).is_file()}
    loaded |= {"index.html", "search/search_index.json", *re.findall(r'"search": "([^"]+)"', first)}
    if (weight := sum((site / name).stat().st_size for name in loaded)) > 1_000_000:
        raise PluginError(f"the first page loads {weight} bytes, more than a megabyte: {sorted(loaded)}")
    for page in site.rglob("*.html"):
        if found := re.search(
            r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text()
        ):
            raise PluginError(f"{page}: loads from elsewhere: {found.group()}")
