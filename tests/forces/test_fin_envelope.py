"""Compiled fins against their laws and against a fine grid of commands: true to the force, and as cheap."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.fin_envelope import (
    AMPLITUDE,
    COST,
    DEFLECTION,
    FREQUENCY,
    LEVELS,
    SHAFT,
    FinEnvelope,
    compile_fin,
    fin_envelope,
    levels,
)
from finlab.layout import FinModelSpec, Limits
from finlab.physics import FinLaw, make_law
from finlab.physics.objective import Name, Objective
from tests.exhaustive import crossed
from tests.random_fins import write_fin_table

Array = NDArray[np.float64]

FINS: dict[str, tuple[FinModelSpec, Limits]] = {
    "drag": (FinModelSpec(), Limits()),
    "weak": (FinModelSpec("drag", (("area", 1e-5),)), Limits((0.0, 0.4), (0.0, 1.0), (0.5, 2.0))),
    "lighthill": (FinModelSpec("lighthill"), Limits((0.1, 0.8), (0.5, 3.0), (-2.5, 2.5))),
    "soft": (FinModelSpec("soft"), Limits()),
    "uneven": (FinModelSpec("soft", (("e", 0.2), ("phi_e", 1.0))), Limits()),
    "leaning": (FinModelSpec("soft", (("d", 0.15), ("e", 0.1))), Limits(zero_direction=(-1.0, 0.5))),
    "leaning all round": (FinModelSpec("soft", (("d", 0.15), ("e", 0.1))), Limits()),
    "declining": (
        FinModelSpec("soft", (("k", 5.0), ("x0", 0.6), ("q", 6.0))),
        Limits((0.05, 0.8), (0.1, 3.0)),
    ),
    "one frequency": (FinModelSpec(), Limits((0.05, 0.6), (1.5, 1.5))),
    "one slow frequency": (FinModelSpec(), Limits((0.05, 0.6), (0.3, 0.3))),
    "one amplitude": (FinModelSpec("soft"), Limits((0.4, 0.4), (0.1, 2.1))),
}


def compiled(name: str, objective: Objective) -> tuple[FinLaw, Limits, FinEnvelope]:
    spec, limits = FINS[name]
    law = make_law(spec)
    return law, limits, compile_fin(law, limits, objective)


def directions(envelope: FinEnvelope) -> Array:
    share = np.linspace(-1.0, 1.0, len(envelope.largest)) if len(envelope.largest) > 1 else np.zeros(1)
    return envelope.middle + envelope.half * share


def sizes(envelope: FinEnvelope) -> Array:
    """What each entry of the table promises (K, LEVELS) [N]."""
    smallest, largest = envelope.smallest[:, None], envelope.largest[:, None]
    return smallest + (largest - smallest) * levels()


def commands(envelope: FinEnvelope) -> Array:
    """The command of each entry (K, LEVELS, 3)."""
    table = envelope.table
    turn = directions(envelope)[:, None] - table[..., DEFLECTION]
    return np.stack([table[..., AMPLITUDE], table[..., FREQUENCY], turn], axis=-1)


def brute(law: FinLaw, limits: Limits, turn: float) -> tuple[Array, Array]:
    """Sizes of the force and commands (a, f, 3) at a zero direction, on a fine grid."""
    axes = [
        np.linspace(*ends, 401 if ends[1] > ends[0] else 1) for ends in (limits.amplitude, limits.frequency)
    ]
    command = np.stack(np.meshgrid(*axes, [turn], indexing="ij"), axis=-1)[:, :, 0]
    force = law.force(command)
    return np.hypot(force[..., 1], force[..., 2]), command


@pytest.mark.parametrize(("objective", "name"), crossed(["power", "effort"], FINS, every=5))
def test_each_entrys_command_gives_the_promised_force(name: str, objective: Name) -> None:
    law, limits, envelope = compiled(name, Objective(objective))
    command, angle = commands(envelope), directions(envelope)
    force = law.force(command)
    promised = sizes(envelope)[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
    missing = np.linalg.norm(force[..., 1:] - promised, axis=-1) / envelope.largest.max()
    # The last of a force that saturates is flat in its commands, and the ends of an arc lean.
    assert np.quantile(missing, 0.9) < 1e-7 and missing.max() < 2e-3
    low, high = np.array(limits.lower), np.array(limits.upper)
    assert (command[..., :2] >= low[:2]).all() and (command[..., :2] <= high[:2]).all()
    if high[2] - low[2] < 6.28:
        assert (command[..., 2] >= low[2] - 1e-9).all() and (command[..., 2] <= high[2] + 1e-9).all()
    np.testing.assert_allclose(envelope.table[..., SHAFT], 0.0, atol=1e-12)
    cost = Objective(objective).fin_cost(law, high)
    np.testing.assert_allclose(envelope.table[..., COST], cost(command), rtol=1e-12)


@pytest.mark.parametrize(
    ("objective", "name"),
    crossed(["power", "effort"], ["drag", "weak", "lighthill", "soft", "uneven", "declining"], every=5),
)
def test_no_cheaper_command_gives_the_same_force(name: str, objective: Name) -> None:
    """Brute force: for each amplitude of a fine grid, each frequency at which the force passes the level."""
    law, limits, envelope = compiled(name, Objective(objective))
    cost, promised = Objective(objective).fin_cost(law, np.array(limits.upper)), sizes(envelope)
    gaps: list[float] = []
    for k in range(0, len(envelope.largest), 12):
        turn = float(directions(envelope)[k] - envelope.table[k, LEVELS // 2, DEFLECTION])
        size, command = brute(law, limits, turn)
        for level in range(4, LEVELS - 2, 6):
            passed = (size[:, :-1] - promised[k, level]) * (size[:, 1:] - promised[k, level]) <= 0.0
            part = (promised[k, level] - size[:, :-1]) / np.where(passed, size[:, 1:] - size[:, :-1], 1.0)
            between = command[:, :-1] + part[..., None] * (command[:, 1:] - command[:, :-1])
            best = float(cost(between[passed]).min())
            # Of weak forces the cheapest amplitude lies between few of those that were asked.
            assert envelope.table[k, level, COST] <= best * 1.02 + 1e-4 * envelope.table[k, -1, COST]
            gaps.append(envelope.table[k, level, COST] / best - 1.0)
            assert envelope.table[k, level, COST] >= best * (1.0 - 3e-3)
    assert np.median(gaps) < 2e-3


@pytest.mark.parametrize("name", FINS)
def test_the_ends_are_those_of_brute_force(name: str) -> None:
    law, limits, envelope = compiled(name, Objective())
    for k in range(0, len(envelope.largest), 12):
        size, _ = brute(law, limits, float(directions(envelope)[k] - envelope.table[k, -1, DEFLECTION]))
        assert envelope.largest[k] == pytest.approx(size.max(), rel=2e-3, abs=1e-9)
        at_rest = np.array([*limits.lower[:2], directions(envelope)[k] - envelope.table[k, 0, DEFLECTION]])
        least = float(np.linalg.norm(law.force(at_rest)))
        assert envelope.smallest[k] == pytest.approx(least, rel=2e-3, abs=1e-5 * envelope.largest[k])


def test_a_table_is_compiled_like_its_law(tmp_path: Path) -> None:
    limits = Limits(zero_direction=(-1.0, 2.0))
    law = make_law(FinModelSpec())
    spec = write_fin_table(tmp_path / "fin.csv", law, limits, sideways=0.1, points=(21, 21, 21))
    table, plain = (fin_envelope(s, limits, Objective()) for s in (spec, FinModelSpec()))
    assert table.largest == pytest.approx(plain.largest[0], rel=5e-3)
    assert (table.middle, table.half) == pytest.approx((plain.middle, plain.half), abs=2e-2)
    np.testing.assert_allclose(
        table.table[5:-5, 10:, COST], np.broadcast_to(plain.table[:, 10:, COST], (39, LEVELS - 10)), rtol=0.05
    )
    command = commands(table)
    force = make_law(spec).force(command)
    np.testing.assert_allclose(table.table[..., SHAFT], force[..., 0], atol=1e-12)
    assert np.abs(table.table[..., SHAFT]).max() > 0.05 * table.largest.max()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize(
    "limits",
    [
        Limits((0.3, 0.3), (1.0, 1.0), (0.5, 0.5)),
        Limits((0.3, 0.3), (1.0, 1.0)),
        Limits((0.0, 1e-4), (0.0, 1e-3)),
        Limits((0.0, 0.6), (0.0, 2.1), (0.5, 0.5)),
    ],
)
@pytest.mark.parametrize("spec", [FinModelSpec(), FinModelSpec("soft", (("e", 0.2), ("d", 0.1)))])
def test_limits_of_no_width_give_finite_tables(spec: FinModelSpec, limits: Limits, objective: Name) -> None:
    envelope = compile_fin(make_law(spec), limits, Objective(objective))
    assert np.isfinite(envelope.table).all()
    assert np.isfinite(envelope.largest).all() and (envelope.largest >= envelope.smallest).all()


def test_a_fin_is_compiled_once_and_a_changed_table_anew(tmp_path: Path) -> None:
    spec, limits = FINS["soft"]
    assert fin_envelope(spec, limits, Objective()) is fin_envelope(spec, limits, Objective())
    assert fin_envelope(spec, limits, Objective()) is not fin_envelope(spec, limits, Objective("effort"))
    path = tmp_path / "fin.csv"
    table = write_fin_table(path, make_law(FinModelSpec()), limits)
    before = fin_envelope(table, limits, Objective())
    write_fin_table(path, make_law(FinModelSpec("drag", (("area", 0.05),))), limits, points=(6, 8, 13))
    assert fin_envelope(table, limits, Objective()).largest.max() > 2.0 * before.largest.max()
