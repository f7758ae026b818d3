"""The paper in one room: features, network, surrogate, pipeline, training.

Where each of its equations stands:

(1) the flapping theta(t): `finlab/swim/vehicle/fin_motion.py`, `FinMotion.angle`
(2) the mixture p(u_i | s_i): `network.py`, `Mixture`, and what leads to it, `NetworkConfig`
(3) its weights at a temperature T: `network.py`, `Mixture.sample`
(4) forces, torques and wrench of the surrogate: `surrogate.py`; in torch `training/modules.py`
(5) L_phys, (6) L_guide: `training/modules.py`, `physics` and `guidance`
(7) L = L_imit + beta L_guide + lambda L_ent: `training/train.py`, weights in `training/recipes.py`
(8) J_norm, and J = J_norm + gamma J_en: `pipeline.py`, `Paper._score`
(9) J_en: `finlab/physics/objective.py`, `command_effort`

QP and SQP of its section on baselines: `finlab/allocation/baselines/linear.py`; its two body-frame
controllers: `finlab/swim/control/body_frame.py`; its tables and figures:
`finlab/research/evaluation/experiments`.
"""
