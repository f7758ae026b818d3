"""Blocks as plain text, for the command line: the words and tables of the page."""

import textwrap
from collections.abc import Sequence

from finlab.evaluation.report.document import Block

WIDTH = 110


def to_text(*blocks: Block) -> str:
    """Headings without their marks, paragraphs in lines, tables with aligned columns."""
    return "\n\n".join(map(_block, blocks))


def _block(block: Block) -> str:
    if isinstance(block, str):
        lines = (line.strip("#* ").replace("`", "") for line in block.splitlines())
        return "\n".join(textwrap.fill(line, WIDTH) for line in lines)
    head = [column.heading for column in block.columns]
    cells = [[block.cell(row, column).replace("`", "") for column in block.columns] for row in block.rows]
    return aligned(head, cells, [not column.is_number for column in block.columns])


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))
