"""A swim as an animated picture: the robot from above, how deep it is, how far off its path, and its watts.

Needs no display; `film.py` draws the pictures.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.errors import DataError
from finlab.evaluation.plots.compared_runs import RUN_COLOURS
from finlab.evaluation.plots.film import Film, Swum
from finlab.evaluation.plots.style import LOOK

if TYPE_CHECKING:
    from PIL.Image import Image

SUFFIXES = (".gif", ".webp")
"""Kinds of files."""


def save_animation(
    robots: Sequence[Swum],
    path: str | Path,
    *,
    seconds: float = 15.0,
    rate: float = 10.0,
    progress: Callable[[float], object] = lambda share: None,
) -> Path:
    """Writes an animated picture of one swim, or of up to three side by side; returns its path.

    Args:
        robots: who swims; the first one's path and water are drawn.
        path: file to write, .gif or .webp.
        seconds: how long it plays [s]; the swim is as much faster.
        rate: pictures per second.
        progress: told after each picture which share is done.

    Raises:
        DataError: another kind of file, no robot or more than three, or logs with fewer than two rows.
    """
    path = Path(path)
    path.write_bytes(animation(robots, path.suffix.lower(), seconds=seconds, rate=rate, progress=progress))
    return path


def animation(
    robots: Sequence[Swum],
    suffix: str = ".gif",
    *,
    seconds: float = 15.0,
    rate: float = 10.0,
    progress: Callable[[float], object] = lambda share: None,
) -> bytes:
    """The content of the file that `save_animation` writes."""
    import matplotlib

    if suffix not in SUFFIXES:
        raise DataError(
            f"animation: expected a file that ends in {' or '.join(SUFFIXES)}, got {suffix!r:.20}"
        )
    if not 1 <= len(robots) <= len(RUN_COLOURS):
        raise DataError(f"animation: expected one to {len(RUN_COLOURS)} robots, got {len(robots)}")
    if short := [robot.name for robot in robots if robot.log.n_ticks < 2]:
        raise DataError(f"animation: {short[0]} has not swum yet; let it swim first")
    times = np.linspace(0.0, max(r.log.time[-1] for r in robots), max(2, round(seconds * rate)))
    with matplotlib.rc_context(LOOK):
        film = Film(robots)
        frames = []
        for k, time in enumerate(times.tolist()):
            frames.append(film.frame(time))
            progress((k + 1) / len(times))
    return _encoded(frames, suffix, round(1000 / rate))


def _encoded(frames: list[Image], suffix: str, each_ms: int) -> bytes:
    """All pictures as one file that plays for ever."""
    from PIL import Image as images

    content = io.BytesIO()
    options: dict[str, Any] = {"save_all": True, "duration": each_ms, "loop": 0}
    if suffix == ".gif":  # one palette for all, so that nothing flickers and pictures differ little
        palette = frames[-1].quantize(128, images.Quantize.MEDIANCUT)
        frames = [frame.quantize(palette=palette, dither=images.Dither.NONE) for frame in frames]
        frames[0].save(content, "GIF", append_images=frames[1:], optimize=False, **options)
    else:
        frames[0].save(content, "WEBP", append_images=frames[1:], quality=80, method=2, **options)
    return content.getvalue()
