"""Trees of moving frames, as ROS's tf publishes them: the pose of one in another at any time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.rigid import matrix_to_pose, pose_to_matrix
from fixation_gym.recordings.trajectory import Trajectory
from fixation_gym.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """How a frame moves in its parent."""

    parent: str
    poses: Trajectory | None
    """Over time; None: it stands still."""
    still: FloatArray | None = None
    """The pose if it stands still, shape (7,)."""

    def at(self, time: float) -> FloatArray | None:
        """T_parent_child at a time, shape (4, 4); None where it is not known."""
        pose = self.still if self.poses is None else self.poses.at(time)
        return None if pose is None else pose_to_matrix(pose)


def chain_to(links: Mapping[str, Link], frame: str, base: str | None) -> list[Link]:
    """Links from a frame up to its base, the nearest to the frame first.

    Args:
        links: by the name of the child.
        frame: where to begin.
        base: where to end; None: at the root.

    Raises:
        UsageError: if the frame does not hang on the base, naming those that it hangs on.
    """
    chain: list[Link] = []
    names = [frame]
    while names[-1] != base and names[-1] in links and links[names[-1]].parent not in names:
        chain.append(links[names[-1]])
        names.append(chain[-1].parent)
    if not chain:
        raise UsageError(f"no transform says where '{frame}' is; there are {', '.join(sorted(links)) or 'none'}")
    if base is not None and names[-1] != base:
        raise UsageError(f"'{frame}' does not hang on '{base}'; choose --base-frame of {', '.join(names[1:])}")
    return chain


def pose_along(chain: Sequence[Link], time: float) -> FloatArray | None:
    """Pose of the chain's first frame in its last at a time, shape (7,); None where a link is not known."""
    matrix = np.eye(4)
    for link in chain:
        T_parent_child = link.at(time)
        if T_parent_child is None:
            return None
        matrix = T_parent_child @ matrix
    return matrix_to_pose(matrix)
