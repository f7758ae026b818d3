"""How markup is made: what is put into it is escaped, unless it is markup itself."""

from collections.abc import Iterable

from markupsafe import Markup


def html(template: str, *values: object) -> str:
    """Markup, a text that is marked as such, with values in the place of `{}`, which may have formats, as
    `str.format` has them. Of several things in one, all stand one after the other."""
    return Markup(template).format(*map(_one, values))


def _one(value: object) -> object:
    return Markup().join(value) if isinstance(value, Iterable) and not isinstance(value, str) else value


def row(*cells: object) -> str:
    """A row of a table."""
    return html("<tr>{}</tr>", (html("<td>{}</td>", cell) for cell in cells))
