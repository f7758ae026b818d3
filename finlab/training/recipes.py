"""Training recipes are found by name."""

from collections.abc import Mapping
from typing import TypeVar

from finlab.errors import DataError

Recipe = TypeVar("Recipe")


def get_recipe(recipes: Mapping[str, Recipe], name: str) -> Recipe:
    """A recipe by name; `DataError` lists the names that exist."""
    if name not in recipes:
        raise DataError(f"preset: expected one of {', '.join(recipes)}, got {name!r}")
    return recipes[name]
