"""Worlds of the real server: stepped, waited for, changed, put elsewhere, saved. Checked by mechanics or by bits."""

from __future__ import annotations

import math
import pickle
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pneuma
from pneuma import (
    Collider,
    Gas,
    Mesh,
    NotReached,
    PneumaError,
    RigidBody,
    RigidBodyChange,
    Scene,
    Server,
    Shape,
    SoftBody,
    SoftBodyChange,
    Springs,
    Stepping,
    World,
    triangles,
    wire,
)
from pneuma.notebook import table_of
from pneuma.testing import assert_hash, near

g_m_s2 = 9.81
tick_s = 1 / 60


def ball(name: str = "ball", height_m: float = 2.0) -> SoftBody:
    springs = Springs(stiffness_n_m=200, damping_n_s_m=0.5)
    return SoftBody(name=name, mesh="ball", position=(0, height_m, 0), springs=springs, gas=Gas(moles=0.028))


def scene(*parts: SoftBody | RigidBody | Collider, gravity: float = -g_m_s2) -> Scene:
    mesh = Mesh(name="ball", icosphere=Mesh.Icosphere(subdivisions=1, radius_m=0.5))
    return Scene(name="test", gravity=(0, gravity, 0), stepping=Stepping(precision="DOUBLE")).add(mesh, *parts)


@pytest.fixture
def world(shared: Server) -> Iterator[World]:
    """A ball 2 m up, a stone beside it, and a floor."""
    stone = RigidBody(name="stone", shape=Shape.Sphere(radius_m=0.1), position=(3, 5, 0))
    with shared.world(scene(ball(), stone, Collider(name="floor", shape=Shape.Plane())), paused=True) as world:
        yield world


def test_a_step_tells_the_state_of_its_last_tick(world: World) -> None:
    """A stone in free fall is where Galileo says, and the state is the one that is asked for afterwards."""
    state = world.step(30)
    assert state.tick == 30 and state.time_s == pytest.approx(0.5)
    fallen_m = g_m_s2 * 0.5**2 / 2
    assert state.rigid["stone"] == near((3, 5 - fallen_m, 0), within_m=g_m_s2 * 0.5 * tick_s)
    assert state.rigid["stone"].velocity[1] == pytest.approx(-g_m_s2 * 0.5)
    assert_hash(world, state.state_hash)


def test_a_state_has_the_mesh_in_its_order(world: World) -> None:
    body = world.state(velocities=True, double_precision=True)["ball"]
    assert body.positions.shape == (42, 3) and body.positions.dtype == np.float64
    assert np.allclose(np.linalg.norm(body.positions - (0, 2, 0), axis=1), 0.5)
    assert body.centre_of_mass == pytest.approx(body.positions.mean(axis=0))
    assert body.velocities is not None and not body.velocities.any()
    single = world.state()["ball"]
    assert single.velocities is None and single.positions.dtype == np.float32
    assert np.array_equal(single.positions, body.positions.astype(np.float32))


def test_of_some_bodies(shared: Server) -> None:
    with shared.world(scene(ball("a", 2), ball("b", 4)), paused=True) as world:
        assert list(world.step(bodies=["b"])) == ["b"]
        assert list(world.state(bodies="a")) == ["a"]
        assert len(world.state()) == 2 and "b" in world.state()
        with pytest.raises(PneumaError, match="NOT_FOUND"):
            world.state(bodies=["c"])


def test_a_name_that_a_state_has_not_is_told(world: World) -> None:
    with pytest.raises(KeyError, match="no soft body bal .there are ball."):
        world.state()["bal"]
    with pytest.raises(KeyError, match="it is a rigid body: state.rigid has it"):
        world.state()["stone"]
    state = pickle.loads(pickle.dumps(world.state()))  # a copy tells it too
    with pytest.raises(KeyError, match="no rigid body ston .there are stone."):
        state.rigid["ston"]


def test_a_kick_is_momentum(world: World) -> None:
    world.gravity = (0, 0, 0)
    before = world.state()["ball"].momentum
    world["ball"].kick((3, 0, -1))
    assert world.step()["ball"].momentum - before == pytest.approx([3, 0, -1], abs=1e-6)


@pytest.mark.parametrize("place", ["at", "vertex", "ray"])
def test_a_kick_at_a_place_turns_the_body(world: World, place: str) -> None:
    """Sideways at its top: momentum is the whole impulse, and the body turns about the axis of the lever arm."""
    world.gravity = (0, 0, 0)
    top = int(np.argmax(world.state()["ball"].positions[:, 1]))
    if place == "at":
        world["ball"].kick((1, 0, 0), at=(0, 3, 0), radius_m=0.2)
    elif place == "vertex":
        world["ball"].kick((1, 0, 0), vertex=top)
    else:
        world["ball"].kick((1, 0, 0), ray=((0, 5, 0), (0, -1, 0)))
    body = world.step()["ball"]
    assert body.momentum == pytest.approx([1, 0, 0], abs=1e-6)
    spin = body.angular_momentum - np.cross(body.centre_of_mass, body.momentum)
    assert spin[2] < -0.3 and abs(spin[0]) < 0.1


def test_two_places_are_refused(world: World) -> None:
    with pytest.raises(PneumaError, match="one at most"):
        world["ball"].kick((1, 0, 0), vertex=1, at=(0, 0, 0))


def test_a_place_that_is_none_is_told(world: World) -> None:
    wrong: Any = (0, 5, 0)
    with pytest.raises(PneumaError, match=r"is \(0, 5, 0\), not \(origin, direction\) \(impulse.ray\)"):
        world["ball"].kick((1, 0, 0), ray=wrong)
    wrong = 1.5
    with pytest.raises(PneumaError, match=r"is 1.5, not a whole number \(grab.vertex\)"):
        world["ball"].grab((1, 0, 0), vertex=wrong)
    of_numpy: Any = np.int64(7)
    with world["ball"].grab((0, 9, 0), vertex=of_numpy) as grab:
        assert grab.vertex == 7


def test_what_is_no_state_is_told(world: World) -> None:
    body: Any = world.state(velocities=True)["ball"]
    with pytest.raises(TypeError, match="set_state takes a State, as `step` and `state` return it, not <ball at"):
        world.set_state(body)


def test_gravity_is_told_and_set(world: World) -> None:
    assert world.gravity == (0, -g_m_s2, 0)
    world.gravity = np.array([0, -1.62, 0])
    assert world.gravity == (0, -1.62, 0)


def test_a_stone_falls_until_it_is_past_a_plane(world: World) -> None:
    state = world.run_until(past=("stone", (0, -1, 0), -3.0))
    assert state.rigid["stone"].position[1] < 3.0
    assert state.tick == pytest.approx(math.sqrt(2 * 2 / g_m_s2) / tick_s, abs=2)


def test_a_ball_falls_until_it_touches_the_floor(world: World) -> None:
    state = world.run_until(touch=("ball", "floor"), double_precision=True)
    assert state["ball"].positions[:, 1].min() < 0.05
    assert state.tick == pytest.approx(math.sqrt(2 * 1.5 / g_m_s2) / tick_s, abs=3)


def test_until_a_tick(world: World) -> None:
    assert world.run_until(tick=17).tick == 17
    assert world.run_until(tick=17).tick == 17
    assert world.run_until(tick=3).tick == 17  # it is past that tick, and steps no further


def test_until_rest(shared: Server) -> None:
    with shared.world(scene(ball(height_m=0.6), Collider(name="floor", shape=Shape.Plane())), paused=True) as world:
        state = world.run_until(at_rest=True)
        assert state["ball"].asleep and "asleep" in repr(state["ball"])
        assert np.abs(world.step(60)["ball"].positions - state["ball"].positions).max() == 0


def test_what_is_not_reached_is_told_with_the_state(world: World) -> None:
    with pytest.raises(NotReached, match="^ball did not touch floor by tick 5$") as missed:
        world.run_until(touch=("ball", "floor"), ticks_max=5)
    assert missed.value.state.tick == 5


def run_away(world: World) -> None:
    """Freezes the ball: it leaves the bounds of coordinates, 1e7 m."""
    body = world.state()["ball"]
    far = body.positions.astype(np.float64) + (9.999e6, 0, 0)
    world["ball"].place_vertices(far, np.zeros_like(far) + (9e4, 0, 0))
    assert world.step(5)["ball"].frozen


def test_what_is_not_reached_names_bodies_that_are_frozen(world: World) -> None:
    run_away(world)
    frozen = 'by tick 10; "ball" is frozen: it ran away, and will not move until reset..$'
    with pytest.raises(NotReached, match="^ball did not touch floor " + frozen):
        world.run_until(touch=("ball", "floor"), ticks_max=5)
    world["stone"].place(position=(3, 0.1, 0), velocity=(0, 0, 0))  # it comes to rest, which the ball never does
    with pytest.raises(NotReached, match='^not every body was at rest .*; "ball" is frozen'):
        world.run_until(at_rest=True)
    world.reset()
    assert not world.step()["ball"].frozen


def test_a_body_that_is_frozen_shows_it(world: World) -> None:
    assert repr(world.state()) == "<State of test at tick 0: ball, stone>"
    run_away(world)
    state = world.state()
    assert repr(state) == "<State of test at tick 5: ball (frozen), stone>"
    assert repr(state["ball"]).endswith("m, 42 vertices, frozen>")


def test_not_reached_is_an_error_like_others(world: World) -> None:
    """With a code, a place and words that do not say that the goal was reached. It survives a copy."""
    with pytest.raises(PneumaError) as missed:
        world.run_until(at_rest=True, ticks_max=6)
    error = missed.value
    assert isinstance(error, NotReached)
    assert (error.code, error.where) == ("LIMIT_EXCEEDED", "step_until.ticks_max")
    assert str(error) == error.what == "not every body was at rest by tick 6"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    for goal, told in (
        ({"tick": 50}, "tick 50 was not reached"),
        ({"past": ("ball", (0, 1, 0), 9)}, "ball was not past"),
    ):
        with pytest.raises(NotReached, match=f"^{told}"):
            world.run_until(**goal, ticks_max=1)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "ticks, told",
    [(-1, "is -1"), (0, "is 0"), (1.5, "is 1.5, not a whole number"), (2**40, "is 1099511627776; .* below")],
)
def test_what_is_no_number_of_ticks_is_refused(world: World, ticks: Any, told: str) -> None:
    with pytest.raises(PneumaError, match=f"INVALID_ARGUMENT: {told}.*.step.ticks"):
        world.step(ticks)
    with pytest.raises(PneumaError, match=f"INVALID_ARGUMENT: {told}.*.run_until.ticks_max"):
        world.run_until(at_rest=True, ticks_max=ticks)
    assert world.step(np.int64(2)).tick == 2  # type: ignore[arg-type]


def test_one_thing_is_waited_for(world: World) -> None:
    for given in ({}, {"tick": 3, "at_rest": True}):
        with pytest.raises(PneumaError, match="one of tick, at_rest, touch and past"):
            world.run_until(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "given, where, told",
    [
        ({"touch": "ab"}, "touch", "is 'ab', not (first, second)"),
        ({"touch": ("ball",)}, "touch", "is ('ball',), not (first, second)"),
        ({"touch": ("ball", 3)}, "touch.second", "is 3, not text"),
        ({"past": ("ball", (0, 1, 0))}, "past", "not (body, normal, offset_m)"),
        ({"past": ("ball", (0, 1), 2.0)}, "past.normal", "has 2 numbers"),
    ],
)
def test_what_is_waited_for_is_told_where_it_is_wrong(world: World, given: Any, where: str, told: str) -> None:
    with pytest.raises(PneumaError) as refused:
        world.run_until(**given)
    assert (refused.value.code, refused.value.where) == ("INVALID_ARGUMENT", f"run_until.{where}")
    assert told in refused.value.what and world.state().tick == 0


def test_a_world_that_runs_is_not_stepped(world: World) -> None:
    world.resume(0.5)
    with pytest.raises(PneumaError, match="FAILED_PRECONDITION"):
        world.step()
    world.pause()
    tick = world.state().tick
    assert world.step().tick == tick + 1


def test_reset_goes_back(world: World) -> None:
    first = world.state()
    world.step(20)
    world.reset()
    state = world.state()
    assert state.time_s == 0 and np.array_equal(state["ball"].positions, first["ball"].positions)


def test_a_state_is_put_back_and_goes_on_as_it_did(world: World) -> None:
    start = world.step(10, velocities=True, double_precision=True)
    there = world.step(40, double_precision=True)
    world.set_state(start)
    again = world.step(40, double_precision=True)
    assert np.allclose(again["ball"].positions, there["ball"].positions, rtol=0, atol=1e-9)
    assert again.rigid["stone"] == near(there.rigid["stone"].position, within_m=1e-9)


def test_a_state_without_velocities_is_not_put_back_unless_asked(world: World) -> None:
    """Otherwise an episode would begin with the velocities that the one before it ended with."""
    start = world.step(10)
    world.step(10)
    with pytest.raises(ValueError, match="no velocities of ball: take it with velocities=True"):
        world.set_state(start)
    before = world.state(velocities=True, double_precision=True)["ball"]
    world.set_state(start, keep_velocities=True)
    after = world.state(velocities=True, double_precision=True)["ball"]
    assert before.velocities is not None and after.velocities is not None
    assert np.array_equal(after.velocities, before.velocities)
    assert np.array_equal(after.positions.astype(np.float32), start["ball"].positions)


def test_set_state_leaves_gas_and_time_and_edits_and_reset_does_not(world: World) -> None:
    start = world.step(5, velocities=True)
    first = start["ball"].moles
    world["ball"].change(SoftBodyChange(gas=Gas(moles=2 * first)))
    world.gravity = (0, 0, 0)
    world.step(5)
    world.set_state(start)
    state = world.state()
    assert np.array_equal(state["ball"].positions, start["ball"].positions)
    assert state["ball"].moles == pytest.approx(2 * first) and state.time_s > start.time_s
    assert world.gravity == (0, 0, 0)
    world.reset()
    assert world.state()["ball"].moles == pytest.approx(first) and world.state().time_s == 0
    assert world.gravity == (0, -g_m_s2, 0)


def test_set_state_leaves_grabs(world: World) -> None:
    """The one that holds the ball up holds it still, and is gone after a reset."""
    start = world.state(velocities=True)
    world["ball"].grab((0, 9, 0), vertex=0, stiffness_n_m=500)
    world.set_state(start)
    assert world.step(10)["ball"].momentum[1] > 0
    world.reset()
    assert world.step(10)["ball"].momentum[1] < 0


def test_a_method_for_bodies_of_the_other_kind_is_told(world: World) -> None:
    with pytest.raises(PneumaError, match='"ball" is soft: `place_vertices`'):
        world["ball"].place((0, 1, 0))
    with pytest.raises(PneumaError, match='"stone" is rigid: `place`'):
        world["stone"].place_vertices(np.zeros((4, 3)))
    with pytest.raises(PneumaError, match='NOT_FOUND: no such body "bal"'):
        world["bal"].place((0, 1, 0))
    assert repr(world["ball"]) == "<Body ball of the world test>"
    with world["ball"].grab((0, 9, 0), vertex=3) as grab:
        assert repr(grab) == "<Grab of vertex 3 of ball of the world test>"


@pytest.mark.parametrize("of", ["pneuma", "pneuma.aio"])
def test_misspelt_attributes_are_refused(world: World, of: str) -> None:
    misspelt: list[Any] = [world, world["ball"]]
    if of == "pneuma.aio":
        misspelt = [each._inner for each in misspelt]
    for each in misspelt:
        with pytest.raises(AttributeError, match="gravty"):
            each.gravty = (0, 0, 0)


def test_vertices_are_put_elsewhere(world: World) -> None:
    body = world.state(double_precision=True)["ball"]
    moved = body.positions + (1, 0, 0)
    world["ball"].place_vertices(moved, np.zeros((42, 3)) + (0, 0, 2))
    state = world.state(velocities=True, double_precision=True)["ball"]
    assert np.array_equal(state.positions, moved)
    assert state.momentum == pytest.approx([0, 0, 2])


@pytest.mark.parametrize("shape", [(41, 3), (42, 2), (42,)])
def test_vertices_of_another_shape_are_refused(world: World, shape: tuple[int, ...]) -> None:
    with pytest.raises(PneumaError) as refused:
        world["ball"].place_vertices(np.zeros(shape))
    assert refused.value.code == "INVALID_ARGUMENT" and "positions" in refused.value.where


def test_a_rigid_body_is_put_elsewhere(world: World) -> None:
    world["stone"].place(position=(1, 9, 1), velocity=(0, 2, 0))
    stone = world.state().rigid["stone"]
    assert stone == near((1, 9, 1), within_m=0) and stone.velocity.tolist() == [0, 2, 0]


def test_edits_add_change_and_remove(world: World) -> None:
    world.edit(ball("second", 4), {"set_wind": (0, 0, 0)})
    assert set(world.state()) == {"ball", "second"}
    world["second"].change(SoftBodyChange(mass_kg=3))
    world["stone"].change(RigidBodyChange(velocity=(0, 0, 7)))
    world["second"].kick((3, 0, 0))
    state = world.step()
    assert state["second"].momentum[0] == pytest.approx(3, abs=1e-6)
    assert state.rigid["stone"].velocity[2] == pytest.approx(7)
    world.edit({"remove_soft_body": "second"})
    assert set(world.state()) == {"ball"}


def test_an_edit_is_done_whole_or_not_at_all(world: World) -> None:
    with pytest.raises(PneumaError) as refused:
        world.edit(ball("second", 4), {"remove_soft_body": "no such"})
    assert refused.value.code == "NOT_FOUND" and refused.value.where.startswith("edit.edit.changes[1]")
    assert set(world.state()) == {"ball"}


def test_a_held_vertex_follows(world: World) -> None:
    world.gravity = (0, 0, 0)
    with world["ball"].grab((0, 3, 0), vertex=0, stiffness_n_m=500) as grab:
        assert (grab.body, grab.vertex) == ("ball", 0)
        world.step(10)
        grab.move((0, 6, 0))
        rising = world.step(30)["ball"].momentum[1]
        assert rising > 0
    free = world.step(1)["ball"].momentum[1]
    assert world.step(10)["ball"].momentum[1] == pytest.approx(free, abs=1e-6)


def test_a_held_patch_keeps_its_shape(world: World) -> None:
    world.gravity = (0, 0, 0)
    before = world.step(1)["ball"].positions
    corner = before[0]
    beside = ((before - corner) ** 2).sum(axis=1).argsort()[1:4]
    with world["ball"].grab(corner, vertex=0, stiffness_n_m=5e4, radius_m=0.6) as grab:
        grab.move(corner + (0, 1, 0))
        held = world.step(240)["ball"].positions
    assert held[0] == pytest.approx(corner + (0, 1, 0), abs=0.05)
    for vertex in beside:
        assert held[vertex] - held[0] == pytest.approx(before[vertex] - corner, abs=0.1)


def test_the_same_script_gives_the_same_bits(shared: Server) -> None:
    def run() -> int:
        with shared.world("five-balls", paused=True) as world:
            world.step(30)
            world["ball-1"].kick((3, 0, 0))
            return world.step(60).state_hash

    assert run() == run()


def test_a_saved_world_goes_on_as_it_was(shared: Server, world: World, tmp_path: Path) -> None:
    world.step(25)
    world.save(tmp_path / "w.world")
    with shared.restore(tmp_path / "w.world", name="again") as again:
        assert again.name == "again"
        assert again.step(50).state_hash == world.step(50).state_hash


def test_a_snapshot_is_restored_as_it_is(shared: Server, world: World) -> None:
    world.step(25)
    with shared.restore(world.snapshot(), name="again") as again:
        assert_hash(again, world.state().state_hash)


def test_a_large_world_is_saved_and_restored_in_parts(shared: Server, tmp_path: Path) -> None:
    """20,000 vertices: several megabytes both ways, past what one message holds."""
    n = 20_000
    angle = np.arange(n) * 0.001
    positions = np.stack([angle, np.sin(angle), np.cos(angle)], axis=1)
    faces = np.stack([np.arange(n - 2), np.arange(n - 2) + 1, np.arange(n - 2) + 2], axis=1)
    faces[1::2] = faces[1::2, ::-1]
    large = Scene(name="ribbon").add(triangles("m", positions, faces), SoftBody(name="ribbon", mesh="m"))
    with shared.world(large, paused=True) as world:
        assert np.allclose(world.state(double_precision=True)["ribbon"].positions, positions)
        world.save(tmp_path / "large.world")
        assert (tmp_path / "large.world").stat().st_size > 2**20
        with shared.restore(tmp_path / "large.world") as again:
            assert again.name == "ribbon-2"
            assert_hash(again, world.state().state_hash)


def test_a_saved_scene_makes_the_world_anew(shared: Server, world: World, tmp_path: Path) -> None:
    world.gravity = (0, -1.62, 0)
    world.save(tmp_path / "moon.json")
    with shared.world(tmp_path / "moon.json", name="moon", paused=True) as moon:
        assert moon.gravity == (0, -1.62, 0)
    assert Scene.load(tmp_path / "moon.json") == world.scene()


def test_a_file_that_is_no_scene_is_told_with_its_place(shared: Server, tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text("{]")
    with pytest.raises(PneumaError) as refused:
        shared.world(tmp_path / "bad.json")
    assert refused.value.code == "INVALID_ARGUMENT" and "line 1" in refused.value.where


def test_a_block_ends_though_what_it_was_about_is_gone(shared: Server, world: World) -> None:
    with world["ball"].grab((0, 3, 0), vertex=0):
        world.reset()
    with shared.world(scene(ball()), paused=True) as gone:
        gone.destroy()


def test_an_error_in_a_block_is_told_though_the_server_is_gone() -> None:
    server = pneuma.serve()
    with pytest.raises(ZeroDivisionError), server.world("bouncing-ball", paused=True):
        server.close()
        1 / 0


def test_a_branch_may_be_owned(shared: Server, world: World) -> None:
    with pneuma.connect(shared.address) as other:
        other[world.name].branch(name="owned", owned=True)
        assert "owned" in [each.name for each in shared.worlds()]
    until_s = time.monotonic() + 30
    while "owned" in [each.name for each in shared.worlds()]:
        assert time.monotonic() < until_s


def test_a_branch_goes_its_own_way(world: World) -> None:
    world.step(5)
    with world.branch(name="other", paused=True) as other:
        assert_hash(other, world.state().state_hash)
        other["ball"].kick((1, 0, 0))
        assert other.step().state_hash != world.step().state_hash


def test_rewind_goes_back_where_worlds_are_kept(tmp_path: Path) -> None:
    with pneuma.serve(data_dir=tmp_path) as server:
        world = server.world("bouncing-ball", paused=True)
        there = world.step(20)
        world.step(20)
        world.rewind(20)
        assert_hash(world, there.state_hash)


def test_owned_worlds_end_with_their_client(shared: Server) -> None:
    with pneuma.connect(shared.address) as other:
        other.world("bouncing-ball", name="mine", owned=True)
        other.world("bouncing-ball", name="everyones")
        assert {"mine", "everyones"} <= {world.name for world in shared.worlds()}
    end = time.monotonic() + 5.0
    while "mine" in {world.name for world in shared.worlds()}:
        assert time.monotonic() < end
    shared["everyones"].destroy()


def test_what_the_server_refuses_is_an_exception(shared: Server) -> None:
    with pytest.raises(PneumaError) as refused:
        shared.world(scene(SoftBody(name="b", mesh="ball", mass_kg=-1)))
    assert refused.value.code == "INVALID_ARGUMENT"
    assert refused.value.where == "create_world.scene.soft_bodies[0].mass_kg"
    with pytest.raises(PneumaError, match="NOT_FOUND"):
        shared["nowhere"].state()


def test_the_rate_of_requests_is_kept_by_waiting() -> None:
    """20 requests a second, a burst of 5: 15 requests take half a second, and none is refused."""
    with pneuma.serve(flags=["--commands-per-s", "20", "--commands-burst", "5"]) as server:
        world = server.world("bouncing-ball", paused=True)
        assert [world.step().tick for _ in range(15)] == list(range(1, 16))


def test_requests_without_a_method_go_by_call(shared: Server, world: World) -> None:
    request = wire.ClientMessage(get_stats=wire.GetStats(world=world.name))
    assert shared.call(request, wire.Stats).substeps > 0
    assert world.stats().integrator


def test_a_notebook_shows_a_table(world: World) -> None:
    html = world._repr_html_()
    assert f'<a href="{world.url}"' in html and html.count("<tr>") == 3
    state = world.state()["ball"]
    assert f"<td>ball</td><td>{state.volume_m3:.4g}</td><td>{state.pressure_pa:.4g}</td><td>0.000, 2.000, " in html


def test_a_notebook_takes_no_markup_from_a_name(shared: Server) -> None:
    with shared.world(scene(ball("<b>&")), paused=True) as world:
        assert "<td>&lt;b&gt;&amp;</td>" in table_of(world.stats(), world.url)


def test_show_opens_the_page(world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert opened == [world.show()] == [f"{world.url}"]
    assert world.url.startswith("http://127.0.0.1:") and world.url.endswith("/#world=test")
