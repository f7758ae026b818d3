"""Tables as plain text, for the command line and for those who print results."""

from collections.abc import Sequence


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))
