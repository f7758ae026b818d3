"""Every model-based method on every fin model, tables that are hard to follow among them."""

import csv
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.errors import AllocationError
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import make_law, plant_of
from finlab.physics.objective import Name
from tests.allocator_cache import AllocatorCache
from tests.sampled_cases import crossed

METHODS = ("analytic", "qp", "sqp", "ipopt")
"""Model-based methods that take robots of fins."""
METHODS_THAT_SERVE_EXACTLY = METHODS[2:]
"""Those that have no error left on a wrench within reach."""
FEW_STARTS: dict[str, dict[str, Any]] = {"ipopt": {"n_starts": 2, "time_limit_s": 1.5}}
"""Settings by which a slow method answers in seconds."""
SOFT = FinModelSpec("soft", (("d", 0.12), ("e", 0.15), ("p", 1.5), ("phi_e", 0.4)))
"""A soft fin whose force is not the same in all directions."""
FORMULAS = {"drag": FinModelSpec("drag"), "lighthill": FinModelSpec("lighthill"), "soft": SOFT}
"""Fins whose law is a formula."""
AMPLITUDE = np.linspace(0.0, 0.62, 9)
"""Amplitudes of the tables [rad]."""
FREQUENCY = np.linspace(0.0, 2.2, 9)
"""Frequencies of the tables [Hz]."""
CIRCLE = np.linspace(-np.pi, np.pi, 25)
"""Zero directions of the tables [rad], the whole circle."""

Change = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Commands (rows, 3) and columns (rows, 4) of a table to other columns."""


def noise(command: np.ndarray, effectiveness: np.ndarray) -> np.ndarray:
    """3 % on force and power, the same at both ends of the circle."""
    rng = np.random.default_rng(0)
    factor = 1.0 + 0.03 * rng.normal(size=(len(AMPLITUDE), len(FREQUENCY), len(CIRCLE), 4))
    factor[:, :, -1] = factor[:, :, 0]
    return effectiveness * factor.reshape(-1, 4)


def beyond_a_peak(command: np.ndarray, effectiveness: np.ndarray) -> np.ndarray:
    """Thrust that falls again from half the frequency on, while power grows."""
    effectiveness[:, :3] *= (np.exp(-((command[:, 1] / 1.3) ** 4)) + 0.1)[:, None]
    return effectiveness


def dead_zone(command: np.ndarray, effectiveness: np.ndarray) -> np.ndarray:
    """No thrust at all for slow or small beats."""
    effectiveness[command[:, 0] * command[:, 1] < 0.2, :3] = 0.0
    return effectiveness


def along_the_shaft(command: np.ndarray, effectiveness: np.ndarray) -> np.ndarray:
    """A twentieth of the thrust acts along the shaft."""
    effectiveness[:, 0] = 0.05 * np.hypot(effectiveness[:, 1], effectiveness[:, 2])
    return effectiveness


def never_at_rest(command: np.ndarray, effectiveness: np.ndarray) -> np.ndarray:
    """A fifth of a newton along the zero direction even without a beat."""
    effectiveness[:, 1] += 0.2 * np.cos(command[:, 2])
    effectiveness[:, 2] += 0.2 * np.sin(command[:, 2])
    return effectiveness


TABLES: dict[str, tuple[FinModelSpec, tuple[Change, ...], bool]] = {
    "drag table": (FORMULAS["drag"], (), False),
    "soft table": (SOFT, (), False),
    "table with power": (SOFT, (), True),
    "noisy table with power": (SOFT, (noise,), True),
    "noisy table": (FORMULAS["drag"], (noise,), False),
    "falling thrust": (FORMULAS["drag"], (beyond_a_peak,), True),
    "dead zone": (FORMULAS["drag"], (dead_zone,), False),
    "force along the shaft": (FORMULAS["lighthill"], (along_the_shaft,), False),
    "never at rest": (FORMULAS["drag"], (never_at_rest,), True),
}
"""Name of a table -> its law, what was changed in it, and whether it has a column of power."""
MODELS = (*FORMULAS, *TABLES, "mixed")
"""Names of all fins; a "mixed" robot has several."""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], list[FinModelSpec]]:
    """Models of the three fins of a robot, by the name of what is tried."""
    folder = tmp_path_factory.mktemp("tables")

    @lru_cache
    def made(name: str) -> list[FinModelSpec]:
        if name in FORMULAS:
            return [FORMULAS[name]] * 3
        if name == "mixed":
            return [FORMULAS["lighthill"], SOFT, made("noisy table with power")[0]]
        path = folder / f"{name}.csv"
        write_fin_table(path, *TABLES[name])
        return [FinModelSpec("table", (("path", str(path)),))] * 3

    return made


def write_fin_table(
    path: Path, spec: FinModelSpec, changes: tuple[Change, ...], with_power: bool
) -> None:
    """Write a law as a table of forces, with changes such as noise."""
    law = make_law(spec)
    command = np.stack(np.meshgrid(AMPLITUDE, FREQUENCY, CIRCLE, indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    effectiveness = np.column_stack([law.force(command), law.power(command)])
    for change in changes:
        effectiveness = change(command, effectiveness)
    rows = np.hstack([command, effectiveness[:, : 4 if with_power else 3]])
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["A", "f", "phi", "Fx", "Fy", "Fz", *(["P"] if with_power else [])])
        writer.writerows(rows.tolist())


def robot_of_models(models: list[FinModelSpec]) -> Layout:
    """A robot of three fins with different limits, by the models of their laws."""
    places = (0.25, 0.15, 0.05), (-0.2, 0.2, -0.05), (-0.1, -0.25, 0.0)
    angles = 0.4, 2.3, -1.4
    limits = Limits(), Limits((0.05, 0.5), (0.1, 1.8)), Limits(zero_direction=(-2.0, 2.4))
    fins = zip(places, angles, limits, models, strict=True)
    return Layout("robot", tuple(Fin(f"fin_{i}", *parts) for i, parts in enumerate(fins)))


def few_starts(method: str, objective: Name) -> AllocatorCache:
    """A method with settings that let it answer in seconds; skipped where CasADi is missing."""
    if method == "ipopt":
        pytest.importorskip("casadi", reason="method ipopt is an optional extra")
    aim = {"objective": objective} if method == "sqp" else {}
    return AllocatorCache(method, **aim, **FEW_STARTS.get(method, {}))


@pytest.mark.parametrize(
    ("objective", "name", "method"), crossed(["power", "effort"], MODELS, METHODS, every=17)
)
def test_every_method_on_every_fin(
    method: str, name: str, objective: Name, model: Callable[[str], list[FinModelSpec]]
) -> None:
    layout = robot_of_models(model(name))
    plant = plant_of(layout)
    allocator = few_starts(method, objective)
    target = plant.wrench(plant.lower + np.array([0.7, 0.55, 0.4]) * plant.width)
    for wrench in (target, 100.0 * target):
        answer = allocator.allocate(layout, wrench)
        assert (answer.command >= plant.lower).all() and (answer.command <= plant.upper).all()
        assert np.isfinite([answer.err_norm, answer.power, answer.effort]).all()
        if wrench is target and method in METHODS_THAT_SERVE_EXACTLY:
            assert answer.err_norm < 6e-3
        if (
            wrench is target
            and method == "analytic"
            and name not in ("never at rest", "force along the shaft")
        ):
            # What the pseudo-inverse asks of each fin it gives, unless it cannot.
            assert answer.err_norm < 0.5


@pytest.mark.parametrize("name", ["drag", "soft", "noisy table with power", "mixed"])
def test_each_objective_is_kept_lower_by_its_own_setting(
    name: str, model: Callable[[str], list[FinModelSpec]]
) -> None:
    """On average over a few targets: less power with `power`, less effort with `effort`."""
    layout = robot_of_models(model(name))
    plant = plant_of(layout)
    targets = 0.5 * plant.wrench(plant.sample(np.random.default_rng(1), (3,)))
    sparing, easy = (
        few_starts("sqp", objective).allocate_batch(layout, targets)
        for objective in ("power", "effort")
    )
    assert sparing.power.mean() <= 1.001 * easy.power.mean()
    assert easy.effort.mean() <= 1.001 * sparing.effort.mean()


def test_what_is_no_objective_is_refused() -> None:
    with pytest.raises(
        AllocationError, match="objective: expected one of power, effort, got 'thrift'"
    ):
        AllocatorCache("sqp", objective="thrift")
    with pytest.raises(AllocationError, match="knows the settings .*objective"):
        AllocatorCache("sqp", price=1.0)


def test_settings_are_told_like_any_other() -> None:
    allocator = Allocator(load_layout("A"), "sqp", objective="effort", n_steps=7)
    settings = vars(allocator.settings)
    assert settings["objective"] == "effort" and settings["n_steps"] == 7
