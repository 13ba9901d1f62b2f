"""Recordings: what was streamed comes back from the file, whole or cut off."""

from __future__ import annotations

import asyncio
import dataclasses
import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import pneuma
from pneuma import PneumaError, Server, World, _native, wire
from pneuma._proto import frame_pb2, recording_pb2
from pneuma.aio import recorder as recorder_module
from pneuma.aio.connection import Address

from fake_server import FakeServer

max_error_m = 1e-3


@pytest.fixture
def world(shared: Server) -> Iterator[World]:
    with shared.world("five-balls", paused=True) as world:
        yield world


def test_a_recording_is_what_the_world_did(world: World, tmp_path: Path) -> None:
    path = tmp_path / "five.pneuma"
    with world.record(path, velocities=True) as recorder:
        states = [world.state(velocities=True), *(world.step(3, velocities=True) for _ in range(20))]
    recording = pneuma.read(path)
    assert recorder.frames == len(recording)
    assert (recording.world, recording.scene.name, recording.damage) == (world.name, "five-balls", "")
    assert recording.max_error_m == max_error_m and recording.bodies == tuple(states[0])
    assert recording.ticks[0] == 0 and recording.ticks[-1] == 60
    rows = {int(tick): row for row, tick in enumerate(recording.ticks)}
    compared = 0
    for state in states:
        if state.tick not in rows:
            continue
        compared += 1
        row = rows[state.tick]
        assert recording.times_s[row] == pytest.approx(state.time_s)
        for name, body in state.soft.items():
            recorded = recording[name]
            assert recorded.positions.shape == (len(recording), 162, 3)
            assert np.linalg.norm(recorded.positions[row] - body.positions, axis=1).max() <= max_error_m + 1e-6
            assert recorded.velocities is not None and body.velocities is not None
            assert np.linalg.norm(recorded.velocities[row] - body.velocities, axis=1).max() <= 60 * max_error_m + 1e-5
            assert recorded.volume_m3 is not None and recorded.volume_m3[row] == pytest.approx(body.volume_m3)
            assert recorded.pressure_pa is not None
            assert recorded.pressure_pa[row] == pytest.approx(body.pressure_pa, rel=1e-4)
    assert compared == len(states)


@pytest.mark.parametrize("rate_hz", [60.0, 20.0])
def test_no_frame_is_lost_of_what_the_recorder_steps(world: World, tmp_path: Path, rate_hz: float) -> None:
    with world.record(tmp_path / "five.pneuma", rate_hz=rate_hz) as recorder:
        state = recorder.step(300)
        assert state.tick == 300 and state.state_hash == world.state().state_hash
    recording = pneuma.read(tmp_path / "five.pneuma")
    assert recording.ticks.tolist() == list(range(0, 301, round(60 / rate_hz)))
    assert not any(frame.missed for frame in recording.frames)


def test_columns_make_a_table(world: World, tmp_path: Path) -> None:
    with world.record(tmp_path / "five.pneuma"):
        state = world.step()
    table = pneuma.read(tmp_path / "five.pneuma").columns()
    assert list(table)[:6] == ["tick", "time_s", "ball-1.x_m", "ball-1.y_m", "ball-1.z_m", "ball-1.volume_m3"]
    assert {column.shape for column in table.values()} == {(2,)}
    assert table["ball-2.y_m"][-1] == pytest.approx(state["ball-2"].centre_of_mass[1], abs=max_error_m)


def test_bodies_that_come_and_go_are_nan_elsewhere(shared: Server, tmp_path: Path) -> None:
    path = tmp_path / "edited.pneuma"
    with shared.world("five-balls", paused=True) as world, world.record(path, bodies=["ball-3", "ball-4"]):
        world.step()
        world.edit({"remove_soft_body": "ball-3"})
        world.step()
    recording = pneuma.read(path)
    gone = np.isnan(recording["ball-3"].positions).all(axis=(1, 2))
    assert gone.any() and np.array_equal(gone, np.arange(len(recording)) >= np.argmax(gone))
    assert not np.isnan(recording["ball-4"].positions).any()
    with pytest.raises(KeyError, match="no soft body ball-1 .there are ball-3, ball-4"):
        recording["ball-1"]


def test_a_body_of_two_meshes_is_in_the_frames(shared: Server, tmp_path: Path) -> None:
    from test_world import ball, scene

    path = tmp_path / "edited.pneuma"
    finer = pneuma.Mesh(name="finer", icosphere=pneuma.Mesh.Icosphere(subdivisions=2, radius_m=0.5))
    other = ball()
    other.mesh = "finer"
    with shared.world(scene(ball()), paused=True) as world, world.record(path):
        world.step()
        world.edit({"remove_soft_body": "ball"}, finer, other)
        world.step()
    recording = pneuma.read(path)
    assert {len(frame["ball"].positions) for frame in recording.frames} == {42, 162}
    with pytest.raises(PneumaError, match="FAILED_PRECONDITION: ball has 42 and then 162 vertices"):
        recording["ball"]
    heights = [frame["ball"].positions[:, 1].mean() for frame in recording.frames]
    assert np.allclose(recording.columns()["ball.y_m"], heights, rtol=0, atol=1e-5)


def test_a_mesh_of_as_many_vertices_is_another_mesh(world: World, tmp_path: Path) -> None:
    """The arrays have one list of faces, which would be that of the first mesh."""
    with world.record(tmp_path / "five.pneuma"):
        world.step()
    recording = pneuma.read(tmp_path / "five.pneuma")
    assert recording["ball-1"].positions.shape == (2, 162, 3)
    last = recording.frames[-1]
    turned = dataclasses.replace(last["ball-1"], faces=last["ball-1"].faces[:, ::-1])
    changed = dataclasses.replace(last, bodies={**last.bodies, "ball-1": turned})
    edited = dataclasses.replace(recording, frames=(recording.frames[0], changed))
    with pytest.raises(PneumaError, match="FAILED_PRECONDITION: ball-1 has several meshes of 162 vertices"):
        edited["ball-1"]
    assert edited["ball-2"].positions.shape == (2, 162, 3)


def test_events_are_recorded(world: World, tmp_path: Path) -> None:
    path = tmp_path / "reset.pneuma"
    with world.record(path):
        world.step(3)
        world.reset()
        world.step(2)
    recording = pneuma.read(path)
    assert [event.kind for event in recording.events] == ["WORLD_RESET"]
    assert recording.times_s.max() == pytest.approx(3 / 60) and recording.times_s[-1] == pytest.approx(2 / 60)


def test_a_file_that_was_cut_off_is_read_up_to_there(world: World, tmp_path: Path) -> None:
    path = tmp_path / "whole.pneuma"
    with world.record(path):
        for _ in range(10):
            world.step()
    whole = pneuma.read(path)
    cut = tmp_path / "cut.pneuma"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    part = pneuma.read(cut)
    assert 0 < len(part) < len(whole) and "cut off" in part.damage
    first = slice(0, len(part))
    assert np.array_equal(part["ball-1"].positions, whole["ball-1"].positions[first])


def test_what_is_no_recording_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.pneuma").write_bytes(b"something else, that is long enough for a header")
    with pytest.raises(PneumaError, match="INVALID_ARGUMENT: is no recording"):
        pneuma.read(tmp_path / "a.pneuma")
    with pytest.raises(PneumaError, match="NOT_FOUND"):
        pneuma.read(tmp_path / "b.pneuma")


def test_a_file_that_is_there_stays(world: World, tmp_path: Path) -> None:
    path = tmp_path / "a.pneuma"
    path.write_text("mine")
    with pytest.raises(PneumaError, match="ALREADY_EXISTS"):
        world.record(path)
    assert path.read_text() == "mine"
    with world.record(path, replace=True):
        world.step()
    assert len(pneuma.read(path)) == 2


def test_what_is_refused_is_told_before_there_is_a_file(world: World, tmp_path: Path) -> None:
    with pytest.raises(PneumaError, match="NOT_FOUND"):
        world.record(tmp_path / "a.pneuma", bodies=["no such"])
    assert not (tmp_path / "a.pneuma").exists()


def test_a_world_that_ends_ends_its_recording(shared: Server, tmp_path: Path) -> None:
    world = shared.world("bouncing-ball", paused=True)
    with world.record(tmp_path / "a.pneuma"):
        world.step(2)
        world.destroy()
    recording = pneuma.read(tmp_path / "a.pneuma")
    assert recording.ticks[-1] == 2 and recording.damage == ""
    # No frame comes after that.
    assert [event.kind for event in recording.events] == ["WORLD_DESTROYED"]


def test_what_comes_after_the_last_frame_is_read(world: World, tmp_path: Path) -> None:
    """Of a file with an event, a gap and another event at its end."""
    with world.record(tmp_path / "whole.pneuma"):
        world.step(2)
    reader = _native.RecordingReader(str(tmp_path / "whole.pneuma"))
    writer = _native.RecordingWriter(str(tmp_path / "longer.pneuma"), reader.header, False)
    for data in iter(reader.next, None):
        writer.append(data)
    stream_id = recording_pb2.RecordingHeader.FromString(reader.header).stream.stream_id
    burst = wire.Event(world=world.name, kind=wire.Event.BODY_BURST, body="ball-1", tick=2)
    gap = frame_pb2.Gap(stream_id=stream_id, from_tick=3, to_tick=5)
    frozen = wire.Event(world=world.name, kind=wire.Event.BODY_FROZEN, body="ball-2", tick=5)
    for message in (wire.ServerMessage(event=burst), wire.ServerMessage(gap=gap), wire.ServerMessage(event=frozen)):
        writer.append(message.SerializeToString())
    writer.finish()
    recording = pneuma.read(tmp_path / "longer.pneuma")
    assert [(event.kind, event.body) for event in recording.events] == [
        ("BODY_BURST", "ball-1"),
        ("BODY_FROZEN", "ball-2"),
    ]
    assert recording.missed == ((3, 5),) and recording.ticks[-1] == 2


def test_changes_are_recorded(world: World, tmp_path: Path) -> None:
    path = tmp_path / "changed.pneuma"
    with world.record(path):
        world.step(3)
        world["ball-1"].kick((3, 0, 0))
        with world["ball-2"].grab((0, 3, 0), vertex=5):
            world.step(2)
        world.gravity = (0, -1.62, 0)
        world.step()
    changes = pneuma.read(path).changes
    assert [(change.kind, change.tick) for change in changes] == [
        ("impulse", 3),
        ("grab", 3),
        ("release_grab", 5),
        ("edit", 5),
    ]
    impulse, grab, release, _ = changes
    assert (impulse.request.body, impulse.request.impulse.x) == ("ball-1", 3)
    assert impulse.grab_id == 0 and grab.grab_id == release.request.grab_id != 0


def test_a_frame_that_does_not_come_stops_the_steps(
    fake: FakeServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a server that steps, and streams nothing. To close asks for a frame too, which is no error."""
    monkeypatch.setattr(recorder_module, "frame_patience_s", 0.05)
    stats = wire.Stats(rate_hz=60, tick=7)
    replies = {
        "hello": wire.ServerMessage(welcome=fake.welcome),
        "get_stats": wire.ServerMessage(stats=stats),
        "get_scene": wire.ServerMessage(scene=wire.SceneReply()),
        "subscribe": wire.ServerMessage(subscribed=wire.Subscribed(stream_id=1, world="w", rate_hz=60)),
        "step": wire.ServerMessage(done=wire.Done(tick=7)),
    }

    def answer(message: wire.ClientMessage) -> list[wire.ServerMessage]:
        fake.answers.append(answer)
        reply = wire.ServerMessage(request_id=message.request_id)
        reply.MergeFrom(replies[message.WhichOneof("request") or ""])
        return [reply]

    async def record() -> None:
        fake.answers.append(answer)
        host, _, port = fake.address.rpartition(":")
        async with await recorder_module.Recorder.open(
            Address(host, int(port)), "w", tmp_path / "a.pneuma", wire.Subscribe(world="w"), replace=False
        ) as recorder:
            with pytest.raises(PneumaError, match="UNAVAILABLE: the frame of tick 7 has not come"):
                await recorder.step()
            assert recorder.frames == 0

    asyncio.run(record())


@pytest.fixture
def no_room() -> Iterator[None]:
    """No file of this program may grow past a few frames, as on a disk that is full. The server's may."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_steps_stop_where_the_file_cannot_be_written(
    world: World, tmp_path: Path, no_room: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each frame is written at once: so the file holds those that there was room for."""
    monkeypatch.setattr(recorder_module, "flush_interval_s", 0.0)
    path = tmp_path / "full.pneuma"
    with world.record(path) as recorder:
        with pytest.raises(PneumaError, match="UNAVAILABLE: File too large .*full.pneuma") as full:
            recorder.step(6000)
        assert full.value.where == str(path)
        stopped = world.state().tick
        assert 0 < stopped < 6000
        # It is told once, and a recording that has ended takes no step.
        with pytest.raises(PneumaError, match="FAILED_PRECONDITION: the recording of .*full.pneuma has ended"):
            recorder.step()
        assert world.step().tick == stopped + 1
        assert repr(recorder).endswith("full.pneuma, ended>")
    recording = pneuma.read(path)
    assert recording.damage and recording.world == world.name
    assert recording.ticks.tolist() == list(range(len(recording))) and len(recording) > 1


def test_a_write_that_failed_is_told_at_the_end(world: World, tmp_path: Path, no_room: None) -> None:
    """Where the world is stepped, or runs, without the recorder."""
    recorder = world.record(tmp_path / "full.pneuma")
    assert world.step(600).tick == 600
    with pytest.raises(PneumaError, match="File too large"):
        recorder.close()
    recorder.close()


def test_a_write_that_failed_does_not_hide_a_blocks_own_error(world: World, tmp_path: Path, no_room: None) -> None:
    with pytest.raises(ValueError, match="mine") as raised, world.record(tmp_path / "full.pneuma"):
        world.step(600)
        raise ValueError("mine")
    (note,) = raised.value.__notes__
    assert note.startswith("At the block's end: UNAVAILABLE: File too large")


def test_a_write_that_failed_is_a_note_with_await_too(tmp_path: Path, no_room: None) -> None:
    async def record() -> None:
        async with pneuma.aio.serve() as server:
            world = await server.world("five-balls", paused=True)
            async with await world.record(tmp_path / "full.pneuma"):
                await world.step(600)
                raise ValueError("mine")

    with pytest.raises(ValueError, match="mine") as raised:
        asyncio.run(record())
    (note,) = raised.value.__notes__
    assert "File too large" in note


def test_a_recorder_says_what_it_records(world: World, tmp_path: Path) -> None:
    with world.record(tmp_path / "five.pneuma") as recorder:
        recorder.step(2)
        assert repr(recorder) == f"<Recorder of five-balls: 3 frames in {tmp_path / 'five.pneuma'}>"
    with pytest.raises(PneumaError, match="FAILED_PRECONDITION.*has ended .recorder.step"):
        recorder.step()
    assert world.state().tick == 2


def test_a_recording_with_await(tmp_path: Path) -> None:
    async def record() -> None:
        async with pneuma.aio.serve() as server:
            world = await server.world("bouncing-ball", paused=True)
            async with await world.record(tmp_path / "a.pneuma") as recorder:
                await world.step(4)
            assert recorder.frames >= 2

    asyncio.run(record())
    assert pneuma.read(tmp_path / "a.pneuma").ticks[-1] == 4


def test_a_recording_whose_end_is_cancelled_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The connection takes its time to close."""

    async def record() -> None:
        async with pneuma.aio.serve() as server:
            world = await server.world("bouncing-ball", paused=True)
            recorder = await world.record(tmp_path / "a.pneuma")
            await recorder.step(4)
            closing, is_closing = recorder._connection.close, asyncio.Event()

            async def close_late() -> None:
                is_closing.set()
                await asyncio.sleep(60.0)

            monkeypatch.setattr(recorder._connection, "close", close_late)
            ending = asyncio.create_task(recorder.close())
            await asyncio.wait_for(is_closing.wait(), 10.0)
            ending.cancel()
            with pytest.raises(asyncio.CancelledError):
                await ending
            await closing()

    asyncio.run(record())
    recording = pneuma.read(tmp_path / "a.pneuma")
    assert recording.ticks[-1] == 4 and not recording.damage
