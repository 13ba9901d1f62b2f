"""Rays, nearest places, boxes and touches of worlds of the real server, against what geometry and mechanics say."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest

import pneuma
from pneuma import (
    Collider,
    Mesh,
    PneumaError,
    RigidBody,
    Scene,
    Server,
    Shape,
    SoftBody,
    Springs,
    Stepping,
    Touch,
    World,
)

g_m_s2 = 9.81


@pytest.fixture
def world(shared: Server) -> Iterator[World]:
    """A soft ball around the origin, a stone beside it, and a floor 2 m below."""
    scene = Scene(name="places", stepping=Stepping(precision="DOUBLE")).add(
        Mesh(name="ball", icosphere=Mesh.Icosphere(subdivisions=3, radius_m=0.5)),
        SoftBody(name="ball", mesh="ball", springs=Springs(stiffness_n_m=200)),
        RigidBody(name="stone", shape=Shape.Sphere(radius_m=0.25), position=(3, 0, 0)),
        Collider(name="floor", shape=Shape.Plane(), position=(0, -2, 0)),
    )
    with shared.world(scene, paused=True) as world:
        yield world


def test_rays_meet_what_is_first(world: World) -> None:
    angles = np.linspace(0, 2 * math.pi, 37)[:-1]
    directions = np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=1)
    found = world.raycast((0, 0, 0), directions, bodies="ball")
    assert len(found) == 36 and found.found.all() and set(found.bodies) == {"ball"}
    assert found.distances == pytest.approx(0.5, abs=0.01)
    assert (np.einsum("ij,ij->i", found.normals, directions) > 0.9).all()
    state = world.state(double_precision=True)
    mesh = next(iter(world.stream())).bodies["ball"].faces[found.faces]
    corners = state["ball"].positions[mesh]
    assert np.einsum("ij,ijk->ik", found.weights, corners) == pytest.approx(found.positions, abs=1e-9)


def test_a_ray_that_meets_nothing_says_so(world: World) -> None:
    found = world.raycast([(0, 5, 0), (3, 5, 0), (9, 5, 0)], (0, -1, 0), length_m=6.5)
    assert found.bodies == ["ball", "stone", ""]
    assert found.found.tolist() == [True, True, False]
    assert found.distances[1:].tolist() == [pytest.approx(4.75), math.inf]
    assert np.isnan(found.positions[2]).all() and found.faces[1:].tolist() == [-1, -1]
    assert world.raycast((9, 5, 0), (0, -2, 0)).bodies == ["floor"]


def test_the_nearest_place_knows_inside_from_outside(world: World) -> None:
    found = world.nearest([(3, 0, 0.1), (3, 0, 1), (0, -1.5, 0)])
    assert found.bodies == ["stone", "stone", "floor"]
    assert found.distances == pytest.approx([-0.15, 0.75, 0.5])
    assert found.positions[1] == pytest.approx((3, 0, 0.25))
    assert world.nearest((0, 0, 0), bodies=["ball"]).distances == pytest.approx([-0.5], abs=0.01)
    assert not world.nearest((3, 0, 1), within_m=0.7).found.any()


def test_boxes_of_bodies(world: World) -> None:
    assert set(world.bodies_in_box((-9, -9, -9), (9, 9, 9))) == {"ball", "stone"}
    boxes = world.bodies_in_box((2.9, 0, 0), (2.9, 0, 0))
    assert set(boxes) == {"stone"}
    assert boxes["stone"][0] == pytest.approx((2.75, -0.25, -0.25))


def test_what_cannot_be_asked_is_named(world: World) -> None:
    with pytest.raises(PneumaError) as refused:
        world.raycast([(0, 0, 0), (1, 0, 0)], [(0, 1, 0), (0, 0, 0)])
    assert refused.value.where == "raycast.rays[1].direction"
    assert len(world.raycast([], (0, 1, 0))) == 0
    with pytest.raises(PneumaError, match="2 origins and 3 directions"):
        world.raycast([(0, 0, 0)] * 2, [(0, 1, 0)] * 3)
    with pytest.raises(PneumaError) as shape:
        world.nearest([(0, 0)])
    assert shape.value.where == "nearest.points"
    with pytest.raises(PneumaError) as nobody:
        world.nearest((0, 0, 0), bodies=["nobody"])
    assert nobody.value.code == "NOT_FOUND"
    with pytest.raises(PneumaError) as stranger:
        world.touches(bodies="nobody").open()
    assert stranger.value.where == "subscribe.touches.bodies[0]"


@pytest.fixture
def falling(shared: Server) -> Iterator[World]:
    """A stone of 1 kg that bounces 0.45 m below it."""
    bounce = pneuma.Surface(restitution=0.5)
    stone = RigidBody(name="stone", shape=Shape.Sphere(radius_m=0.05), position=(0, 0.5, 0), mass_kg=1, surface=bounce)
    scene = Scene(name="falling", gravity=(0, -g_m_s2, 0), stepping=Stepping(sleep=False))
    scene.add(stone, Collider(name="floor", shape=Shape.Plane()))
    with shared.world(scene, paused=True) as world:
        yield world


def kinds(touches: list[Touch]) -> list[str]:
    return [touch.kind for touch in touches]


def test_touches_begin_with_the_impulse_of_the_bounce(falling: World) -> None:
    with falling.touches() as touches:
        falling.step(10)
        assert touches.take() == []
        falling.step(20)
        began, ended = touches.take()
        assert (began.kind, began.first, began.second) == ("BEGAN", "stone", "floor")
        assert began.impulse_n_s == pytest.approx(1.5 * math.sqrt(2 * g_m_s2 * 0.45), rel=0.02)
        assert began.normal == pytest.approx((0, 1, 0)) and began.position == pytest.approx((0, 0, 0), abs=1e-3)
        assert ended.kind == "ENDED" and ended.tick > began.tick and ended.position is None
        assert touches.take() == [] and touches.dropped == 0


def test_touches_press_as_hard_as_asked_for(falling: World) -> None:
    falling.step(200)
    weight_n_s = g_m_s2 / 60
    with falling.touches(impulse_min_n_s=0.5 * weight_n_s) as touches:
        falling.step(3)
        told = touches.take()
    assert kinds(told) == ["BEGAN", "PRESSED", "PRESSED"]
    for touch in told:
        assert touch.impulse_n_s == pytest.approx(weight_n_s, rel=0.01)


def test_touches_are_read_as_they_come(falling: World) -> None:
    falling.resume()
    assert kinds(list(itertools.islice(falling.touches(), 3))) == ["BEGAN", "ENDED", "BEGAN"]


def test_touches_end_with_the_world(shared: Server, falling: World) -> None:
    other = falling.branch(paused=True)
    with other.touches() as touches:
        other.step(30)
        other.destroy()
        assert kinds(list(touches)) == ["BEGAN", "ENDED"]


def test_one_stream_tells_the_touches_of_a_world(falling: World) -> None:
    with falling.touches() as touches:
        with pytest.raises(PneumaError, match="another stream"):
            falling.touches(bodies="floor", impulse_min_n_s=0).open()
        falling.step(30)
        assert kinds(touches.take()) == ["BEGAN", "ENDED"]
    with falling.touches() as again:
        assert again.take() == []


def test_touches_begin_anew_after_a_reset(falling: World) -> None:
    falling.step(200)
    with falling.touches() as touches:
        falling.step(1)
        assert kinds(touches.take()) == ["BEGAN"]
        falling.reset()
        falling.step(30)
        assert kinds(touches.take()) == ["BEGAN", "ENDED"]


def test_touches_that_have_not_begun_say_so(falling: World) -> None:
    touches = falling.touches()
    falling.step(30)
    with pytest.raises(PneumaError, match="has not begun"):
        touches.take()


def test_names_are_not_counted(world: World, shared: Server) -> None:
    with pytest.raises(TypeError, match="by its name"):
        _ = "ball" in world  # type: ignore[operator]
    with pytest.raises(TypeError, match="by its name"):
        _ = "places" in shared  # type: ignore[operator]


def test_touches_keep_no_frames(falling: World) -> None:
    with falling.touches() as touches:
        for _ in range(20):
            falling.reset()
            falling.step(1)
        reader = touches._inner._reader
        assert reader and not reader.frames and not reader.events


def test_touches_for_asyncio() -> None:
    async def bounce() -> list[str]:
        async with pneuma.aio.serve() as server:
            stone = RigidBody(name="stone", shape=Shape.Sphere(radius_m=0.05), position=(0, 0.2, 0))
            scene = Scene(name="falling", gravity=(0, -g_m_s2, 0)).add(
                stone, Collider(name="floor", shape=Shape.Plane())
            )
            world = await server.world(scene)
            async for touch in world.touches():
                return [touch.kind, touch.first, touch.second]
        return []

    assert asyncio.run(bounce()) == ["BEGAN", "stone", "floor"]
