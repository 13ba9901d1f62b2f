"""Two that touch."""

from __future__ import annotations

from dataclasses import dataclass

from pneuma._proto import session_pb2 as wire
from pneuma.state import Array, xyz


@dataclass(frozen=True, eq=False, repr=False)
class Touch:
    """Two of a world's soft bodies, rigid bodies and colliders.

    kind: "BEGAN", "ENDED", or "PRESSED": it goes on, with an impulse of the size asked for.
    impulse_n_s: how hard they were pressed together in that tick, along the normals. Of a bounce, that is what stopped
        and returned the body, and its weight for the rest of the substep: up to m g dt more.
    push: (3,), N s: what the first got from the second, friction included.
    position: (3,), metres: the mean of where. normal: (3,), unit, out of the second.

    One that ended has 0 and None of these.
    """

    kind: str
    tick: int
    first: str
    second: str
    impulse_n_s: float
    push: Array | None
    position: Array | None
    normal: Array | None

    def __repr__(self) -> str:
        hard = f" by {self.impulse_n_s:.3g} N s" if self.impulse_n_s else ""
        return f"<{self.first} and {self.second} {self.kind} at tick {self.tick}{hard}>"


def touch_of(message: wire.Touches.Touch, tick: int) -> Touch:
    told = message.HasField("position")
    return Touch(
        kind=wire.Touches.Touch.Kind.Name(message.kind),
        tick=tick,
        first=message.first,
        second=message.second,
        impulse_n_s=message.impulse_n_s,
        push=xyz(message.push) if told else None,
        position=xyz(message.position) if told else None,
        normal=xyz(message.normal) if told else None,
    )
