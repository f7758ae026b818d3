"""A document in Markdown, with its pictures in files beside it."""

from finlab.evaluation.report.document import Block, Document, Figure, Table


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
