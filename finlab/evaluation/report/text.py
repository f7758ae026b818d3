"""Blocks as plain text, for the command line: the words and tables of the page, without its pictures."""

import textwrap
from collections.abc import Sequence

from finlab.evaluation.report.document import Block, Figure, Table

WIDTH = 110


def to_text(*blocks: Block) -> str:
    """Headings without their marks, paragraphs in lines, tables with aligned columns."""
    return "\n\n".join(text for text in map(_block, blocks) if text)


def _block(block: Block) -> str:
    match block:
        case str():
            return "\n".join(
                textwrap.fill(line.strip("#* ").replace("`", ""), WIDTH) for line in block.splitlines()
            )
        case Table():
            head = [column.heading for column in block.columns]
            cells = [[block.cell(row, column) for column in block.columns] for row in block.rows]
            lines = [[cell.replace("`", "") for cell in line] for line in cells]
            return aligned(head, lines, [not column.is_number for column in block.columns])
        case Figure():
            return ""


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))
