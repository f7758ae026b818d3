"""The soak in small: many changes on several pages leave nothing behind."""

import numpy as np

from tests.webapp.bench import Bench
from tests.webapp.stand_in import load_stand_in
from webapp.tasks.solver import Solver


def test_changes_leave_no_nodes_behind() -> None:
    rng = np.random.default_rng(0)
    bench = Bench(Solver(load=load_stand_in), n_sessions=2)
    bench.settle()
    bench.soak(20, rng)
    before = bench.nodes()
    bench.soak(60, rng)
    assert bench.nodes() == before
    assert len(bench.respond(3, rng)) == 3
    assert all(view.client.notes == [] for view in bench.views)
    bench.close()
