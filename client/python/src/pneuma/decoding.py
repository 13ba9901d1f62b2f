"""Coded frames: the codec is the C++ one of server and client (proto/WIRE.md, "Frame payload")."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from pneuma._proto import frame_pb2, session_pb2
from pneuma.errors import PneumaError
from pneuma.frames import Decoded, Layout, Pose, topology_of
from pneuma.native import need_native

need_native()
from pneuma import _native  # noqa: E402

# A reader that has gone wrong asks for a key frame, and again if none has come since.
key_patience_s = 1.0


class Decoding:
    """What decoding keeps of one stream from frame to frame."""

    def __init__(self, subscribed: session_pb2.Subscribed, ask_for_key: Callable[[], None] = lambda: None) -> None:
        self._stream_id = subscribed.stream_id
        self._ask_for_key = ask_for_key
        self._asked_at_s = float("-inf")
        self._decoder = _native.Decoder()
        self._decoder.stream(subscribed.SerializeToString())
        self._known: set[bytes] = set()

    def layout(self, message: frame_pb2.Layout, topologies: Mapping[bytes, frame_pb2.Topology]) -> None:
        """Raises PneumaError where a topology is missing, or is not what its hash says."""
        for body in message.soft_bodies:
            if body.topology_hash not in self._known:
                self._decoder.topology(topology_of(body, topologies).SerializeToString())
                self._known.add(body.topology_hash)
        self._decoder.layout(message.SerializeToString())

    def frame(self, message: frame_pb2.Frame, layout: Layout) -> Decoded | None:
        """None of a frame that is passed over: decoding went wrong, and waits for a key frame.

        Raises PneumaError where a key frame is wrong.
        """
        try:
            read = self._decoder.frame(message.SerializeToString())
        except PneumaError:
            if not self._decoder.waits_for_key(self._stream_id):
                raise
            read = None
        if read is None:
            self._ask()
            return None
        time_s, positions, velocities, numbers = read
        poses = tuple(Pose(name, row[:3], row[3:]) for name, row in zip(layout.solids, numbers))
        return Decoded(time_s, positions, velocities, poses)

    def _ask(self) -> None:
        now_s = time.monotonic()
        if now_s - self._asked_at_s >= key_patience_s:
            self._asked_at_s = now_s
            self._ask_for_key()
