"""Streams of the real server: the frames are the states, within the bound that was asked for."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Iterator

import numpy as np
import pytest

import pneuma
from pneuma import PneumaError, Server, Stream, World, wire
from pneuma._proto import frame_pb2


@pytest.fixture
def world(shared: Server) -> Iterator[World]:
    with shared.world("five-balls", paused=True) as world:
        yield world


@pytest.mark.parametrize("plain", [False, True], ids=["coded", "plain"])
@pytest.mark.parametrize("max_error", [0.0, 1e-4, 1e-2])
def test_a_frame_is_the_state_within_the_bound(world: World, max_error: float, plain: bool) -> None:
    with world.stream(max_error=max_error, velocities=True, scalars=True, plain=plain) as frames:
        for _ in range(20):
            state = world.step(7, velocities=True)
            frame = next(frame for frame in frames if frame.tick == state.tick)
            assert frame.time_s == pytest.approx(state.time_s)
            for name, body in state.soft.items():
                off = np.linalg.norm(frame[name].positions - body.positions, axis=1).max()
                assert off <= max_error + 1e-6
                velocities = frame[name].velocities
                assert body.velocities is not None and velocities is not None
                slower = np.linalg.norm(velocities - body.velocities, axis=1).max()
                assert slower <= 60 * max_error + 1e-5
                assert frame[name].volume_m3 == pytest.approx(body.volume_m3)
                assert frame[name].pressure_pa == pytest.approx(body.pressure_pa, rel=1e-4)


def test_frames_have_triangles_and_solids(world: World) -> None:
    with world.stream() as frames:
        frame = next(frames)
    assert frame.positions.shape == (5 * 162, 3)
    for body in frame.bodies.values():
        assert body.faces.shape == (320, 3)
        # Faces run counter-clockwise seen from outside: the volume within them is positive, about that of a ball.
        a, b, c = (body.positions[body.faces[:, i]] for i in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.1)
    assert set(frame.solids) == {"room"}


def test_a_name_that_a_frame_has_not_is_told(world: World) -> None:
    with world.stream() as frames:
        frame = next(frames)
    with pytest.raises(KeyError, match="no soft body ball .there are ball-1, ball-2"):
        frame["ball"]
    with pytest.raises(KeyError, match="it is rigid, or a collider: frame.solids has it"):
        frame["room"]
    with pytest.raises(KeyError, match="no rigid body or collider floor .there are room."):
        frame.solids["floor"]


def test_a_stream_says_of_what_world(world: World) -> None:
    assert repr(world.stream()) == "<Stream of five-balls>"
    assert repr(world.touches()) == "<TouchStream of five-balls>"


def test_a_running_world_is_streamed_as_it_runs(world: World) -> None:
    world.resume()
    ticks = [frame.tick for frame in itertools.islice(world.stream(max_error=1e-3, rate_hz=30), 8)]
    assert all(later - earlier >= 2 for earlier, later in itertools.pairwise(ticks))


def test_some_bodies_coarser(world: World) -> None:
    with world.stream(bodies=["ball-2"], level_of_detail=1) as frames:
        frame = next(frames)
        assert list(frame.bodies) == ["ball-2"] and len(frame["ball-2"].positions) == 41
        assert frames.subscribed.rate_hz == 60


def test_contacts_name_what_holds(shared: Server) -> None:
    with shared.world("bouncing-ball", paused=True) as world, world.stream(contacts=True) as frames:
        next(frames)
        tick = world.run_until(touch=("ball", "floor")).tick
        world.step()
        frame = next(frame for frame in frames if frame.tick > tick)
        assert frame.contacts and {(contact.body, contact.other) for contact in frame.contacts} == {("ball", "floor")}
        assert frame.contacts[0].normal == pytest.approx([0, 1, 0], abs=1e-6)


def test_what_happens_comes_with_the_frames(shared: Server) -> None:
    with shared.world("bouncing-ball", paused=True) as world, world.stream() as frames:
        next(frames)
        world.reset()
        frame = next(frame for frame in frames if frame.events)
        assert [event.kind for event in frame.events] == ["WORLD_RESET"]


def test_an_edit_brings_another_layout(world: World) -> None:
    with world.stream() as frames:
        assert len(next(frames).bodies) == 5
        world.edit({"remove_soft_body": "ball-3"})
        assert "ball-3" not in next(frame for frame in frames if len(frame.bodies) == 4).bodies


def test_a_stream_ends_with_its_world(shared: Server) -> None:
    world = shared.world("bouncing-ball", paused=True)
    frames = iter(world.stream())
    next(frames)
    world.destroy()
    assert list(frames) == []


def test_a_stream_that_nobody_holds_is_unsubscribed(shared: Server, world: World) -> None:
    def streams() -> int:
        return len(world.stats().streams)

    for _ in world.stream(rate_hz=10):
        break
    assert streams() == 0
    with world.stream() as first, world.stream() as second:
        assert next(first).tick == next(second).tick
        assert streams() == 1
        first.close()
        world.step()
        assert next(second).tick == 1
    assert streams() == 0


def test_what_is_refused_is_told(world: World) -> None:
    with pytest.raises(PneumaError, match="NOT_FOUND"):
        next(world.stream(bodies=["no such"]))
    with pytest.raises(PneumaError, match="has not begun"):
        world.stream().subscribed


def test_a_closed_stream_has_no_frames(world: World) -> None:
    stream: Stream = world.stream()
    with stream:
        next(stream)
    assert next(stream, None) is None


def test_a_stream_breaks_with_its_server() -> None:
    with pneuma.serve() as server:
        frames = server.world("bouncing-ball", paused=True).stream()
        assert next(frames).tick == 0
        server.close()
        with pytest.raises(PneumaError, match="the server was closed"):
            next(frames)


def test_the_wire_of_a_plain_stream(world: World) -> None:
    """No frame builds on another, and a bound is told by integers."""
    assert wire.Subscribe.PLAIN == 1
    with world.stream(max_error=1e-3, plain=True) as frames:
        next(frames)
        assert frames.subscribed.max_error_m == 1e-3 and frames.subscribed.grid_step_m == 0


@pytest.mark.parametrize("level_of_detail", [0, 1])
def test_coded_frames_are_the_plain_ones_within_the_bound(world: World, level_of_detail: int) -> None:
    """Of a running world, side by side: every vertex, every velocity, the solids and what they touch."""
    asked = {"velocities": True, "scalars": True, "contacts": True, "level_of_detail": level_of_detail}
    with world.stream(**asked) as plain, world.stream(max_error=1e-3, **asked) as coded:  # type: ignore[arg-type]
        assert next(coded).tick == next(plain).tick == 0
        assert coded.subscribed.grid_step_m > 0 and plain.subscribed.grid_step_m == 0
        world.resume()
        theirs = {frame.tick: frame for frame in itertools.islice(plain, 60)}
        compared = 0
        for frame in itertools.islice(coded, 60):
            true = theirs.get(frame.tick)
            if true is None:
                continue
            compared += 1
            assert frame.time_s == pytest.approx(true.time_s) and list(frame.bodies) == list(true.bodies)
            assert np.linalg.norm(frame.positions - true.positions, axis=1).max() <= 1e-3 + 1e-6
            assert frame.velocities is not None and true.velocities is not None
            off = np.linalg.norm(frame.velocities - true.velocities, axis=1).max()
            assert off <= coded.subscribed.max_velocity_error_m_s + 1e-5
            for name, body in true.bodies.items():
                assert np.array_equal(frame[name].faces, body.faces) and frame[name].volume_m3 == body.volume_m3
            assert frame.solids["room"].orientation == pytest.approx(true.solids["room"].orientation)
            assert len(frame.contacts) == len(true.contacts)
        assert compared > 40


def test_an_edit_brings_another_layout_of_coded_frames(world: World) -> None:
    with world.stream(max_error=1e-3) as frames:
        next(frames)
        world.step(5)
        world.edit({"remove_soft_body": "ball-3"})
        state = world.step(5)
        frame = next(frame for frame in frames if frame.tick == state.tick)
        assert list(frame.bodies) == list(state)
        for name, body in state.soft.items():
            assert np.linalg.norm(frame[name].positions - body.positions, axis=1).max() <= 1e-3 + 1e-6


def test_who_joins_late_gets_the_last_coded_frame(world: World) -> None:
    with world.stream(max_error=1e-3) as first:
        next(first)
        state = world.step(5)
        next(frame for frame in first if frame.tick == state.tick)
        with world.stream(max_error=1e-3) as second:
            frame = next(second)
            assert frame.tick == state.tick
            assert np.linalg.norm(frame["ball-1"].positions - state["ball-1"].positions, axis=1).max() <= 1e-3 + 1e-6


def test_a_reader_that_has_gone_wrong_asks_for_a_key_frame(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    """A byte of a frame is changed on its way: nothing of it is shown, and the next frames are right again."""
    with world.stream(max_error=1e-3) as frames:
        next(frames)
        feed = frames._inner._feed
        assert feed
        whole = feed.frame
        spoilt: list[int] = []

        def spoil(message: frame_pb2.Frame) -> None:
            if message.HasField("base_tick") and not spoilt:
                spoilt.append(message.tick)
                message.check ^= 1
            whole(message)

        monkeypatch.setattr(feed, "frame", spoil)
        world.resume()
        read = list(itertools.islice(frames, 20))
        world.pause()
        assert spoilt and spoilt[0] not in [frame.tick for frame in read]
        assert spoilt[0] in [frame.missed[0] for frame in read if frame.missed]
        state = world.step()
        frame = next(frame for frame in frames if frame.tick == state.tick)
        assert np.linalg.norm(frame["ball-1"].positions - state["ball-1"].positions, axis=1).max() <= 1e-3 + 1e-6


def test_coded_frames_with_async_for() -> None:
    async def watch() -> float:
        async with pneuma.aio.serve() as server:
            world = await server.world("bouncing-ball", paused=True)
            async with world.stream(max_error=1e-3) as frames:
                state = await world.step(9)
                async for frame in frames:
                    if frame.tick == state.tick:
                        return float(np.abs(frame["ball"].positions - state["ball"].positions).max())
        return 1.0

    assert asyncio.run(watch()) <= 1e-3 + 1e-6
