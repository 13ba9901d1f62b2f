"""The engine in process: to the bit what a server makes of the same scene and the same changes."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pneuma
from pneuma import ColliderChange, Gas, NotReached, PneumaError, Server, SoftBodyChange, engine
from pneuma.scene import Source
from pneuma.testing import near

from conftest import sources

#: Explicit, implicit and with solids; of single precision.
scenes = ["five-balls", "bouncing-ball", "hand", "wind-cloth"]


def seven_worlds(scene: Source = "bouncing-ball", **given: object) -> engine.Worlds:
    return engine.Worlds(scene, 7, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("scene", scenes)
def test_the_bits_are_the_servers(shared: Server, scene: str) -> None:
    worlds = engine.Worlds(scene, 2)
    worlds.step(40)
    with shared.world(scene, paused=True) as world:
        wanted = world.step(40).state_hash
        assert engine.World(scene).step(40).state_hash == wanted
        assert engine.World(scene, threads=2).step(40).state_hash == wanted
        assert worlds.state_hashes().tolist() == [wanted, wanted]


def test_changes_have_the_servers_bits(shared: Server) -> None:
    """Kicked, grabbed, edited, put elsewhere and reset alike, with the replies of a server."""

    def changed(world: pneuma.World | engine.World) -> tuple[int, ...]:
        told = [world["ball"].kick((3, 0, 1))]
        grab = world["ball"].grab((0, 3, 0), vertex=5)
        told.append(world.step(10).state_hash)
        told.append(grab.release())
        world.gravity = (0, -1.62, 0)
        told.append(world["ball"].change(SoftBodyChange(gas=Gas(moles=0.05))))
        state = world.step(20, velocities=True)
        told.append(world.set_state(state))
        told.append(world.run_until(touch=("ball", "floor")).state_hash)
        told.append(world.reset())
        return (*told, world.step(5).state_hash, world.state().tick)

    with shared.world("bouncing-ball", paused=True) as world:
        assert changed(engine.World("bouncing-ball")) == changed(world)


def test_a_state_is_the_servers(shared: Server) -> None:
    with shared.world("five-balls", paused=True) as world:
        theirs = world.step(30, velocities=True, double_precision=True)
    ours = engine.World("five-balls").step(30, velocities=True, double_precision=True)
    assert (ours.tick, ours.time_s, list(ours)) == (theirs.tick, theirs.time_s, list(theirs))
    for name, body in theirs.soft.items():
        assert np.array_equal(ours[name].positions, body.positions)
        assert ours[name].pressure_pa == body.pressure_pa


def test_questions_are_answered_as_by_a_server(shared: Server) -> None:
    def answers(world: pneuma.World | engine.World) -> tuple[object, ...]:
        world.step(60)
        down = world.raycast([(x / 4, 1.5, 0) for x in range(-4, 5)], (0, -1, 0))
        near = world.nearest((0, 1, 0))
        boxes = world.bodies_in_box((-1, 0, -1), (0, 1, 1))
        return list(down.bodies), down.distances.tolist(), near.distances.tolist(), list(boxes)

    with shared.world("five-balls", paused=True) as world:
        theirs = answers(world)
    assert answers(engine.World("five-balls")) == theirs


def test_its_scene_is_saved_and_a_world_file_takes_a_server(tmp_path: Path) -> None:
    world = engine.World("bouncing-ball")
    world.gravity = (0, -1.62, 0)
    world.save(tmp_path / "moon.json")
    assert engine.World(tmp_path / "moon.json").gravity == world.gravity
    with pytest.raises(PneumaError, match="UNSUPPORTED.*server"):
        world.save(tmp_path / "moon.pneuma-world")
    assert [each.name for each in tmp_path.iterdir()] == ["moon.json"]


def test_the_readme_lists_what_a_world_in_process_has() -> None:
    """Every method and property of a server's world is told there to be there or not, as it is."""
    text = (sources / "README.md").read_text().split("## Many worlds in process")[1].split("```")[0]
    has, has_not = text.split("It has no")
    public = {name for name in dir(pneuma.World) + dir(engine.World) if not name.startswith("_")}
    assert {name for name in public if f"`{name}`" in has} == {n for n in dir(engine.World) if not n.startswith("_")}
    assert {name for name in public if f"`{name}`" in has_not} == public - set(dir(engine.World))


def test_scenes_come_in_all_forms(tmp_path: Path) -> None:
    world = engine.World("bouncing-ball")
    scene = world.scene()
    scene.save(tmp_path / "scene.json")
    text = (tmp_path / "scene.json").read_text()
    forms: list[Source] = [scene, text, tmp_path / "scene.json", str(tmp_path / "scene.json")]
    assert {engine.World(form).step(3).state_hash for form in forms} == {world.step(3).state_hash}
    assert engine.World({"name": "empty"}).name == "empty"


def test_what_is_refused_is_told() -> None:
    with pytest.raises(PneumaError, match="NOT_FOUND.*no such") as told:
        engine.World("no such scene")
    assert told.value.where == "create_world.builtin"
    world = engine.World("bouncing-ball")
    with pytest.raises(PneumaError, match="NOT_FOUND"):
        world["stone"].kick((1, 0, 0))
    with pytest.raises(PneumaError, match="INVALID_ARGUMENT"):
        world.step(0)
    with pytest.raises(NotReached, match="not every body was at rest by tick 2"):
        world.run_until(at_rest=True, ticks_max=2)


def test_threads_wait_for_each_other() -> None:
    world = engine.World("five-balls")
    steppers = [threading.Thread(target=lambda: [world.step() for _ in range(10)]) for _ in range(4)]
    for each in steppers:
        each.start()
    for each in steppers:
        each.join()
    assert world.tick == 40
    assert world.state_hash == engine.World("five-balls").step(40).state_hash


def test_arrays_show_the_worlds() -> None:
    shown: list[engine.Shown] = [
        "positions",
        "velocities",
        "centres_of_mass",
        "mean_velocities",
        "pressures_pa",
        "volumes_m3",
    ]
    worlds = engine.Worlds("five-balls", 3, shown=shown)
    positions = worlds.positions
    assert positions.shape == (3, 5 * 162, 3) and positions.dtype == np.float32
    worlds.step(25)
    assert worlds.positions is positions and worlds.ticks.tolist() == [25, 25, 25]
    state = engine.World("five-balls").step(25, velocities=True)
    for index, (name, body) in enumerate(state.soft.items()):
        assert body.velocities is not None and worlds.bodies[index] == name
        for row in range(3):
            assert np.array_equal(positions[row, worlds.rows[name]], body.positions)
            assert np.array_equal(worlds.velocities[row, worlds.rows[name]], body.velocities)
            assert worlds.centres_of_mass[row, index].tolist() == body.centre_of_mass.tolist()
            assert worlds.pressures_pa[row, index] == body.pressure_pa
            assert worlds.volumes_m3[row, index] == body.volume_m3
            # The vertices of these balls weigh the same.
            mean = body.velocities.mean(axis=0, dtype=np.float64)
            assert np.allclose(worlds.mean_velocities[row, index], mean, rtol=0, atol=1e-6)
    assert np.abs(worlds.mean_velocities).max() > 1 and not worlds.frozen.any()


def test_a_name_that_has_no_rows_is_told() -> None:
    with pytest.raises(KeyError, match="no soft body ball .there are ball-1, ball-2"):
        engine.Worlds("five-balls", 1).rows["ball"]


def test_heavy_vertices_count_for_more_in_the_mean_velocity() -> None:
    """The momentum over the mass: the mean of the vertices' velocities by their masses, not the plain one."""
    scene = engine.World("bouncing-ball").scene()
    (ball,) = scene.soft_bodies
    count = len(engine.World(scene).state()["ball"].positions)
    shares = np.linspace(1, 5, count)
    ball.vertex_mass_scale = shares.tolist()
    worlds = engine.Worlds(scene, 1, shown=["velocities", "mean_velocities"])
    worlds.step(80)  # past the bounce: the vertices move differently
    velocities = worlds.velocities[0].astype(np.float64)
    mean = np.average(velocities, axis=0, weights=shares)
    assert np.abs(mean - velocities.mean(axis=0)).max() > 1e-3
    assert np.allclose(worlds.mean_velocities[0, 0], mean, rtol=0, atol=1e-5)


def test_rigid_bodies_come_after_the_soft_ones() -> None:
    worlds = engine.Worlds("hand", 2)
    assert worlds.bodies == ("hand", "ball") and worlds.colliders
    start = worlds.centres_of_mass.copy()
    impulses = np.zeros((2, 2, 3))
    impulses[1, 1] = (0, 5, 0)
    worlds.step(1, impulses=impulses)
    moved = worlds.centres_of_mass - start
    assert moved[1, 1, 1] > moved[0, 1, 1] + 0.01 and moved[0, 0].tolist() == moved[1, 0].tolist()
    assert np.array_equal(worlds.centres_of_mass[0, 1], engine.World("hand").step().rigid["ball"].position)


def test_an_impulse_moves_one_world() -> None:
    worlds = seven_worlds()
    impulses = np.zeros((7, 1, 3))
    impulses[4, 0] = (3, 0, 0)
    worlds.step(12, impulses=impulses)
    hashes = worlds.state_hashes().tolist()
    assert len(set(hashes)) == 2 and hashes.count(hashes[4]) == 1
    alone = engine.World("bouncing-ball")
    alone["ball"].kick((3, 0, 0))
    assert alone.step(12).state_hash == hashes[4]


def test_gas_and_colliders_change_as_by_an_edit(shared: Server) -> None:
    worlds = seven_worlds()
    moles = np.full((7, 1), np.nan)
    moles[2] = 0.05
    velocities = np.full((7, len(worlds.colliders), 3), np.nan)
    velocities[3, 0] = (0, 0.5, 0)
    worlds.step(20)
    worlds.step(50, moles=moles, collider_velocities=velocities)
    with shared.world("bouncing-ball", paused=True) as world:
        world.step(20)
        with world.branch(paused=True) as pumped, world.branch(paused=True) as lifted:
            pumped["ball"].change(SoftBodyChange(gas=Gas(moles=0.05)))
            lifted.edit(ColliderChange(name=worlds.colliders[0], velocity=(0, 0.5, 0)))
            wanted = [each.step(50).state_hash for each in (world, pumped, lifted)]
    assert worlds.state_hashes()[[0, 2, 3]].tolist() == wanted


def test_some_worlds_are_reset() -> None:
    worlds = seven_worlds(shown=["centres_of_mass", "positions"])
    start, places = worlds.state_hashes()[0], worlds.positions.copy()
    worlds.step(30, moles=np.full((7, 1), 0.05), collider_velocities=np.full((7, len(worlds.colliders), 3), 0.1))
    running = worlds.state_hashes()[0]
    which = np.array([True, False, False, True, False, False, True])
    worlds.reset(which)
    assert np.array_equal(worlds.state_hashes() == start, which)
    assert np.array_equal(worlds.state_hashes() == running, ~which)
    assert np.array_equal(worlds.positions[which], places[which])
    assert worlds.ticks.tolist() == [0 if each else 30 for each in which]
    worlds.reset()
    worlds.step(30)
    assert set(worlds.state_hashes().tolist()) == {engine.World("bouncing-ball").step(30).state_hash}


def test_arrays_of_other_shapes_are_refused() -> None:
    worlds = seven_worlds()
    with pytest.raises(PneumaError, match=r"INVALID_ARGUMENT: has the shape \(7, 3\), not \(7, 1, 3\) \(impulses\)"):
        worlds.step(impulses=np.zeros((7, 3)))
    with pytest.raises(PneumaError, match=r"\(7, 1\)"):
        worlds.step(moles=np.zeros(7))
    with pytest.raises(PneumaError, match=r"has the shape \(6,\), not \(7,\)"):
        worlds.reset(np.zeros(6, bool))
    with pytest.raises(PneumaError, match="not shown.*positions"):
        worlds.positions
    with pytest.raises(PneumaError, match="colour"):
        seven_worlds(shown=["colour"])
    for count in (0, -1, 2.5, "2"):
        with pytest.raises(PneumaError, match=rf"INVALID_ARGUMENT: is {count!r}.*\(count\)"):
            engine.Worlds("bouncing-ball", count)  # type: ignore[arg-type]
    with pytest.raises(PneumaError, match=r"LIMIT_EXCEEDED: 1000000000 worlds take \d+ MiB or more.*\(count\)"):
        engine.Worlds("bouncing-ball", 10**9)
    with pytest.raises(PneumaError, match=r"INVALID_ARGUMENT: are no numbers \(moles\)"):
        worlds.step(moles="more")
    impulses = np.zeros((7, 1, 3))
    impulses[5, 0, 0] = np.nan
    with pytest.raises(PneumaError, match=r"worlds\[5\].impulses\[0\]"):
        worlds.step(impulses=impulses)
    with pytest.raises(PneumaError, match=r"worlds\[0\].*moles"):
        worlds.step(moles=np.full((7, 1), -1.0))


@pytest.mark.parametrize(
    "threads, told",
    [
        (-1, "is -1; it must be 1 or more"),
        (0, "is 0; it must be 1 or more"),
        (1025, "is 1025; 1 to 1024 can be"),
        (1.5, "is 1.5, not a whole number"),
    ],
)
def test_threads_are_bounded(threads: Any, told: str) -> None:
    wanted = rf"INVALID_ARGUMENT: {told}.*\(threads\)"
    with pytest.raises(PneumaError, match=wanted):
        engine.World("bouncing-ball", threads=threads)
    with pytest.raises(PneumaError, match=wanted):
        engine.Worlds("bouncing-ball", 2, threads=threads)


@pytest.mark.parametrize("which", [[0, 2], [1, 0, 1, 0, 0, 0, 0], np.zeros(7), "all", [[True], [True, False]]])
def test_which_worlds_to_reset_is_told_by_bools(which: object) -> None:
    """An index is no flag: [0, 2] would reset another world than it names."""
    worlds = seven_worlds()
    worlds.step(3)
    with pytest.raises(PneumaError, match=r"INVALID_ARGUMENT: is (an array of .*, not|no array) of bool \(which\)"):
        worlds.reset(which)
    assert worlds.ticks.tolist() == [3] * 7
    worlds.reset([True] + [False] * 6)
    assert worlds.ticks.tolist() == [0] + [3] * 6


def test_what_would_do_nothing_is_refused() -> None:
    """Moles of a body without gas, and a velocity that is NaN in part."""
    scene = engine.World("bouncing-ball").scene()
    scene.soft_bodies[0].gas = None
    with pytest.raises(PneumaError, match=r'"ball" has no gas.*worlds\[0\].moles\[0\]'):
        engine.Worlds(scene, 2).step(moles=np.full((2, 1), 0.01))
    worlds = seven_worlds()
    velocities = np.full((7, len(worlds.colliders), 3), np.nan)
    velocities[4, 0, 1] = 0.5
    with pytest.raises(PneumaError, match=r"NaN in part.*worlds\[4\].collider_velocities\[0\]"):
        worlds.step(collider_velocities=velocities)
    with pytest.raises(PneumaError, match=r"NaN in part.*worlds\[4\].collider_angular_velocities\[0\]"):
        worlds.step(collider_angular_velocities=velocities)


def test_the_same_moles_again_fill_up_what_leaked() -> None:
    """The gas law, with a vacuum outside, tells how much there is."""
    scene = engine.World("bouncing-ball").scene()
    (ball,) = scene.soft_bodies
    scene.atmosphere = pneuma.Atmosphere()
    assert ball.gas
    ball.gas.leak_mol_s_pa = 1e-4
    worlds = engine.Worlds(scene, 2)

    def moles() -> float:
        joules = worlds.pressures_pa[0, 0] * worlds.volumes_m3[0, 0]
        return float(joules / (8.31446 * 293.15))

    wanted = np.array([[0.05], [np.nan]])
    worlds.step(1, moles=wanted)
    worlds.step(60)
    assert moles() < 0.045
    worlds.step(1, moles=wanted)
    assert moles() == pytest.approx(0.05, rel=0.02)


def test_a_frozen_body_is_told_and_thawed() -> None:
    worlds = seven_worlds()
    impulses = np.zeros((7, 1, 3))
    impulses[1, 0] = (1e8, 0, 0)
    worlds.step(5, impulses=impulses)
    assert worlds.frozen[:, 0].tolist() == [index == 1 for index in range(7)]
    worlds.step(1, impulses=impulses)  # is no error
    worlds.reset(worlds.frozen[:, 0])
    assert not worlds.frozen.any()


def test_other_threads_run_while_worlds_are_stepped() -> None:
    worlds = engine.Worlds("five-balls", 64)
    stepped = threading.Event()
    counted = []

    def count() -> None:
        while not stepped.is_set():
            counted.append(1)
            stepped.wait(1e-4)

    counter = threading.Thread(target=count)
    counter.start()
    while not counted:
        stepped.wait(1e-3)
    before = len(counted)
    worlds.step(30)
    after = len(counted)
    stepped.set()
    counter.join()
    assert after - before > 3


def test_a_ball_flies_straight_in_process() -> None:
    world = engine.World("bouncing-ball")
    world.gravity = (0, 0, 0)
    assert world.step(60)["ball"] == near((-1.5, 2, 0), within_m=1e-3)
