"""Wrenches in frames other than the robot's, by static transforms as `/tf_static` has them.

A transform of tf from a parent to a child frame has the child's origin `t` and orientation `R` in
the parent: `p_parent = R p_child + t`.
"""

from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.errors import CommandError

MAX_FRAMES = 1000
"""Most frames that are kept; a robot has tens."""
UNIT_TOLERANCE = 1e-3
"""Most by which the length of a quaternion may differ from 1."""


@dataclass(frozen=True)
class Transform:
    """Pose of a frame in its parent."""

    parent: str
    """Name of the parent."""
    rotation: Array
    """Orientation (3, 3): columns are the frame's axes in the parent."""
    translation: Array
    """Origin (3,) in the parent [m]."""


class StaticFrames:
    """The static transforms that are known, and what a wrench is in another frame."""

    def __init__(self) -> None:
        self._of_child: dict[str, Transform] = {}

    def add(
        self,
        parent: str,
        child: str,
        translation: tuple[float, float, float],
        quaternion: tuple[float, float, float, float],
    ) -> None:
        """Takes a transform; a later one of the same child replaces it.

        Args:
            parent: frame in which the pose is given.
            child: frame whose pose it is.
            translation: of its origin [m].
            quaternion: x, y, z, w of its orientation.

        Raises:
            CommandError: it is no pose, or there are too many frames.
        """
        origin = np.array(translation, np.float64)
        orientation = np.array(quaternion, np.float64)
        length = float(np.linalg.norm(orientation))
        if not np.isfinite(origin).all() or not abs(length - 1.0) <= UNIT_TOLERANCE:
            raise CommandError(
                f"frame {child!r:.60}: expected finite metres and a unit quaternion, got "
                f"{translation} and {quaternion}"
            )
        if child not in self._of_child and len(self._of_child) >= MAX_FRAMES:
            raise CommandError(f"frame {child!r:.60}: more than {MAX_FRAMES} frames are not kept")
        rotation = rotation_of(orientation / length)
        self._of_child[child] = Transform(parent, rotation, origin)

    def wrench_in(self, base: str, frame: str, wrench: Array) -> Array:
        """Returns a wrench in the frame of the robot.

        With `R` and `t` the orientation and origin of `frame` in `base`, `f' = R f` and
        `m' = R m + t x f'`.

        Args:
            base: the robot's frame.
            frame: the frame of the wrench, a force and a torque about its origin.
            wrench: (6,) [N, N m].

        Raises:
            CommandError: no chain of static transforms leads from one frame to the other.
        """
        rotation, origin = self._pose_in(base, frame)
        force = rotation @ wrench[:3]
        torque = rotation @ wrench[3:] + np.cross(origin, force)
        return np.concatenate([force, torque])

    def twist_in(self, base: str, frame: str, twist: Array) -> Array:
        """Returns the velocity of the robot, a rigid body, at the origin of its own frame.

        With `R` and `t` as for a wrench, `w' = R w` and `v' = R v + t x w'`.

        Args:
            base: the robot's frame.
            frame: the frame of the velocity, that of its origin.
            twist: linear and angular velocity (6,) [m/s, rad/s].

        Raises:
            CommandError: as for `wrench_in`.
        """
        linear = twist[:3]
        angular = twist[3:]
        # What a force is to its torque, the rates are to the velocity.
        moved = self.wrench_in(base, frame, np.concatenate([angular, linear]))
        return np.concatenate([moved[3:], moved[:3]])

    def rotation(self, base: str, frame: str) -> Array:
        """Returns the orientation (3, 3) of a frame in that of the robot; arguments and errors as
        for `wrench_in`."""
        return self._pose_in(base, frame)[0]

    def origin(self, base: str, frame: str) -> Array:
        """Returns the origin (3,) of a frame in that of the robot [m]; arguments and errors as for
        `wrench_in`."""
        return self._pose_in(base, frame)[1]

    def _pose_in(self, base: str, frame: str) -> tuple[Array, Array]:
        """Orientation (3, 3) and origin (3,) [m] of a frame in another one; errors as for
        `wrench_in`."""
        to_root, root = self._pose_in_root(frame)
        base_to_root, base_root = self._pose_in_root(base)
        if root != base_root:
            known = ", ".join(sorted({base, *self._connected(base_root)}))
            raise CommandError(
                f"frame {frame!r:.60}: no static transform leads from it to {base!r:.60}; expected "
                f"one of {known:.200}"
            )
        # R = Rb^T Rf, t = Rb^T (tf - tb).
        turn_back = base_to_root.rotation.T
        rotation: Array = turn_back @ to_root.rotation
        origin: Array = turn_back @ (to_root.translation - base_to_root.translation)
        return rotation, origin

    def _pose_in_root(self, frame: str) -> tuple[Transform, str]:
        """The pose of a frame in the outermost frame of its tree, and that one's name."""
        rotation = np.eye(3)
        translation = np.zeros(3)
        for _ in range(MAX_FRAMES + 1):
            step = self._of_child.get(frame)
            if step is None:
                return Transform(frame, rotation, translation), frame
            rotation = step.rotation @ rotation
            translation = step.rotation @ translation + step.translation
            frame = step.parent
        raise CommandError(f"frame {frame!r:.60}: its static transforms make a circle")

    def _connected(self, root: str) -> set[str]:
        """Names of the frames in the tree of a root."""
        names = set()
        for child in self._of_child:
            if self._pose_in_root(child)[1] == root:
                names.add(child)
        return names


def rotation_of(quaternion: Array) -> Array:
    """Returns the rotation matrix (3, 3) of a unit quaternion x, y, z, w:
    `R = I + 2 w [v] + 2 [v]^2` with `[v]` the matrix of the cross product."""
    x, y, z, w = quaternion.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return rotation
