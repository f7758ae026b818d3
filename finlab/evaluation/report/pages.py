"""A document as one self-contained HTML page, and as Markdown with its pictures in files beside it."""

import html
import re
from collections.abc import Sequence
from importlib.resources import files
from itertools import pairwise

from markdown_it import MarkdownIt

from finlab.evaluation.report.document import Block, Document, Figure, Table

MARKDOWN = MarkdownIt("commonmark", {"html": False})


def to_html(document: Document) -> str:
    """The page: no script, no font and no picture from elsewhere."""
    style = files("finlab.evaluation.report").joinpath("page.css").read_text("utf-8")
    title = html.escape(document.title)
    sections = [b.removeprefix("## ") for b in document.blocks if isinstance(b, str) and b.startswith("## ")]
    links = "".join(f'<a href="#{_anchor(section)}">{html.escape(section)}</a>' for section in sections)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
{style}</style></head><body>
<header><h1>{title}</h1><p>{_inline(document.subtitle)}</p></header>
<nav>{links}</nav>
<main>{_html(document.blocks)}</main>
</body></html>
"""


def _html(blocks: Sequence[Block]) -> str:
    return "\n".join(map(_html_block, blocks))


def _html_block(block: Block) -> str:
    match block:
        case str():
            tokens = MARKDOWN.parse(block)
            for token, inside in pairwise(tokens):
                if token.type == "heading_open":
                    token.attrSet("id", _anchor(inside.content))
            rendered: str = MARKDOWN.renderer.render(tokens, MARKDOWN.options, {})
            return rendered
        case tuple(cards):
            parts = ("label", "value", "detail")
            texts = ["".join(_div(part, _inline(getattr(card, part))) for part in parts) for card in cards]
            return _div("cards", "".join(_div("card", text) for text in texts))
        case Table():
            return _div("table", _html_table(block))
        case Figure(caption=caption, svg=svg):
            # The picture without what only a file of its own needs.
            return f"<figure>{svg[svg.index('<svg') :]}<figcaption>{_inline(caption)}</figcaption></figure>"


def _html_table(table: Table) -> str:
    kinds = ["" if column.is_number else ' class="name"' for column in table.columns]
    columns = list(zip(table.columns, kinds, strict=True))
    head = "".join(f"<th{kind}>{_inline(column.heading)}</th>" for column, kind in columns)
    body = []
    for row in table.rows:
        body.append(f'<tr class="{row["_kind"]}">' if "_kind" in row else "<tr>")
        for column, kind in columns:
            big, small = table.cell(row, column)
            body.append(f"<td{kind}>{_inline(big)}{f'<small>{small}</small>' if small else ''}</td>")
        body.append("</tr>")
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>"


def _inline(text: str) -> str:
    rendered: str = MARKDOWN.renderInline(text)
    return rendered


def _div(kind: str, inside: str) -> str:
    return f'<div class="{kind}">{inside}</div>'


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def to_markdown(document: Document, pictures: str) -> str:
    """The text; `pictures` is the folder of the pictures as seen from its file."""
    return f"# {document.title}\n\n{document.subtitle}\n\n{_text_blocks(document.blocks, pictures)}\n"


def _text_blocks(blocks: Sequence[Block], pictures: str) -> str:
    return "\n\n".join(_text_block(block, pictures) for block in blocks)


def _text_block(block: Block, pictures: str) -> str:
    match block:
        case str():
            return block
        case tuple(cards):
            return "\n".join(f"- **{card.value}** {card.label}: {card.detail}" for card in cards)
        case Table():
            return _text_table(block)
        case Figure(name=name, caption=caption):
            return f"![{caption}]({pictures}/{name}.svg)\n\n*{caption}*"


def _text_table(table: Table) -> str:
    keys = [column.key for column in table.columns]
    named = keys.index("method") if "method" in keys else 0
    lines = [[column.heading for column in table.columns]]
    lines.append(["---:" if column.is_number else "---" for column in table.columns])
    for row in table.rows:
        cells = [table.in_one_cell(row, column) for column in table.columns]
        if row.get("_kind") == "ours":
            cells[named] = f"**{cells[named]}**"
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
