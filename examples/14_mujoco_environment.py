# %% [markdown]
# # An environment for learning, in MuJoCo
# A class with `reset` and `step` as gymnasium's environments have them, so that a learner asks for wrenches and
# the allocator finds the thrusters' forces; with `gymnasium.Env` as a second base and two spaces
# of `gymnasium.spaces` it is one of gymnasium's. You will see a controller hold station as a thruster fails.

# %%
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import finlab
from finlab.exchange import Exchange, convert, mujoco_control


# %%
class HoldStation:
    """Actions: wrenches (6,) as shares of `MOST`. Observations, in the robot's frame: where the
    station is (3,) [m], its heading [rad], velocity (3,) [m/s], angular velocity (3,) [rad/s]."""

    MOST = np.array([60.0, 40.0, 60.0, 4.0, 4.0, 8.0])  # [N, N m]
    STEPS = 10  # of MuJoCo for one of this environment
    TOW = np.array([15.0, -15.0, 0.0])  # [N] a cable pulls, to be held against

    def __init__(self, robot: str = "bluerov2_heavy") -> None:
        with TemporaryDirectory() as folder:
            layout, _ = convert(robot, f"{folder}/robot.xml", None, Exchange())
            self.model = mujoco.MjModel.from_xml_path(f"{folder}/robot.xml")
        self.model.opt.timestep = 0.005
        self.data = mujoco.MjData(self.model)
        self.allocator = finlab.Allocator(layout)
        body = layout.body
        assert body is not None and body.linear_damping and body.quadratic_damping
        self.damping = np.array([body.linear_damping, body.quadratic_damping])
        self.broken: str | None = None  # what does not push
        self.lost: tuple[str, ...] = ()  # what the allocator knows of it

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:3] = np.random.default_rng(seed).uniform(-0.3, 0.3, 3)
        self.broken, self.lost = None, ()
        mujoco.mj_forward(self.model, self.data)
        return self._observation(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        wrench = self.MOST * np.clip(action, -1.0, 1.0)
        answer = self.allocator.allocate(wrench, lost=self.lost, policy="direction")
        self.data.ctrl[:] = mujoco_control(answer)
        if self.broken is not None:
            self.data.ctrl[self.model.actuator(self.broken).id] = 0.0
        for _ in range(self.STEPS):
            self._add_water()
            mujoco.mj_step(self.model, self.data)
        observation = self._observation()
        error = float(np.linalg.norm(observation[:4]))
        return observation, -error, error > 5.0, False, {"watts": answer.power}

    def _observation(self) -> Any:
        rotation = self.data.xmat[1].reshape(3, 3)
        heading = np.arctan2(rotation[1, 0], rotation[0, 0])
        place, velocity = rotation.T @ -self.data.qpos[:3], rotation.T @ self.data.qvel[:3]
        return np.concatenate([place, [-heading], velocity, self.data.qvel[3:6]])

    def _add_water(self) -> None:
        rotation = self.data.xmat[1].reshape(3, 3)
        velocity = np.concatenate([rotation.T @ self.data.qvel[:3], self.data.qvel[3:6]])
        drag = -(self.damping[0] + self.damping[1] * np.abs(velocity)) * velocity
        self.data.qfrc_applied[:3] = rotation @ drag[:3] + self.TOW
        self.data.qfrc_applied[3:6] = drag[3:]


def controller(seen: Any) -> Any:
    """A spring and a damper to the origin: where a learner would stand."""
    pull = np.concatenate([3.0 * seen[:3], [0.0, 0.0, 2.0 * seen[3]]])
    return pull - np.concatenate([seen[4:7], 0.5 * seen[7:]])


# %%
environment = HoldStation()
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for told in (False, True):
    seen = environment.reset(seed=3)[0]
    errors = []
    for tick in range(400):
        if tick == 120:
            hardest = np.argmax(np.abs(environment.data.ctrl))
            environment.broken = environment.model.actuator(int(hardest)).name
            environment.lost = (environment.broken,) if told else ()
        seen, reward = environment.step(controller(seen))[:2]
        errors.append(-reward)
    words = "the allocator is told" if told else "the allocator is not told"
    print(f"{words}: the largest error after the loss is {max(errors[120:]):.2f}")
    axes.plot(0.05 * np.arange(400), errors, label=words)
axes.set(xlabel="time [s]", ylabel="error [m, rad]")
axes.legend()
plt.show()
