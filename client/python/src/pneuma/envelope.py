"""How messages travel over TCP: a 4-byte big-endian length, then the message. See proto/WIRE.md, "Transport"."""

from __future__ import annotations

from collections.abc import Iterator

from pneuma._proto import session_pb2 as wire
from pneuma.errors import PneumaError

length_bytes = 4
# WIRE.md, "Limits": what a client should take.
message_bytes_max = 64 * 2**20
# What a part takes beside its data, at most: ids, lengths and the flag.
part_head_bytes = 32


def enveloped(message: bytes) -> bytes:
    return len(message).to_bytes(length_bytes, "big") + message


def length_of(head: bytes) -> int:
    """The length that an envelope begins with. Raises PneumaError where no message has it."""
    if head == b"HTTP":
        raise PneumaError(
            "MALFORMED", "this is the server's HTTP port; clients speak to its TCP port, 7420 by default", "connect"
        )
    length = int.from_bytes(head, "big")
    if not 1 <= length <= message_bytes_max:
        raise PneumaError("MALFORMED", f"the server sends a message of {length} bytes")
    return length


class Messages:
    """The messages in the bytes that come."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._wanted = length_bytes  # so many bytes until there is something to take

    def add(self, data: bytes) -> Iterator[bytes]:
        """Those that are whole with `data`; to be gone through to the end. Raises PneumaError as `length_of` does."""
        self._bytes += data
        begin = 0
        try:
            while len(self._bytes) - begin >= self._wanted:
                if self._wanted == length_bytes:
                    self._wanted += length_of(bytes(self._bytes[begin : begin + length_bytes]))
                    continue
                end = begin + self._wanted
                self._wanted = length_bytes
                message = bytes(memoryview(self._bytes)[begin + length_bytes : end])
                begin = end
                yield message
        finally:
            del self._bytes[:begin]


def cut(message: wire.ClientMessage, bytes_max: int, parts_bytes_max: int) -> list[bytes]:
    """The message as a server takes it: whole up to `bytes_max`, else in parts. Raises PneumaError past both limits."""
    whole: bytes = message.SerializeToString()
    if len(whole) <= bytes_max:
        return [whole]
    step = bytes_max - part_head_bytes
    if len(whole) > parts_bytes_max or step <= 0:
        most = max(bytes_max, parts_bytes_max)
        raise PneumaError("LIMIT_EXCEEDED", f"a request of {len(whole)} bytes; the server takes {most}")
    parts = []
    for begin in range(0, len(whole), step):
        part = wire.Part(data=whole[begin : begin + step], last=begin + step >= len(whole))
        parts.append(wire.ClientMessage(request_id=message.request_id, part=part).SerializeToString())
    return parts
