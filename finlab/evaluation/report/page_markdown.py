"""A document as Markdown; pictures are files beside it."""

from __future__ import annotations

from collections.abc import Sequence

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


def to_markdown(document: Document, pictures: str) -> str:
    """The text.

    Args:
        document: what to write.
        pictures: folder of the pictures, as seen from the file.
    """
    parts = [f"# {document.title}", document.subtitle, *_blocks(document.blocks, pictures)]
    return "\n\n".join(parts) + "\n"


def _blocks(blocks: Sequence[Block], pictures: str) -> list[str]:
    return [_block(block, pictures) for block in blocks]


def _block(block: Block, pictures: str) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {text}"
        case Text(text, small):
            return f"*{text}*" if small and "*" not in text else text
        case Bullets(items):
            return _list(items)
        case Cards(cards):
            return _list([f"**{card.value}** {card.label}: {card.detail}" for card in cards])
        case Table():
            return _table(block)
        case Figure(name, _, caption):
            return f"![{caption}]({pictures}/{name}.svg)\n\n*{caption}*"
        case Fold(title, inside):
            hidden = "\n\n".join(_blocks(inside, pictures))
            return f"<details><summary>{title}</summary>\n\n{hidden}\n\n</details>"


def _list(items: Sequence[str]) -> str:
    return "\n".join(f"- {item}" for item in items)


def _table(table: Table) -> str:
    lines = [[column.title for column in table.columns]]
    lines.append(["---" if column.format == "text" else "---:" for column in table.columns])
    for row in table.rows:
        cells = []
        for column in table.columns:
            big, small = table.cell(row, column)
            cells.append(f"{big} ({small})" if small else big)
        if row.get("_kind") == "ours":
            cells[0] = f"**{cells[0]}**"
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
