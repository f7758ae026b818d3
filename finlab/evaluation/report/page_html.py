"""A document as one self-contained HTML page: no script, no font and no picture from elsewhere."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from importlib.resources import files

from finlab.evaluation.report.document import (
    Block,
    Bullets,
    Cards,
    Document,
    Figure,
    Fold,
    Heading,
    Table,
    Text,
)


def to_html(document: Document) -> str:
    """The page."""
    style = files("finlab.evaluation.report").joinpath("page.css").read_text("utf-8")
    title = html.escape(document.title)
    sections = [block for block in document.blocks if isinstance(block, Heading) and block.level == 2]
    links = "".join(
        f'<a href="#{_anchor(section.text)}">{html.escape(section.text)}</a>' for section in sections
    )
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{title}</title>",
            f"<style>\n{style}</style></head><body>",
            f"<header><h1>{title}</h1><p>{_inline(document.subtitle)}</p></header>",
            f"<nav>{links}</nav>",
            f"<main>{_blocks(document.blocks)}</main>",
            "</body></html>",
            "",
        ]
    )


def _blocks(blocks: Sequence[Block]) -> str:
    return "\n".join(map(_block, blocks))


def _block(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f'<h{level} id="{_anchor(text)}">{_inline(text)}</h{level}>'
        case Text(text, small):
            return f'<p class="small">{_inline(text)}</p>' if small else f"<p>{_inline(text)}</p>"
        case Bullets(items):
            return _list(items)
        case Cards(cards):
            inside = "".join(
                f'<div class="card"><div class="label">{_inline(card.label)}</div>'
                f'<div class="value">{_inline(card.value)}</div>'
                f'<div class="detail">{_inline(card.detail)}</div></div>'
                for card in cards
            )
            return f'<div class="cards">{inside}</div>'
        case Table():
            return _table(block)
        case Figure(_, svg, caption):
            return f"<figure>{_bare(svg)}<figcaption>{_inline(caption)}</figcaption></figure>"
        case Fold(title, inside):
            return f"<details><summary>{_inline(title)}</summary>{_blocks(inside)}</details>"


def _list(items: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{_inline(item)}</li>' for item in items)}</ul>"


def _table(table: Table) -> str:
    names = {column.key: ' class="name"' for column in table.columns if column.format == "text"}
    head = "".join(f"<th{names.get(c.key, '')}>{_inline(c.title)}</th>" for c in table.columns)
    lines = []
    for row in table.rows:
        cells = []
        for column in table.columns:
            big, small = table.cell(row, column)
            below = f"<small>{small}</small>" if small else ""
            cells.append(f"<td{names.get(column.key, '')}>{_inline(big)}{below}</td>")
        kind = f' class="{row["_kind"]}"' if "_kind" in row else ""
        lines.append(f"<tr{kind}>{''.join(cells)}</tr>")
    body = "".join(lines)
    whole = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<div class="table"><table>{whole}</table></div>'


def _inline(text: str) -> str:
    """Escaped text with `code`, **bold** and [links](address)."""
    escaped = html.escape(text, quote=False)
    escaped = re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped)
    escaped = re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", escaped)
    return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', escaped)


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _bare(svg: str) -> str:
    """The picture without what only a file of its own needs."""
    return svg[svg.index("<svg") :]
