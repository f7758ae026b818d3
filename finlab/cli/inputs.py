"""What a user may name at the command line: a layout file, a bundle or a shipped layout."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from finlab.errors import CommandError

if TYPE_CHECKING:
    from finlab.layout import Layout


class OpenedRobot(NamedTuple):
    """A layout, and the fins of it that do not work."""

    layout: Layout
    """All fins."""
    failed: tuple[str, ...] = ()
    """Names of fins that a bundle marks as failed."""

    def with_failed(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Names of all failed fins: those of the file and those named now, each once."""
        return tuple(dict.fromkeys([*self.failed, *names]))


def open_robot(text: str) -> OpenedRobot:
    """The layout (and failed fins) in a file, or the shipped layout of that name.

    Raises:
        LayoutError: neither a readable file nor a shipped layout.
    """
    from finlab.layout.load import layout_and_failed

    return OpenedRobot(*layout_and_failed(text))


def check_positive(**counts: int | None) -> None:
    """Refuse numbers below one, each under the name of its option."""
    for name, value in counts.items():
        if value is not None and value < 1:
            raise CommandError(f"{name.replace('_', '-')}: expected a number of at least 1, got {value}")
