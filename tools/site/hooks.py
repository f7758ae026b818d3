"""What mkdocs does beside its own work: generated pages, blocks that run, formulas as MathML,
checks.

Of tests, `tests/examples/test_site.py` holds the numbers of formulas and the navigation; all else
`make docs` alone runs.
"""

import html
import json
import re
import sys
from importlib.resources import files as package_files
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import tostring

import jupytext
from latex2mathml.converter import convert_to_element
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
import blocks
import reference
from demo import demo_files

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
NUMBER = re.compile(r"\s*\\tag\{(\d+)\}")
NUMBERED = re.compile(r"^\$\$(?:(?!\$\$).)*\\tag\{(\d+)\}\$\$$", re.MULTILINE | re.DOTALL)
PYTHON = "reference/python/"
LETTERS_OF_LONG_PAGES = 60
"""Letters of a section by which the search finds pages that are long or of numbers."""
_shown: dict[str, Any] = {}


def on_files(files: Files, config: Any) -> Files:
    """Run all blocks and examples, and add the pages that are made of code."""
    examples = sorted((blocks.ROOT / "examples").glob("[0-9]*.py"))
    pages = {f"docs/{file.src_uri}": file.content_string for file in files.documentation_pages()}
    notebooks = {
        f"examples/{path.name}": jupytext.read(path, fmt="py:percent") for path in examples
    }
    notebooks |= {name: blocks.notebook_of(page) for name, page in pages.items() if "```" in page}
    _shown.update(blocks.run_all(notebooks))
    made: dict[str, str | bytes] = {**reference.python_pages(), **reference.command_pages()}
    made |= {**reference.format_pages(), **reference.robots_page(), **gallery()}
    font = package_files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf"
    made["math.ttf"] = font.read_bytes()
    made |= {f"demo/{name}": content for name, content in demo_files().items()}
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    _in_navigation(config.nav, list(made))
    return files


def gallery() -> dict[str, str | bytes]:
    """A page for each example, with what it shows, and one of all."""
    made: dict[str, str | bytes] = {}
    index = "# Gallery\n\nThe files of `examples`, run when this site was built.\n\n"
    index += '<div class="grid cards gallery" markdown>\n\n'
    for name, notebook in _shown.items():
        if not name.startswith("examples/"):
            continue
        stem = Path(name).stem
        page = ""
        for cell in notebook.cells:
            words = cell.cell_type == "markdown"
            page += (
                "\n"
                + (
                    cell.source
                    if words
                    else f"```python\n{cell.source}\n```\n{blocks.output(cell)}"
                )
                + "\n"
            )
        title = re.findall(r'^(?:# |""")(.*)', page, re.MULTILINE)[0].rstrip(".")
        page = page if page.startswith("\n# ") else f"# {title}\n{page}"
        made[f"gallery/{stem}.md"] = f"{page}\nThis is `{name}`, which runs as it is.\n"
        seen = ""
        if data := blocks.picture(notebook):
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
            pages = [name for name in made if name.startswith(inside) and name.endswith(".md")]
            nav[i] = {title: _by_package(pages) if inside == PYTHON else pages}


def _by_package(pages: list[str]) -> list[Any]:
    """The pages of Python names, those of each package in a section of its own, under their short
    names."""
    entries: list[Any] = [f"{PYTHON}index.md"]
    sections: dict[str, list[Any]] = {}
    paths = {Path(page).stem: page for page in pages if page not in entries}
    packages = {path.rpartition(".")[0] for path in paths} & set(paths)
    for path, page in paths.items():
        if path in packages:
            sections[path] = [{"All names": page}]
            entries.append({path: sections[path]})
        else:
            package, _, name = path.rpartition(".")
            sections[package].append({name: page})
    return entries


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Show what the blocks of a page gave, and give each numbered equation an anchor: #eq-8 of
    `\\tag{8}`."""
    source = f"docs/{page.file.src_uri}"
    markdown = NUMBERED.sub(r'<a id="eq-\1" class="equation"></a>\n\n\g<0>', markdown)
    return blocks.with_output(markdown, _shown[source]) if source in _shown else markdown


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Formulas become MathML, which browsers draw themselves; their numbers stand at the right."""

    def draw(match: re.Match[str]) -> str:
        shown = "inline" if match.group(1) == "span" else "block"
        source = html.unescape(match.group(2))
        formula = convert_to_element(NUMBER.sub("", source), display=shown)
        for part in formula.iter("msub"):
            if shown == "block" and part[0].text in ("min", "max"):
                part.tag = "munder"
        drawn = tostring(formula, encoding="unicode").replace("&amp;#", "&#")
        number = NUMBER.search(source)
        if number is None:
            return drawn
        return f'<div class="equation">{drawn}<span>({number.group(1)})</span></div>'

    return FORMULA.sub(draw, content)


def on_post_build(config: Any) -> None:
    """Refuse pages that load something from elsewhere, and a first page of more than a megabyte."""
    site = Path(config.site_dir)
    index = site / "search" / "search_index.json"
    found = json.loads(index.read_text())
    # Every page loads them: words alone, of the reference, reports and the table of numbers the
    # first ones.
    for each in found["docs"]:
        words = " ".join(re.sub(r"<[^<>]*>", " ", each["text"]).split())
        is_long = each["location"].startswith(("reference/", "report/", "theory/numbers/"))
        each["text"] = words[:LETTERS_OF_LONG_PAGES] if is_long else words
    index.write_text(json.dumps(found, separators=(",", ":")))
    first = (site / "index.html").read_text()
    # What lies below the first screen is loaded when a reader comes to it, or presses on it.
    at_once = re.sub(r'<a href="[^"]+\.webp">|<img[^>]*loading="lazy"[^>]*>', "", first)
    loaded = {
        name for name in re.findall(r'(?:src|href)="([^"#?]+)"', at_once) if (site / name).is_file()
    }
    loaded |= {"index.html", "search/search_index.json", *re.findall(r'"search": "([^"]+)"', first)}
    if (weight := sum((site / name).stat().st_size for name in loaded)) > 1_000_000:
        raise PluginError(
            f"the first page loads {weight} bytes, more than a megabyte: {sorted(loaded)}"
        )
    for page in site.rglob("*.html"):
        if found := re.search(
            r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text()
        ):
            raise PluginError(f"{page}: loads from elsewhere: {found.group()}")
