"""The rigid body against MuJoCo over a minute: position and attitude under wrenches that turn with
the body.

Added mass, damping and buoyancy are off on our side, gravity and fluid on MuJoCo's: its fluid model
leaves out half of the added mass, so it cannot judge those. What is checked is the rigid body: the
Coriolis and gyroscopic terms, the attitude, and the integration.
"""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from finlab.layout import Body
from finlab.swim.vehicle.vehicle import STATE_SIZE, Vehicle

MASS = 19.0
"""Of the body [kg]."""
INERTIA = (0.1574, 0.4646, 0.51151)
"""About its axes [kg m2]."""
STEP_S = 0.01
"""A step of both simulations [s]."""
DURATION_S = 60.0
"""Length of the comparison [s]."""
HELD_STEPS = 50
"""Steps during which a wrench is held."""
MOTOR_GEARS = [" ".join("1" if i == k else "0" for i in range(6)) for k in range(6)]
"""MuJoCo's `gear` of a motor along each axis."""
MUJOCO_MODEL = f"""
<mujoco>
  <option timestep="{STEP_S}" integrator="RK4" gravity="0 0 0" density="0" viscosity="0"/>
  <worldbody>
    <body name="robot">
      <freejoint/>
      <inertial pos="0 0 0" mass="{MASS}" diaginertia="{" ".join(map(str, INERTIA))}"/>
      <site name="center"/>
    </body>
  </worldbody>
  <actuator>
    {"".join(f'<motor site="center" gear="{axis}"/>' for axis in MOTOR_GEARS)}
  </actuator>
</mujoco>
"""
"""A free body with a motor along each axis."""


def matrix_of(quaternion: np.ndarray) -> np.ndarray:
    """The rotation of a quaternion (w, x, y, z)."""
    return Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()


def test_a_minute_under_changing_wrenches_agrees() -> None:
    rng = np.random.default_rng(0)
    model = mujoco.MjModel.from_xml_string(MUJOCO_MODEL)
    data = mujoco.MjData(model)
    vehicle = Vehicle(Body(mass_kg=MASS, inertia_kgm2=INERTIA, buoyancy_n=MASS * 9.81))
    state = np.zeros(STATE_SIZE)
    state[3] = 1.0
    wrench = np.zeros(6)
    worst_place = worst_angle = 0.0
    for k in range(round(DURATION_S / STEP_S)):
        if k % HELD_STEPS == 0:
            wrench = rng.uniform(-1, 1, 6) * (4.0, 4.0, 4.0, 0.05, 0.05, 0.05)
        data.ctrl[:] = wrench
        mujoco.mj_step(model, data)
        state = vehicle.step(state, wrench.tolist(), STEP_S)
        turn = matrix_of(state[3:7]).T @ matrix_of(data.qpos[3:7])
        angle = (
            np.linalg.norm(
                [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
            )
            / 2
        )
        worst_place = max(worst_place, float(np.abs(state[:3] - data.qpos[:3]).max()))
        worst_angle = max(worst_angle, float(angle))
    assert np.linalg.norm(state[:3]) > 5.0, "it moved"
    assert worst_place < 1e-6, "metres"
    assert worst_angle < 1e-8, "radians"
