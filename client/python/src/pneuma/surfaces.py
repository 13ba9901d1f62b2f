"""Where rays and points find surfaces, as numpy arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneuma import messages
from pneuma._proto import session_pb2 as wire
from pneuma.arrays import Points, Vector, floats
from pneuma.state import Array, xyz


@dataclass(frozen=True, eq=False, repr=False)
class Surfaces:
    """What was found for each ray or point asked for, in their order.

    found: (n,), whether something was. Where nothing was, distances are inf, positions and normals nan.
    bodies: names of soft bodies, rigid bodies and colliders; "" where nothing was found.
    positions: (n, 3), metres. normals: (n, 3), unit, out of the body.
    distances: (n,), metres: from the ray's origin; from a point, negative in a solid or a closed skin.
    faces: (n,), of a soft body, the index of the face; else -1.
    weights: (n, 3), of the face's three vertices; else nan.
    """

    tick: int
    found: NDArray[np.bool_]
    bodies: Sequence[str]
    positions: Array
    normals: Array
    distances: Array
    faces: NDArray[np.int64]
    weights: Array

    def __len__(self) -> int:
        return len(self.bodies)

    def __repr__(self) -> str:
        return f"<{len(self)} places at tick {self.tick}: {', '.join(body or 'nothing' for body in self.bodies)}>"


def surfaces_of(message: wire.SurfacePoints) -> Surfaces:
    nothing = np.full(3, np.nan)
    points = message.points
    return Surfaces(
        tick=message.tick,
        found=np.array([bool(point.body) for point in points], bool),
        bodies=[point.body for point in points],
        positions=rows([xyz(point.position) if point.body else nothing for point in points]),
        normals=rows([xyz(point.normal) if point.body else nothing for point in points]),
        distances=np.array([point.distance_m if point.body else np.inf for point in points], float),
        faces=np.array([point.face if point.HasField("face") else -1 for point in points], np.int64),
        weights=rows([xyz(point.weights) if point.HasField("face") else nothing for point in points]),
    )


def rows(vectors: list[Array]) -> Array:
    return np.array(vectors, float).reshape(-1, 3)


def vectors(given: Points | Vector, where: str) -> Array:
    """(n, 3) of points, or of one. Raises PneumaError."""
    array = floats(given, where)
    if array.size == 0 or array.shape == (3,):
        array = array.reshape(-1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise messages.invalid(where, f"have the shape {array.shape}; points have (n, 3), one has (3,)")
    return array


def set_xyz(message: Any, vector: Array) -> None:
    message.x, message.y, message.z = vector.tolist()


def names(bodies: Sequence[str]) -> Sequence[str]:
    """One name stands for a list of it."""
    return [bodies] if isinstance(bodies, str) else bodies
