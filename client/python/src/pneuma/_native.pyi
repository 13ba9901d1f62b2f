"""What native/ binds. Messages are bytes; errors are pneuma.PneumaError."""

import numpy as np
from numpy.typing import NDArray

class World:
    """One world."""

    def __init__(self, create_world: bytes, threads: int) -> None: ...
    def answer(self, request: bytes) -> bytes: ...
    @property
    def tick(self) -> int: ...
    @property
    def state_hash(self) -> int: ...

class Worlds:
    """Many worlds of one scene. Arrays that are not among `shown` are None."""

    def __init__(self, create_world: bytes, count: int, threads: int, shown: set[str]) -> None: ...
    def step(
        self,
        ticks: int,
        impulses: object,
        moles: object,
        collider_velocities: object,
        collider_angular_velocities: object,
    ) -> None: ...
    def reset(self, which: object) -> None: ...
    def state_hashes(self) -> NDArray[np.uint64]: ...
    count: int
    tick_s: float
    body_names: list[str]
    collider_names: list[str]
    vertex_counts: list[int]
    positions: NDArray[np.float32] | None
    velocities: NDArray[np.float32] | None
    centres_of_mass: NDArray[np.float64] | None
    mean_velocities: NDArray[np.float64] | None
    pressures_pa: NDArray[np.float64] | None
    volumes_m3: NDArray[np.float64] | None
    frozen: NDArray[np.bool_]
    ticks: NDArray[np.uint64]

class Decoder:
    """Coded streams as arrays."""

    def stream(self, subscribed: bytes) -> None: ...
    def topology(self, topology: bytes) -> None: ...
    def layout(self, layout: bytes) -> None: ...
    def frame(
        self, frame: bytes
    ) -> tuple[float, NDArray[np.float32], NDArray[np.float32] | None, NDArray[np.float64]] | None: ...
    def waits_for_key(self, stream_id: int) -> bool: ...

class RecordingReader:
    """A recording's messages, in the order of the file."""

    def __init__(self, path: str) -> None: ...
    @property
    def header(self) -> bytes: ...
    @property
    def damage(self) -> str: ...
    def next(self) -> bytes | None: ...

class RecordingWriter:
    """Writes a recording's messages as they come."""

    def __init__(self, path: str, header: bytes, replace: bool) -> None: ...
    def append(self, message: bytes) -> None: ...
    def flush(self) -> None: ...
    def finish(self) -> None: ...
