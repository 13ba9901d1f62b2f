"""What goes wrong, as exceptions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal, TypeAlias, cast, get_args

from pneuma._proto import session_pb2 as wire

if TYPE_CHECKING:
    from pneuma.state import State

#: proto/WIRE.md, "Errors", says what each means.
Code: TypeAlias = Literal[
    "INVALID_ARGUMENT",
    "NOT_FOUND",
    "ALREADY_EXISTS",
    "LIMIT_EXCEEDED",
    "UNAUTHENTICATED",
    "FAILED_PRECONDITION",
    "UNSUPPORTED",
    "MALFORMED",
    "UNAVAILABLE",
    "INTERNAL",
    "PERMISSION_DENIED",
]
codes: tuple[Code, ...] = get_args(Code)


class PneumaError(Exception):
    """A request that was refused, or a connection that ended.

    code: the wire's name for the kind of error, such as "NOT_FOUND".
    what: what was wrong, in words.
    where: the path of the field, such as "create_world.scene.soft_bodies[0].gas.moles"; may be empty.
    retry_after_s: when to try again, in seconds; 0 where that makes no sense.
    """

    def __init__(self, code: Code, what: str, where: str = "", retry_after_s: float = 0.0) -> None:
        super().__init__(code, what, where, retry_after_s)
        self.code = code
        self.what = what
        self.where = where
        self.retry_after_s = retry_after_s

    def __str__(self) -> str:
        return f"{self.code}: {self.what}" + (f" ({self.where})" if self.where else "")


class NotReached(PneumaError):
    """`World.run_until` did not come to what it waited for. `state` is the world's at the last tick."""

    def __init__(self, what: str, state: State) -> None:
        super().__init__("LIMIT_EXCEEDED", what, "step_until.ticks_max")
        self.args = (what, state)  # from which a copy is made
        self.state = state

    def __str__(self) -> str:
        return self.what


@contextmanager
def at_a_blocks_end(raised: BaseException | None) -> Iterator[None]:
    """Ends what a block was about. That it is gone already is no error.

    raised: the block's own error, which goes on. What fails at the end is a note of it.
    """
    try:
        yield
    except PneumaError as error:
        if error.code == "NOT_FOUND":
            return
        if raised is None:
            raise
        if str(error) != str(raised):  # one broken connection is told once
            raised.add_note(f"At the block's end: {error}")


def error_of(reply: wire.Error) -> PneumaError:
    """The exception for the wire's error. A code that a later server knows is INTERNAL."""
    known = reply.code in wire.Error.Code.values() and reply.code != wire.Error.CODE_UNSPECIFIED
    code = wire.Error.Code.Name(reply.code) if known else "INTERNAL"
    return PneumaError(cast(Code, code), reply.what, reply.where, reply.retry_after_s)
