"""Where the learned allocator leads and where it does not, in words computed from the tables.

Pure functions: rows in, sentences out. One method is ahead of another only where the intervals of a rerun do
not overlap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from finlab.evaluation.report.numbers import error, factor, share, three

Row = dict[str, Any]
OURS = "learned"
FAMILY = ("learned", "fast")
"""Ours, and its distilled form, which is not set against it."""


class Claims(NamedTuple):
    """Sentences for both sides of the summary."""

    leads: tuple[str, ...] = ()
    """Where the learned allocator is ahead."""
    trails: tuple[str, ...] = ()
    """Where it is not."""

    def __add__(self, other: tuple[Any, ...]) -> Claims:
        """Both, one after the other."""
        return Claims((*self.leads, *other[0]), (*self.trails, *other[1]))


def paper_claims(tables: Mapping[str, Sequence[Row]], printed: Mapping[str, float]) -> Claims:
    """The mean error beside the one that the paper prints, and beside our rebuild of its method.

    Args:
        tables: split -> rows of the wrench table.
        printed: split -> the paper's mean error.
    """
    leads, trails = [], []
    for split, theirs in printed.items():
        rows = tables.get(split, ())
        ours, rebuilt = _mean(rows, OURS), _mean(rows, "paper")
        if ours is None:
            continue
        beside = "" if rebuilt is None else f", and {error(rebuilt)} by our rebuild of its method"
        if ours < theirs:
            leads.append(
                f"Split `{split}`: mean error {error(ours)}, **{factor(theirs / ours)} times** below the "
                f"{theirs:.4f} that the paper prints{beside}."
            )
        else:
            trails.append(
                f"Split `{split}`: mean error {error(ours)} against {theirs:.4f} printed in the "
                f"paper{beside}."
            )
    return Claims(tuple(leads), tuple(trails))


def accuracy_claims(tables: Mapping[str, Sequence[Row]]) -> Claims:
    """Which methods are more exact, and which are less, on which splits."""
    ahead: dict[str, list[str]] = {}
    behind: dict[str, list[str]] = {}
    for split, rows in tables.items():
        ours = next((row for row in rows if row["method"] == OURS), None)
        for row in rows if ours is not None else ():
            if row["method"] in FAMILY:
                continue
            assert ours is not None
            if ours["err_norm_mean_interval"][1] < row["err_norm_mean_interval"][0]:
                behind.setdefault(row["method"], []).append(split)
            elif row["err_norm_mean_interval"][1] < ours["err_norm_mean_interval"][0]:
                ahead.setdefault(row["method"], []).append(split)
    leads = [f"More exact than {_grouped(behind, len(tables))}."] if behind else []
    trails = []
    if ahead:
        least = min(
            row["err_norm_mean"]
            for split, rows in tables.items()
            for row in rows
            if split in ahead.get(row["method"], ())
        )
        trails.append(
            f"Less exact than {_grouped(ahead, len(tables))}: mean errors down to {error(least)}. These know "
            "the fin law itself; it knows forward samples only."
        )
    return Claims(tuple(leads), tuple(trails))


def _grouped(found: Mapping[str, Sequence[str]], n_splits: int) -> str:
    """Methods with the splits that each stands for, those with the same splits together."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, splits in found.items():
        groups.setdefault(tuple(splits), []).append(name)
    ordered = sorted(groups.items(), key=lambda item: -len(item[0]))
    return "; ".join(
        f"{_names(names)} ({f'all {n_splits} splits' if len(splits) == n_splits else _names(splits)})"
        for splits, names in ordered
    )


def energy_claims(rows: Sequence[Row], reference: str) -> Claims:
    """The energy beside the reference's and beside that of the other methods; rows of `energy_rows`."""
    ours = {row["fins"]: row for row in rows if row["method"] == OURS and row["energy_ratio"] is not None}
    if "all" not in ours:
        return Claims()
    whole, leads, trails = ours["all"], [], []
    for row in rows:
        other = row["energy_ratio"]
        if row["fins"] != "all" or row["method"] in (*FAMILY, reference) or other is None:
            continue
        if whole["energy_ratio_high"] < row["energy_ratio_low"]:
            less = share(1 - whole["energy_ratio"] / other)
            leads.append(f"{less} less energy than `{row['method']}`")
        elif row["energy_ratio_high"] < whole["energy_ratio_low"]:
            trails.append(f"`{row['method']}` needs {share(1 - other / whole['energy_ratio'])} less energy.")
    sentences = [f"{'; '.join(leads)}."] if leads else []
    within = (
        f"Energy {whole['energy_ratio']:.3f} times that of the best of 32 IPOPT starts "
        f"({whole['energy_ratio_low']:.3f} to {whole['energy_ratio_high']:.3f}), "
        f"cheaper on {share(whole['cheaper'])} of the targets."
    )
    if whole["energy_ratio_low"] > 1.0:
        trails.append(within)
    else:
        sentences.insert(0, within)
    dearer = [row for n, row in ours.items() if n != "all" and row["energy_ratio_low"] > 1.0]
    if dearer and whole["energy_ratio_low"] <= 1.0:
        each = ", ".join(f"{100 * (row['energy_ratio'] - 1):.1f} % at {row['fins']} fins" for row in dearer)
        trails.append(f"`{reference}` is cheaper by {each}.")
    return Claims(tuple(sentences), tuple(trails))


def latency_claims(rows: Sequence[Row], paper_ms: float) -> Claims:
    """The median time of a call beside the other methods'."""
    ours = next((row["p50_ms"] for row in rows if row["method"] == OURS), None)
    if ours is None:
        return Claims()
    others = [row for row in rows if row["method"] not in FAMILY]
    slower = [row for row in others if row["p50_ms"] > 1.2 * ours]
    faster = [row for row in others if row["p50_ms"] < ours / 1.2]
    distilled = next((row["p50_ms"] for row in rows if row["method"] == "fast"), None)
    beside = "" if distilled is None else f", {three(distilled)} ms in its distilled form `fast`"
    leads = []
    if slower:
        times = ", ".join(f"`{row['method']}` {factor(row['p50_ms'] / ours)}" for row in slower)
        leads.append(
            f"One call takes {three(ours)} ms{beside} (the paper's cycle, on a smaller computer: "
            f"{paper_ms:.0f} ms); others take so many times longer: {times}."
        )
    trails = []
    if faster:
        times = ", ".join(f"`{row['method']}` {three(row['p50_ms'])} ms" for row in faster)
        trails.append(f"Faster per call than its {three(ours)} ms: {times}.")
    return Claims(tuple(leads), tuple(trails))


def seed_claims(rows: Sequence[Row]) -> Claims:
    """What the network's seeds buy with few steps, and whether random ones catch up with many."""
    if not rows:
        return Claims()
    first, last = min((r["steps"] for r in rows if r["steps"] > 0), default=0), max(r["steps"] for r in rows)

    def mean(kind: str, steps: int) -> float:
        mine = [row for row in rows if (row["seeds"], row["steps"]) == (kind, steps)]
        return sum(row["err_norm_mean"] * row["n"] for row in mine) / sum(row["n"] for row in mine)

    ours, random = mean("network", first), mean("random", first)
    late, random_late = mean("network", last), mean("random", last)
    word = "step" if first == 1 else "steps"
    leads, trails = [], []
    if ours < random:
        leads.append(
            f"After {first} refinement {word} the network's seeds are {factor(random / ours)} times nearer "
            "than as many random ones."
        )
    if random_late < 1.5 * late:
        trails.append(
            f"With {last} refinement steps random seeds are as near ({error(random_late)} against "
            f"{error(late)})."
        )
    return Claims(tuple(leads), tuple(trails))


def rebuild_claims(ours: Mapping[str, float], printed: float) -> Claims:
    """Whether our rebuild of the paper's pipeline reaches its printed ablation.

    Args:
        ours: `surrogate` and `plant` -> mean error of the whole pipeline.
        printed: the paper's mean error.
    """
    if not ours or ours["surrogate"] <= 1.5 * printed:
        return Claims()
    return Claims(
        (),
        (
            "Our rebuild of the paper's pipeline does not reach its printed ablation: "
            f"{error(ours['surrogate'])} by the surrogate and {error(ours['plant'])} by the plant against "
            f"{error(printed)}.",
        ),
    )


def _mean(rows: Sequence[Row], method: str) -> float | None:
    return next((row["err_norm_mean"] for row in rows if row["method"] == method), None)


def _names(names: Sequence[str]) -> str:
    quoted = [f"`{name}`" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"
