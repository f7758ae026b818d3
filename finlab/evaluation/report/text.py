"""Blocks as plain text, for the command line: the words and tables of the page."""

import textwrap

from finlab.evaluation.report.document import Block
from finlab.text_table import aligned

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
