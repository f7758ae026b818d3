# %% [markdown]
# # Arrows of thrust in MuJoCo
# A BlueROV2 Heavy becomes a model of MuJoCo, swims a turn with a thruster lost, and shows the force of each
# thruster as an arrow. You will see where the others make up for it. With `--view` the same arrows are drawn in
# MuJoCo's own viewer: `python examples/13_mujoco_arrows.py --view`.

# %%
import os
import sys
import time
from ctypes.util import find_library
from tempfile import TemporaryDirectory

if find_library("EGL") and "DISPLAY" not in os.environ:
    os.environ.setdefault("MUJOCO_GL", "egl")  # draws without a screen

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import finlab
from finlab.exchange import Exchange, convert, mujoco_control

LOST = "front_right"
METRES_PER_NEWTON = 0.03

# %% [markdown]
# Three lines drive a model: load it, ask the allocator, hand its answer over.

# %%
with TemporaryDirectory() as folder:
    layout, notes = convert("bluerov2_heavy", f"{folder}/rov.xml", None, Exchange())
    model = mujoco.MjModel.from_xml_path(f"{folder}/rov.xml")
data = mujoco.MjData(model)
allocator = finlab.Allocator(layout)
body = layout.body
assert body is not None and body.linear_damping and body.quadratic_damping
linear, quadratic = np.array(body.linear_damping), np.array(body.quadratic_damping)
answer = allocator.allocate([25.0, 0.0, 12.0, 0.0, 0.0, 3.0], lost=[LOST])
data.ctrl[:] = mujoco_control(answer)


def add_drag() -> None:
    """The water's damping by the layout's body, which MJCF has no place for."""
    rotation = data.xmat[1].reshape(3, 3)
    velocity = np.concatenate([rotation.T @ data.qvel[:3], data.qvel[3:6]])
    drag = -(linear + quadratic * np.abs(velocity)) * velocity
    data.qfrc_applied[:6] = np.concatenate([rotation @ drag[:3], drag[3:]])


def add_arrows(scene: mujoco.MjvScene) -> None:
    """One arrow for each thruster, as long as its force."""
    for site, newtons in enumerate(data.ctrl):
        start = data.site_xpos[site]
        along = data.site_xmat[site].reshape(3, 3)[:, 2]
        end = start + METRES_PER_NEWTON * newtons * along
        arrow = scene.geoms[scene.ngeom]
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        color = np.array([0.1, 0.5, 1.0, 1.0] if newtons >= 0.0 else [1.0, 0.4, 0.1, 1.0])
        mujoco.mjv_initGeom(arrow, kind, np.zeros(3), np.zeros(3), np.zeros(9), color)
        mujoco.mjv_connector(arrow, kind, 0.015, start, end)
        scene.ngeom += 1


# %%
for _ in range(500):
    add_drag()
    mujoco.mj_step(model, data)
print(f"without {LOST}: {np.linalg.norm(data.qvel[:2]):.2f} m/s, ", end="")
print(f"yaw {data.qvel[5]:.2f} rad/s, {answer.power:.0f} W")

# %%
if "--view" in sys.argv:
    from mujoco import viewer

    with viewer.launch_passive(model, data) as window:
        while window.is_running():
            add_drag()
            mujoco.mj_step(model, data)
            window.user_scn.ngeom = 0
            add_arrows(window.user_scn)
            window.sync()
            time.sleep(model.opt.timestep)
figure, axes = plt.subplots(figsize=(6, 4.5), layout="constrained")
try:
    with mujoco.Renderer(model, 480, 640) as renderer:
        camera = mujoco.MjvCamera()
        camera.lookat[:] = data.xpos[1]
        camera.distance, camera.elevation, camera.azimuth = 1.6, -20.0, 60.0
        renderer.update_scene(data, camera)
        add_arrows(renderer.scene)
        axes.imshow(renderer.render())
except Exception:  # no OpenGL here: the same forces from above
    places = np.array([part.position for part in layout.actuators])
    axes.quiver(*places[:, :2].T, *answer.forces[:, :2].T, angles="xy")
axes.set_axis_off()
plt.show()
