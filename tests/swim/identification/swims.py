"""Swims of made-up robots, simulated by the physics alone."""

import csv
from pathlib import Path

import numpy as np

from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.identification.swim import STEP_S
from finlab.swim.vehicle.attitude import euler, quaternion_of
from finlab.swim.vehicle.fin_motion import FinMotion
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle

NOISE = np.array([0.01] * 3 + [0.005] * 6 + [0.005] * 3)
"""Standard deviations (12,) of position [m], angles [rad], velocity [m/s] and angular velocity
[rad/s]."""


def swim(
    truth: Layout, seconds: float, seed: int, noise: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Commands (N, n, 3) and measurements (N, 12) of a robot whose fins wander at random."""
    rng = np.random.default_rng(seed)
    n = truth.n_fins
    steps = round(seconds / STEP_S)
    vehicle = Vehicle(complete_body(truth))
    fins = FinMotion(truth)
    plant = plant_of(truth)
    state = np.zeros(13)
    state[3:7] = quaternion_of(0.0, 0.0, 0.3)
    commands = np.empty((steps, n, 3))
    measured = np.empty((steps, 12))
    command = plant.sample(rng, ())
    for k in range(steps):
        if k % 15 == 0:
            command = plant.sample(rng, ())
            # Pushes that tend to bring it back, so that it stays near the place where it began.
            command[:, 2] = np.where(
                rng.random(n) < 0.5, command[:, 2], -np.sign(state[2]) * np.pi / 2
            )
        commands[k] = command
        measured[k] = np.concatenate([state[:3], euler(state[3:7]), state[7:]])
        for _ in range(5):
            fins.step(command, STEP_S / 5)
            moving = fins.command
            wrench = plant.wrench(plant.feasible(moving), flow=vehicle.velocity_in_water(state))
            state = vehicle.step(state, wrench.tolist(), STEP_S / 5)
    return commands, measured + noise * NOISE * rng.standard_normal(measured.shape)


def write_csv(path: Path, layout: Layout, commands: np.ndarray, measured: np.ndarray) -> None:
    """The swim as a CSV file, every 0.1 s."""
    names = ["t", "x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r"]
    for fin in layout.names:
        names += [f"{fin}.A", f"{fin}.f", f"{fin}.phi"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for k, (command, said) in enumerate(zip(commands, measured, strict=True)):
            writer.writerow([f"{value:.9g}" for value in (k * STEP_S, *said, *command.ravel())])
