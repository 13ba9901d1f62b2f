"""Messages in envelopes and parts: put together they are what was sent, and each is as small as the server wants."""

from __future__ import annotations

import numpy as np
import pytest

from pneuma import PneumaError, wire
from pneuma.envelope import Messages, cut, enveloped, length_of, message_bytes_max


@pytest.mark.parametrize("seed", range(20))
def test_parts_put_together_are_the_message(seed: int) -> None:
    random = np.random.default_rng(seed)
    bytes_max = int(random.integers(64, 5000))
    text = "x" * int(random.integers(0, 50_000))
    message = wire.ClientMessage(request_id=int(random.integers(1, 2**40)), edit=wire.Edit(world="w", edit_json=text))
    parts = [wire.ClientMessage.FromString(part) for part in cut(message, bytes_max, 1 << 20)]
    if len(parts) == 1:
        assert parts[0] == message
        return
    assert {part.request_id for part in parts} == {message.request_id}
    assert all(part.ByteSize() <= bytes_max and part.part.data for part in parts)
    assert [part.part.last for part in parts] == [False] * (len(parts) - 1) + [True]
    assert wire.ClientMessage.FromString(b"".join(part.part.data for part in parts)) == message


def test_what_no_parts_hold_is_refused_here() -> None:
    message = wire.ClientMessage(request_id=1, edit=wire.Edit(edit_json="x" * 5000))
    with pytest.raises(PneumaError, match="5[0-9]{3} bytes; the server takes 4000") as refused:
        cut(message, 1000, 4000)
    assert refused.value.code == "LIMIT_EXCEEDED"


@pytest.mark.parametrize("length", [0, message_bytes_max + 1, 2**32 - 1])
def test_no_message_has_such_a_length(length: int) -> None:
    with pytest.raises(PneumaError, match="MALFORMED"):
        length_of(length.to_bytes(4, "big"))


def test_the_length_leads_the_message() -> None:
    assert enveloped(b"abc") == b"\0\0\0\3abc"
    assert length_of(b"\0\0\1\2") == 258


@pytest.mark.parametrize("seed", range(20))
def test_messages_come_whole_however_the_bytes_come(seed: int) -> None:
    random = np.random.default_rng(seed)
    sent = [random.bytes(int(size)) for size in random.integers(1, 300, 50)]
    stream = b"".join(enveloped(message) for message in sent)
    messages, begin = Messages(), 0
    came: list[bytes] = []
    while begin < len(stream):
        end = begin + int(random.integers(1, [2, 10, 1000][seed % 3]))
        came += messages.add(stream[begin:end])
        begin = end
    assert came == sent


def test_no_message_is_waited_for_past_a_bad_length() -> None:
    messages = Messages()
    with pytest.raises(PneumaError, match="MALFORMED"):
        list(messages.add(enveloped(b"good") + b"\0\0\0\0"))
