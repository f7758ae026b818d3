"""What the report's pictures show: series, labels and places of the data, read from the drawn axes."""

from pathlib import Path

import numpy as np
import pytest

from finlab.evaluation.experiments.ablation import VARIANTS
from finlab.evaluation.statistics.records import Records

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes  # noqa: E402

from finlab.evaluation.plots.costs import cost_by_fins, cost_by_starts  # noqa: E402
from finlab.evaluation.plots.studies import (  # noqa: E402
    ablation_dots,  # noqa: E402
    figure_a,  # noqa: E402
    latency_dots,
    training_bars,
)
from finlab.evaluation.plots.style import COLOURS, Picture, picture  # noqa: E402
from finlab.evaluation.plots.wrench_tracking import error_by_fins, error_distribution  # noqa: E402


def _line(axis: Axes, label: str) -> np.ndarray:
    """The points (K, 2) of the one line of a label."""
    (line,) = [line for line in axis.lines if line.get_label() == label]
    return line.get_xydata()


def _legend(view: Picture) -> list[str]:
    return [text.get_text() for text in view.figure.legends[0].get_texts()]


def _records(err_norm: np.ndarray, n_fins: np.ndarray) -> Records:
    n = len(err_norm)
    zeros = np.zeros(n, np.int64)
    return Records(zeros, np.arange(n), n_fins, err_norm, err_norm, err_norm, err_norm, zeros, err_norm)


def test_a_distribution_falls_from_all_targets_to_none() -> None:
    error = np.logspace(-3, -1, 1000)
    fins = np.full(1000, 3)
    records = {"id": {"search": _records(error, fins), "qp": _records(10 * error, fins)}}
    view = error_distribution(records, {"id": 0.0857})
    (axis,) = view.axes
    search, qp = _line(axis, "search"), _line(axis, "qp")
    assert search[0] == pytest.approx([1e-3, 1.0]) and (np.diff(search[:, 1]) <= 0).all()
    half = np.searchsorted(-search[:, 1], -0.5)
    assert search[half, 0] == pytest.approx(1e-2, rel=0.05)
    assert qp[:, 0] == pytest.approx(10 * search[:, 0])
    assert axis.get_xscale() == axis.get_yscale() == "log"
    assert axis.get_xlabel() == "normalized error" and axis.get_title(loc="left") == "split id"
    assert any(np.allclose(line.get_xdata(), 0.0857) for line in axis.lines)  # the printed mean
    assert _legend(view) == ["search", "qp"]


def test_errors_by_fins_have_a_dot_at_the_mean_and_a_bar_to_the_tail() -> None:
    error = np.concatenate([np.linspace(0.1, 0.3, 101), np.linspace(1.0, 3.0, 101)])
    view = error_by_fins({"search": _records(error, np.repeat([2, 5], 101))}, ("qp", "search"))
    (axis,) = view.axes
    bars = [line.get_xydata() for line in axis.lines if len(line.get_xdata()) == 2]
    dots = [line.get_xydata()[0] for line in axis.lines if len(line.get_xdata()) == 1]
    assert np.array(dots) == pytest.approx(np.array([[2, 0.2], [5, 2.0]]))
    assert np.array(bars)[:, :, 1] == pytest.approx(np.array([[0.2, 0.29], [2.0, 2.9]]))
    assert list(axis.get_xticks()) == [2, 5] and axis.get_xlabel() == "working fins"


def test_costs_stand_over_their_fins_with_their_intervals() -> None:
    def row(objective: str, fins: int | str, ratio: float | None) -> dict[str, object]:
        ends = None if ratio is None else [ratio - 0.1, ratio + 0.2]
        about = {"objective": objective, "method": "search", "fins": fins}
        return {**about, "cost_ratio": ratio, "cost_ratio_interval": ends}

    rows = [row("power", fins, 1.5) for fins in (2, 5, "all")]
    rows += [row("effort", 2, 1.2), row("effort", 5, None)]  # five fins: nothing was compared
    power, effort = cost_by_fins(rows).axes
    (container,) = power.containers
    assert container.get_label() == "search"
    points, _, (bars,) = container
    assert points.get_ydata() == pytest.approx([1.5, 1.5])
    assert np.round(points.get_xdata(orig=False)).tolist() == [0, 1]
    assert [label.get_text() for label in power.get_xticklabels()] == ["2", "5"]
    assert [segment[:, 1].tolist() for segment in bars.get_segments()] == [
        pytest.approx([1.4, 1.7]),
        pytest.approx([1.4, 1.7]),
    ]
    assert effort.containers[0][0].get_ydata() == pytest.approx([1.2])
    assert power.get_title(loc="left").startswith("power") and "cost" in power.get_ylabel()


def test_costs_of_each_start_stand_beside_each_other() -> None:
    about = {"objective": "effort", "cost_ratio_interval": [0.9, 1.2]}
    rows = [
        {**about, "seeds": seeds, "fins": fins, "cost_ratio": ratio}
        for fins in (4, 12)
        for seeds, ratio in (("network", 1.0), ("one", 1.1), ("all", 1.0))
    ]
    (axis,) = cost_by_starts(rows).axes
    network, one = axis.containers  # `all` is what they are compared with
    assert (network.get_label(), one.get_label()) == ("network", "one")
    assert network[0].get_ydata() == pytest.approx([1.0, 1.0]) and one[0].get_ydata() == pytest.approx(
        [1.1, 1.1]
    )
    assert (one[0].get_xdata() > network[0].get_xdata()).all()
    assert [label.get_text() for label in axis.get_xticklabels()] == ["4", "12"]


def test_times_are_sorted_and_reach_from_median_to_tail() -> None:
    rows = [{"method": m, "p50_ms": t, "p99_ms": 2 * t} for m, t in (("paper", 80.0), ("search", 1.0))]
    (axis,) = latency_dots(rows, 83.0).axes
    assert [label.get_text() for label in axis.get_yticklabels()] == ["search", "paper"]
    bars = [line for line in axis.lines if line.get_linewidth() == 4]
    assert [list(line.get_xdata()) for line in bars] == [[1.0, 2.0], [80.0, 160.0]]
    assert [line.get_color() for line in bars] == [COLOURS["search"], COLOURS["paper"]]
    assert axis.yaxis_inverted() and axis.get_xscale() == "log" and "[ms]" in axis.get_xlabel()
    assert any(np.allclose(line.get_xdata(), 83.0) for line in axis.lines)


def test_trainings_are_drawn_before_and_after_refinement() -> None:
    row = {"change": "recipe", "err_norm_mean": 0.5, "err_norm_mean_interval": [0.4, 0.8]}
    row |= {"refined_err_norm_mean": 0.1, "refined_err_norm_mean_interval": [0.05, 0.2]}
    (axis,) = training_bars([row], {"recipe": "the recipe"}).axes
    raw, refined = axis.containers
    assert (raw[0].get_xdata()[0], refined[0].get_xdata()[0]) == (0.5, 0.1)
    assert raw[2][0].get_segments()[0][:, 0] == pytest.approx([0.4, 0.8])
    assert [label.get_text() for label in axis.get_yticklabels()] == ["the recipe"]


def test_the_ablation_marks_who_refined_who_scored_and_what_is_printed() -> None:
    size = {"adam": 1.0, "levenberg-marquardt": 10.0}
    scale = {"plant": 1.0, "surrogate": 0.1}
    rows = [
        {"variant": v, "refinement": r, "scored_by": s, "j_norm_mean": size[r] * scale[s] * (k + 1)}
        for k, v in enumerate(VARIANTS)
        for r in size
        for s in scale
    ]
    titles = {name: name.upper() for name in VARIANTS}
    view = ablation_dots(rows, dict.fromkeys(VARIANTS, 7.0), titles)
    (axis,) = view.axes
    dots = _line(axis, "levenberg-marquardt, scored by the surrogate")
    assert dots[:, 0] == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0])
    assert np.round(dots[:, 1]).tolist() == [0, 1, 2, 3, 4]
    assert _line(axis, "printed in the paper")[:, 0] == pytest.approx([7.0] * 5)
    assert [label.get_text() for label in axis.get_yticklabels()] == list(titles.values())
    hollow = {line.get_label(): line.get_markerfacecolor() for line in axis.lines}
    assert hollow["adam, scored by the surrogate"] == "white" != hollow["adam, scored by the plant"]


def test_figure_a_shows_temperatures_and_candidates() -> None:
    rows = [
        {
            "temperature": t,
            "diversity": d,
            "best_j_mean": j,
            "best_j_median": j / 2,
            "best_j_mean_interval": [0.9 * j, 1.1 * j],
        }
        for t, d, j in ((0.01, 0.2, 1.0), (1.0, 0.6, 4.0))
    ]
    scatter = {"refined": [0, 0, 1], "energy": [3.0, 4.0, 2.0], "err_norm": [0.5, 0.6, 0.0]}
    view = figure_a(rows, {key: np.array(value) for key, value in scatter.items()}, 0.02)
    spread, best, right = view.axes
    assert spread.lines[0].get_xydata() == pytest.approx(np.array([[0.01, 0.2], [1.0, 0.6]]))
    assert _line(best, "mean")[:, 1] == pytest.approx([1.0, 4.0])
    assert _line(best, "median")[:, 1] == pytest.approx([0.5, 2.0])
    assert all(any(np.allclose(line.get_xdata(), 0.02) for line in axis.lines) for axis in (spread, best))
    assert _line(right, "drawn") == pytest.approx(np.array([[3.0, 0.5], [4.0, 0.6]]))
    assert _line(right, "refined") == pytest.approx(np.array([[2.0, 1e-5]]))  # raised to where it shows
    assert right.get_xlabel().startswith("energy") and "surrogate" in right.get_ylabel()


def test_a_saved_picture_has_its_colours_and_size(tmp_path: Path) -> None:
    from PIL import Image

    with picture(height=2.0) as view:
        view.axes[0].plot([0, 1], [0, 1], color="#0072B2", lw=20)
        path = view.save(tmp_path / "line.png")
    image = Image.open(path)
    assert image.size == (1056, 220) and image.mode == "P"
    red, green, blue = (np.asarray(image.convert("RGB"))[..., k].astype(int) for k in range(3))
    drawn = (abs(red - 0x00) < 12) & (abs(green - 0x72) < 12) & (abs(blue - 0xB2) < 12)
    assert 0.02 < drawn.mean() < 0.3
    assert view.svg("line").count("<svg") == 1
