"""Sentences hold names that may come from a stranger."""

import pytest

from finlab.errors import DataError, FinlabError, LayoutError, printable


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("plain ö 10 °", "plain ö 10 °"),
        ("a\x1b[2Jb", "a\\x1b[2Jb"),
        ("left\u202eright", "left\\u202eright"),
        ("two\nlines", "two\nlines"),
    ],
)
def test_what_a_terminal_would_obey_is_escaped(name: str, shown: str) -> None:
    assert printable(name) == shown == printable(shown)
    assert str(FinlabError(name)) == str(DataError.in_file(name, "")) == shown
    error = LayoutError("is wrong", name).with_prefix("body", "a.yaml")
    assert str(error) == f"a.yaml: body.{shown}: is wrong" and error.key == f"body.{name}"
