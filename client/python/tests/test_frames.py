"""Plain frames: bytes as WIRE.md describes them become the numbers that they were made of."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from pneuma import Frame, PneumaError, wire
from pneuma._proto import frame_pb2
from pneuma.aio import feed as feed_module
from pneuma.aio.feed import Feed, Reader
from pneuma.decoding import Decoding
from pneuma.frames import Layout, frame_of

Event = wire.Event


def topologies(*counts: int) -> dict[bytes, frame_pb2.Topology]:
    return {bytes([n]): frame_pb2.Topology(hash=bytes([n]), vertex_count=n, indices=[0, 1, 2]) for n in counts}


def layout_message(*counts: int) -> frame_pb2.Layout:
    soft = [frame_pb2.Layout.Soft(name=f"body-{i}", topology_hash=bytes([n])) for i, n in enumerate(counts)]
    return frame_pb2.Layout(stream_id=1, layout_id=5, soft_bodies=soft, solids=[frame_pb2.Layout.Solid(name="floor")])


def layout(*counts: int) -> Layout:
    return Layout(layout_message(*counts), topologies(*counts))


@pytest.mark.parametrize("seed", range(10))
def test_floats_are_what_they_were(seed: int) -> None:
    random = np.random.default_rng(seed)
    counts = [int(n) for n in random.integers(3, 60, size=random.integers(1, 6))]
    positions, velocities = random.normal(size=(2, sum(counts), 3)).astype("<f4")
    message = frame_pb2.Frame(tick=3, time_s=0.05, payload=positions.tobytes(), velocities=velocities.tobytes())
    frame = frame_of(message, layout(*counts))
    assert np.array_equal(frame.positions, positions)
    begin = 0
    for index, count in enumerate(counts):
        body = frame[f"body-{index}"]
        assert np.array_equal(body.positions, positions[begin : begin + count])
        assert body.velocities is not None and np.array_equal(body.velocities, velocities[begin : begin + count])
        begin += count


@pytest.mark.parametrize("velocity_step_m_s", [0.0, 0.01])
def test_integers_count_steps_from_the_origin(velocity_step_m_s: float) -> None:
    random = np.random.default_rng(1)
    counted = random.integers(-32768, 32768, size=(2, 20, 3)).astype("<i2")
    origin, step = np.array([1.5, -2.0, 100.0]), 0.002
    velocities = counted[1] if velocity_step_m_s else counted[1].astype("<f4")
    grid = frame_pb2.Int16Grid(step_m=step, velocity_step_m_s=velocity_step_m_s)
    grid.origin.x, grid.origin.y, grid.origin.z = origin
    message = frame_pb2.Frame(payload=counted[0].tobytes(), velocities=velocities.tobytes(), int16=grid)
    frame = frame_of(message, layout(20))
    assert np.allclose(frame.positions, origin + step * counted[0], rtol=0, atol=1e-5)
    assert frame.velocities is not None
    assert np.allclose(frame.velocities, counted[1] * (velocity_step_m_s or 1.0), rtol=1e-6)


def test_scalars_poses_and_contacts_have_names() -> None:
    message = frame_pb2.Frame(payload=bytes(12 * 7))
    message.scalars.volume_m3.extend([1.5, 0.0])
    message.scalars.asleep.extend([False, True])
    message.poses.add(solid=0).position.y = 2.0
    contact = message.contacts.add(soft=1, vertex=2, other_solid=0)
    contact.normal.y = 1.0
    message.contacts.add(soft=0, vertex=1, other_soft=1)
    message.contacts.add(soft=0, vertex=1)
    frame = frame_of(message, layout(3, 4))
    assert (frame["body-0"].volume_m3, frame["body-1"].asleep, frame["body-0"].pressure_pa) == (1.5, True, None)
    assert frame.solids["floor"].position.tolist() == [0, 2, 0]
    assert frame.solids["floor"].orientation.tolist() == [1, 0, 0, 0]
    assert [(c.body, c.vertex, c.other) for c in frame.contacts] == [
        ("body-1", 2, "floor"),
        ("body-0", 1, "body-1"),
        ("body-0", 1, ""),
    ]


@pytest.mark.parametrize("size", [0, 11, 12 * 6, 12 * 8])
def test_a_payload_of_other_vertices_is_refused(size: int) -> None:
    with pytest.raises(ValueError):
        frame_of(frame_pb2.Frame(payload=bytes(size)), layout(7))


class Stream:
    """A feed of one body of three vertices, and one that reads it."""

    def __init__(self) -> None:
        self.feed = Feed(wire.Subscribed(stream_id=1, world="w"), topologies(3))
        self.feed.expect()
        self.feed.layout(layout_message(3))
        self.reader = self.feed.join()

    def frame(self, tick: int) -> None:
        self.feed.frame(frame_pb2.Frame(stream_id=1, layout_id=5, tick=tick, payload=bytes(36)))

    def taken(self, reader: Reader | None = None) -> list[Frame]:
        async def all_of() -> list[Frame]:
            frames = []
            while (reader or self.reader).frames:
                frame = await (reader or self.reader).next()
                assert frame
                frames.append(frame)
            return frames

        return asyncio.run(all_of())


def test_a_reader_that_is_late_loses_the_oldest_frames_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(feed_module, "frames_kept", 4)
    stream = Stream()
    for tick in range(10):
        stream.frame(tick)
    frames = stream.taken()
    assert [frame.tick for frame in frames] == [6, 7, 8, 9]
    assert [frame.missed for frame in frames] == [(0, 5), None, None, None]


def test_large_frames_are_bounded_by_their_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(feed_module, "frame_bytes_kept", 100)
    stream = Stream()
    for tick in range(5):
        stream.frame(tick)
    assert [frame.tick for frame in stream.taken()] == [3, 4]
    assert stream.reader.bytes == 0


def test_gaps_and_events_come_with_the_frame_after_them() -> None:
    stream = Stream()
    stream.frame(1)
    stream.feed.gap(frame_pb2.Gap(stream_id=1, from_tick=2, to_tick=4))
    stream.feed.gap(frame_pb2.Gap(stream_id=1, from_tick=5, to_tick=6))
    stream.feed.event(Event(world="w", kind=Event.BODY_BURST, body="body-0", tick=6))
    stream.feed.event(Event(world="another", kind=Event.BODY_BURST))
    stream.feed.event(Event(world="w", kind=77))  # type: ignore[arg-type]
    stream.frame(7)
    first, second = stream.taken()
    assert (first.missed, first.events) == (None, ())
    assert second.missed == (2, 6)
    assert [(event.kind, event.body) for event in second.events] == [("BODY_BURST", "body-0"), ("KIND_UNSPECIFIED", "")]


def test_who_asks_for_the_same_joins_at_the_last_frame() -> None:
    stream = Stream()
    stream.frame(1)
    stream.frame(2)
    stream.feed.expect()
    second = stream.feed.join()
    stream.frame(3)
    assert [frame.tick for frame in stream.taken(second)] == [2, 3]
    assert [frame.tick for frame in stream.taken()] == [1, 2, 3]
    assert not stream.feed.leave(second)
    stream.feed.expect()  # a reply that has come for one who has not joined yet
    assert not stream.feed.leave(stream.reader)


def test_a_stream_ends_with_its_world_and_breaks_with_its_connection() -> None:
    stream = Stream()
    stream.frame(1)
    stream.feed.event(Event(world="w", kind=Event.WORLD_DESTROYED))
    assert len(stream.taken()) == 1
    assert asyncio.run(stream.reader.next()) is None
    broken = Stream()
    broken.frame(1)
    broken.feed.end(PneumaError("UNAVAILABLE", "broken"))
    assert len(broken.taken()) == 1
    with pytest.raises(PneumaError, match="broken"):
        asyncio.run(broken.reader.next())


@pytest.mark.parametrize("grid_step_m", [0.0, 1e-3], ids=["plain", "coded"])
def test_a_layout_of_an_unknown_topology_is_refused(grid_step_m: float) -> None:
    feed = Feed(wire.Subscribed(stream_id=1, world="w", grid_step_m=grid_step_m), topologies(3))
    with pytest.raises(PneumaError, match="MALFORMED: the topology 04 of body-1 was not told"):
        feed.layout(layout_message(3, 4))


def test_decoding_refuses_a_layout_of_an_unknown_topology() -> None:
    decoding = Decoding(wire.Subscribed(stream_id=1, world="w", grid_step_m=1e-3))
    with pytest.raises(PneumaError, match="MALFORMED: the topology 04 of body-0 was not told"):
        decoding.layout(layout_message(4), {})


def test_a_frame_of_an_unknown_layout_is_refused() -> None:
    with pytest.raises(PneumaError, match="the layout 6"):
        Stream().feed.frame(frame_pb2.Frame(stream_id=1, layout_id=6))
