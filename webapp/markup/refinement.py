"""Refinement of the samples of a network, in words: what became of them.

The drawer of candidates (`panels/modes_tab.py`) shows them beside the plot.
"""

import numpy as np
from markupsafe import Markup

from finlab.arrays import Array
from finlab.axes import AXES, UNITS
from finlab.display import listed
from finlab.research.mdn.method import TRACE_STEPS
from webapp.markup.words import error_digits, html
from webapp.tasks.solver import ALTERNATIVE_ERROR, Modes

AT_LIMIT = 0.999
"""Share of the range of an amplitude or frequency from which a fin is at its limit."""


def step_words(modes: Modes, step: int | None) -> str:
    """What a step of the refinement has made of the samples.

    Args:
        modes: the modes of an answer, with the refinement that led to them.
        step: after how many steps; None for all.

    Returns:
        Markup: what the step does, and the error that half of the samples have less of. Only
        samples that give the wrench are called exact.
    """
    step_shown = modes.steps if step is None else step
    errors = modes.refinement[step_shown].err_norm
    if step_shown == 0:
        words = "samples of the network"
    elif step_shown <= TRACE_STEPS.descent:
        words = "descent in forces"
    else:
        n_samples = len(errors)
        n_exact = int(np.count_nonzero(errors <= ALTERNATIVE_ERROR))
        words = "made exact"
        if n_exact < n_samples:
            words = f"{n_exact or 'none'} of {n_samples} made exact"
    median = error_digits(float(np.median(errors)))
    return html("{} <span class='dim'>· median error</span> {}", words, median)


def vain_sentence(modes: Modes) -> str:
    """Why the plot has rings that no line leads to.

    Args:
        modes: the modes of an answer, with the refinement of the samples.

    Returns:
        Markup: which wrench no sample was refined to, by how much the nearest one misses it, and
        how many of them have a fin at its limit. Nothing where a sample gives the wrench.
    """
    best = modes.answer
    if best is None or not modes.is_in_vain:
        return Markup()
    end = modes.refinement[-1]
    n_samples = len(end.err_norm)
    nearest = error_digits(float(np.min(end.err_norm)))
    words = f"{wrench_words(best.target)}: none of {n_samples} samples was refined to it."
    n_limited = _n_at_limit(end.command, best.layout.lower, best.layout.upper)
    if n_limited:
        share = "each" if n_limited == n_samples else f"{n_limited} of them"
        words += f" In {share} a fin came to its limit; the nearest misses {nearest}."
    else:
        words += f" The nearest misses {nearest}."
    return html("<div class='fl'><div class='missing said vain'>{}</div></div>", words)


def _n_at_limit(command: Array, lower: Array, upper: Array) -> int:
    """Of how many commands (K, n, 3) a fin has its amplitude or frequency at the upper limit;
    limits are (n, 3)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        used = (command - lower) / (upper - lower)
        is_limited = used[..., :2] >= AT_LIMIT  # false for a lost fin, whose command is NaN
    return int(np.count_nonzero(is_limited.any(axis=(1, 2))))


def wrench_words(wrench: Array) -> str:
    """The components (6,) of a wrench that are not zero; those that are free, NaN, are left
    out."""
    words = []
    for axis, unit, component in zip(AXES, UNITS, wrench.tolist(), strict=True):
        if component and np.isfinite(component):
            words.append(f"{axis} {component:.3g} {unit}".replace("-", "−"))
    return listed(words)
