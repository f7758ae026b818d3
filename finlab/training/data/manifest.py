"""The manifest of a data set on disk: what it was made of, which shards are done, and their checksums."""

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from finlab.errors import DataError

FILE_NAME = "manifest.json"
FORMAT = "finlab-forward-data"
VERSION = 1
_HASH_BLOCK = 1 << 20


@dataclass(frozen=True)
class Recipe:
    """Everything the content of a data set depends on: same recipe, same bytes."""

    seed: int
    """Seed of layouts and commands."""

    n_layouts: int
    """How many random layouts."""

    commands_per_layout: int
    """How many random commands on each."""

    layouts_per_shard: int
    """How many layouts one shard holds; the last may hold fewer."""

    n_fins: tuple[int, int]
    """Least and most fins; arrays are padded to the most."""

    box_m: tuple[float, float, float]
    """Largest |x|, |y|, |z| of a fin [m]."""

    varied_limits: float
    """Share of layouts with limits of their own."""

    fin_model: dict[str, Any]
    """Fin model as in a layout file, with all its parameters."""

    limits: dict[str, Any]
    """Nominal limits as in a layout file, and the ranges the varied ones are drawn from."""

    @property
    def n_samples(self) -> int:
        """How many samples the whole set has."""
        return self.n_layouts * self.commands_per_layout

    @property
    def n_shards(self) -> int:
        """How many shards the whole set has."""
        return -(-self.n_layouts // self.layouts_per_shard)

    def shard_layouts(self, shard: int) -> range:
        """Returns the numbers of the layouts in a shard."""
        first = shard * self.layouts_per_shard
        return range(first, min(first + self.layouts_per_shard, self.n_layouts))


def write_manifest(folder: Path, recipe: Recipe, checksums: dict[str, str]) -> None:
    """Writes the manifest, whole or not at all.

    Args:
        folder: of the data set.
        recipe: what it is made of.
        checksums: file name to SHA-256 of every finished file.
    """
    done = _shards_done(checksums)
    content = {
        "format": FORMAT,
        "version": VERSION,
        "complete": done == recipe.n_shards,
        "shards_done": done,
        "samples": recipe.n_samples,
        "recipe": asdict(recipe),
        "sha256": dict(sorted(checksums.items())),
    }
    temporary = folder / (FILE_NAME + ".part")
    temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    os.replace(temporary, folder / FILE_NAME)


def read_manifest(folder: Path) -> tuple[Recipe, dict[str, str]]:
    """Returns recipe and checksums of the data set in `folder`.

    Raises:
        DataError: there is no manifest, or it is not one this version reads.
    """
    path = folder / FILE_NAME
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DataError(
            f"{folder}: has no {FILE_NAME}, expected a folder made by `finlab data generate`"
        ) from None
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {error}") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise DataError(f"{path}: is not a manifest of {FORMAT}")
    if content.get("version") != VERSION:
        raise DataError(f"{path}: this finlab reads version {VERSION}, got {content.get('version')!r:.40}")
    try:
        values = dict(content["recipe"])
        values["n_fins"], values["box_m"] = tuple(values["n_fins"]), tuple(values["box_m"])
        return Recipe(**values), {str(name): str(digest) for name, digest in content["sha256"].items()}
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise DataError(f"{path}: does not describe a data set ({error}); generate it again") from None


def require_complete(folder: Path, recipe: Recipe, checksums: dict[str, str]) -> None:
    """Raises a DataError unless every shard is done."""
    done = _shards_done(checksums)
    if done < recipe.n_shards:
        raise DataError(
            f"{folder}: {done} of {recipe.n_shards} shards are done; "
            "run the same `finlab data generate` to finish"
        )


def sha256_of(path: Path) -> str:
    """Returns the SHA-256 of a file, in hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_HASH_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _shards_done(checksums: dict[str, str]) -> int:
    return sum(name.startswith("wrench-") for name in checksums)
