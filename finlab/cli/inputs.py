"""What a user may name at the command line: a layout file, a bundle or a shipped layout."""

from __future__ import annotations

from typing import TYPE_CHECKING

from finlab.errors import CommandError

if TYPE_CHECKING:
    from finlab.layout import Layout


def open_robot(text: str, failed: tuple[str, ...] = ()) -> tuple[Layout, tuple[str, ...]]:
    """The layout in a file, or the shipped one of that name, and the names of all actuators that do not work:
    those that a bundle marks as failed and those named now, each once.

    Raises:
        LayoutError: neither a readable file nor a shipped layout.
    """
    from finlab.assets import shipped_layouts
    from finlab.files.worker import in_worker
    from finlab.layout.load import layout_and_failed

    shipped = text in shipped_layouts()
    layout, lost = layout_and_failed(text) if shipped else in_worker(layout_and_failed, text)
    return layout, tuple(dict.fromkeys([*lost, *failed]))


def check_positive(**counts: int | None) -> None:
    """Refuse numbers below one, each under the name of its option."""
    for name, value in counts.items():
        if value is not None and value < 1:
            raise CommandError(f"{name.replace('_', '-')}: expected a number of at least 1, got {value}")
