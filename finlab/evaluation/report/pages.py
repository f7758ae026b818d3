"""A document in Markdown with its pictures in files beside it, and as one self-contained HTML page."""

import html
import re
from importlib.resources import files

from markdown_it import MarkdownIt

from finlab.evaluation.report.document import Block, Document, Figure, Table

MARKDOWN = MarkdownIt("commonmark", {"html": False}).enable("table")


def to_html(document: Document) -> str:
    """The page: no script, no font and no picture from elsewhere."""
    style = files("finlab.evaluation.report").joinpath("page.css").read_text("utf-8")
    title, subtitle = html.escape(document.title), MARKDOWN.renderInline(document.subtitle)
    main = "\n".join(map(_html_block, document.blocks))
    links = "".join(f'<a href="#{_anchor(name)}">{name}</a>' for name in re.findall("<h2>(.*?)</h2>", main))
    main = re.sub("<h2>(.*?)</h2>", lambda found: f'<h2 id="{_anchor(found[1])}">{found[1]}</h2>', main)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
{style}</style></head><body>
<header><h1>{title}</h1><p>{subtitle}</p></header>
<nav>{links}</nav>
<main>{main}</main>
</body></html>
"""


def _html_block(block: Block) -> str:
    if isinstance(block, Figure):
        # The picture without what only a file of its own needs.
        picture, caption = block.svg[block.svg.index("<svg") :], MARKDOWN.renderInline(block.caption)
        return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"
    rendered: str = MARKDOWN.render(_text_table(block) if isinstance(block, Table) else block)
    return rendered


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def to_markdown(document: Document, pictures: str) -> str:
    """The text; `pictures` is the folder of the pictures as seen from its file."""
    blocks = [f"# {document.title}", document.subtitle, *document.blocks]
    return "\n\n".join(_text_block(block, pictures) for block in blocks) + "\n"


def _text_block(block: Block, pictures: str) -> str:
    match block:
        case Table():
            return _text_table(block)
        case Figure(name=name, caption=caption):
            return f"![{caption}]({pictures}/{name}.svg)\n\n*{caption}*"
        case str():
            return block


def _text_table(table: Table) -> str:
    keys = [column.key for column in table.columns]
    named = keys.index("method") if "method" in keys else 0
    lines = [[column.heading for column in table.columns]]
    lines.append(["---:" if column.is_number else "---" for column in table.columns])
    for row in table.rows:
        cells = [table.cell(row, column) for column in table.columns]
        if row.get("_kind") == "ours":
            cells[named] = f"**{cells[named]}**"
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
