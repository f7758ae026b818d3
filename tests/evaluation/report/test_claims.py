"""The honest column: sentences from tables made by hand."""

from typing import Any

from finlab.evaluation.report.claims import (
    Claims,
    accuracy_claims,
    energy_claims,
    latency_claims,
    paper_claims,
    rebuild_claims,
    seed_claims,
)


def _row(method: str, mean: float, spread: float = 0.1) -> dict[str, Any]:
    ends = [mean * (1 - spread), mean * (1 + spread)]
    return {"method": method, "err_norm_mean": mean, "err_norm_mean_interval": ends}


def test_beside_the_papers_figure() -> None:
    tables = {"id": [_row("learned", 0.001), _row("paper", 0.05)], "ood": [_row("learned", 0.3)]}
    leads, trails = paper_claims(tables, {"id": 0.0857, "ood": 0.1157})
    assert leads == (
        "Split `id`: mean error 0.0010, **86 times** below the 0.0857 that the paper prints, and 0.050 by "
        "our rebuild of its method.",
    )
    assert trails == ("Split `ood`: mean error 0.30 against 0.1157 printed in the paper.",)


def test_a_baseline_that_wins_is_named() -> None:
    tables = {
        "id": [_row("learned", 1e-3), _row("analytic", 1e-12), _row("qp", 1.0), _row("sqp", 1.05e-3)],
        "limits": [_row("learned", 1e-3), _row("analytic", 0.5), _row("qp", 1.0), _row("sqp", 0.2)],
    }
    leads, trails = accuracy_claims(tables)
    # On `id`, sqp and learned cannot be told apart.
    assert leads == ("More exact than `qp` (all 2 splits); `analytic` and `sqp` (`limits`).",)
    (sentence,) = trails
    assert sentence.startswith("Less exact than `analytic` (`id`): mean errors down to 1.0e-12.")


def _energy(method: str, fins: int | str, ratio: float, half: float = 0.01) -> dict[str, Any]:
    return {
        "method": method,
        "fins": fins,
        "energy_ratio": ratio,
        "energy_ratio_low": ratio - half,
        "energy_ratio_high": ratio + half,
        "cheaper": 0.4,
    }


def test_energy_in_words() -> None:
    rows = [
        _energy("ipopt-32", "all", 1.0, 0.0),
        _energy("learned", 4, 0.99),
        _energy("learned", 5, 1.05),
        _energy("learned", "all", 1.0),
        _energy("analytic", "all", 1.25),
        _energy("slsqp", "all", 0.9),
    ]
    leads, trails = energy_claims(rows, "ipopt-32")
    assert leads[0].startswith("Energy 1.000 times that of the best of 32 IPOPT starts (0.990 to 1.010)")
    assert leads[1] == "20.0 % less energy than `analytic`."
    assert trails == ("`slsqp` needs 10.0 % less energy.", "`ipopt-32` is cheaper by 5.0 % at 5 fins.")
    dear = energy_claims([_energy("learned", "all", 1.2)], "ipopt-32")
    assert dear.leads == () and dear.trails[0].startswith("Energy 1.200 times")
    assert energy_claims([], "ipopt-32") == Claims()


def test_times_in_words() -> None:
    rows = [{"method": m, "p50_ms": t} for m, t in (("learned", 2.0), ("paper", 80.0), ("analytic", 0.1))]
    leads, trails = latency_claims(rows, 80.0)
    assert leads[0].startswith("One call takes 2.00 ms") and "`paper` 40" in leads[0]
    assert trails == ("Faster per call than its 2.00 ms: `analytic` 0.100 ms.",)


def test_random_seeds_that_catch_up_are_named() -> None:
    def row(kind: str, steps: int, error: float) -> dict[str, Any]:
        return {"seeds": kind, "steps": steps, "n": 10, "err_norm_mean": error}

    rows = [row("network", 1, 0.01), row("random", 1, 0.5), row("network", 8, 1e-4), row("random", 8, 1e-4)]
    leads, trails = seed_claims(rows)
    assert leads == (
        "After 1 refinement step the network's seeds are 50 times nearer than as many random ones.",
    )
    assert trails == ("With 8 refinement steps random seeds are as near (0.00010 against 0.00010).",)


def test_a_rebuild_that_falls_short_is_said() -> None:
    assert rebuild_claims({"surrogate": 3e-4, "plant": 0.06}, 3.03e-4) == Claims()
    (sentence,) = rebuild_claims({"surrogate": 0.04, "plant": 0.06}, 3.03e-4).trails
    assert "0.040 by the surrogate and 0.060 by the plant against 0.00030" in sentence


def test_claims_add_up() -> None:
    assert Claims(("a",), ()) + Claims(("b",), ("c",)) == Claims(("a", "b"), ("c",))
