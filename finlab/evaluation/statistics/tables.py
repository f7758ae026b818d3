"""Rows of tables."""

from typing import Any

Row = dict[str, Any]
