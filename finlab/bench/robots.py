"""The robots of the benchmark, set by set: shipped layouts, held-out splits, and sizes far from both."""

from dataclasses import replace

import numpy as np

from finlab.assets import PAPER_LAYOUTS
from finlab.evaluation.splits import make_split
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout, random_layout
from finlab.layout.random_fins import log_uniform

SHIPPED = ("asymmetric", "hexa", "mixed", "no_yaw", "octo", "pair", "penta", "restricted")
"""The other shipped ones; `ucat` has the fins of A."""
DRAWN = (
    "id",
    "ood",
    "ood-fins",
    "limits",
    "failure",
    "near-singular",
    "fins",
    "fins-mixed",
    "tables",
    "many-fins",
)
"""Held-out splits that robots are drawn from."""
BIG_BOX, TINY_BOX = (1.5, 0.8, 0.4), (0.025, 0.015, 0.008)
"""Largest |x|, |y|, |z| of a fin on a robot of 3 m, and of 5 cm [m]."""
DOMAIN = 0xBE9C
"""Leads the seed of what is drawn here."""


def robots(seed: int, per_split: int) -> list[tuple[str, Layout]]:
    """Sets with their layouts; failed fins have left theirs.

    Args:
        seed: of what is drawn; robot k of a set depends on the set, the seed and k alone.
        per_split: robots of each drawn set.
    """
    found = [("paper", _bare(name)) for name in PAPER_LAYOUTS]
    found += [("shipped", _bare(name)) for name in SHIPPED]
    for split in DRAWN:
        found += [(split, case.healthy) for case in make_split(split, per_split, 1, seed)]
    for place, (name, draw) in enumerate((("big", _big_fin), ("tiny", _tiny_fin))):
        for k in range(per_split):
            rng = np.random.default_rng((DOMAIN, seed, place, k))
            box = BIG_BOX if name == "big" else TINY_BOX
            layout = random_layout(rng, f"{name}-{seed}-{k}", n_fins=(3, 6), box=box)
            found.append((name, replace(layout, fins=tuple(draw(rng, fin) for fin in layout.fins))))
    return found


def _bare(name: str) -> Layout:
    """A shipped layout's fins; nothing here swims."""
    return replace(load_layout(name), body=None, description="")


def _model(rng: np.random.Generator, area: tuple[float, float], length: tuple[float, float]) -> FinModelSpec:
    """A plate of the law `drag`, or a fin of Lighthill's."""
    if rng.uniform() < 0.5:
        size = (("area", log_uniform(rng, *area)), ("lever", log_uniform(rng, *length) / 2))
        return FinModelSpec("drag", size)
    span = log_uniform(rng, *length)
    return FinModelSpec("lighthill", (("length", span), ("width", span / 2)))


def _big_fin(rng: np.random.Generator, fin: Fin) -> Fin:
    """Fins of 0.6 to 1 m that beat up to once a second: hundreds of newton."""
    limits = Limits((0.05, 0.6), (0.05, float(rng.uniform(0.6, 1.2))))
    return replace(fin, limits=limits, model=_model(rng, (0.15, 0.4), (0.6, 1.0)))


def _tiny_fin(rng: np.random.Generator, fin: Fin) -> Fin:
    """Fins of 1 to 2 cm that beat a few times a second: millinewton."""
    limits = Limits((0.05, 0.6), (0.1, float(rng.uniform(4.0, 6.0))))
    return replace(fin, limits=limits, model=_model(rng, (5e-5, 2e-4), (0.01, 0.02)))
