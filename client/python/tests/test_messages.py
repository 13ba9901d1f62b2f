"""Dataclasses, dicts, tuples and arrays become the wire's messages, and back. What does not fit is told by its path."""

from __future__ import annotations

import dataclasses
import json
import typing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import json_format

import pneuma
from pneuma import (
    Collider,
    Gas,
    Mesh,
    PneumaError,
    Scene,
    SceneChange,
    Shape,
    SoftBody,
    SoftBodyChange,
    Springs,
    triangles,
)
from pneuma._proto import scene_pb2, scene_types, session_pb2
from pneuma.messages import fill, message_name, value_of
from pneuma.scene import fill_source, json_of, message_of

from conftest import checkout

scenes = sorted((checkout / "server" / "scenes").glob("*.json"))


def ball() -> SoftBody:
    return SoftBody(
        name="ball", mesh="ball", position=(0, 2, 0), springs=Springs(stiffness_n_m=200), gas=Gas(moles=0.028)
    )


@pytest.mark.parametrize("file", scenes, ids=[file.stem for file in scenes])
def test_a_built_in_scene_is_the_same_after_a_turn_through_dataclasses(file: Path) -> None:
    message = json_format.Parse(file.read_text(), scene_pb2.Scene())
    again = message_of(Scene.load(file))
    # A Vec3 or a quaternion that is there but all 0 stays there: the texts are the same.
    assert json_of(again) == json_of(message)


@pytest.mark.parametrize("file", scenes, ids=[file.stem for file in scenes])
def test_a_dict_is_taken_like_the_file(file: Path) -> None:
    assert message_of(json.loads(file.read_text())) == json_format.Parse(file.read_text(), scene_pb2.Scene())


def test_every_message_of_the_file_has_a_dataclass_with_its_fields() -> None:
    def check(descriptor: Any, kind: Any) -> int:
        assert message_name(kind) == descriptor.full_name
        assert [each.name for each in dataclasses.fields(kind)] == [each.name for each in descriptor.fields]
        return 1 + sum(check(nested, getattr(kind, nested.name)) for nested in descriptor.nested_types)

    messages = scene_pb2.DESCRIPTOR.message_types_by_name
    checked = sum(check(m, getattr(scene_types, n)) for n, m in messages.items() if n not in ("Vec3", "Quaternion"))
    assert checked > 40


def test_enums_are_the_names_of_the_wire() -> None:
    assert set(typing.get_args(pneuma.Stepping.Integrator)) == {
        value.name for value in scene_pb2.Stepping.DESCRIPTOR.enum_types_by_name["Integrator"].values if value.number
    }


def test_a_docstring_has_the_comments_of_the_wire() -> None:
    assert SoftBody.__doc__ and "velocity: m/s" in SoftBody.__doc__
    assert "pins: Indices of vertices that do not move." in SoftBody.__doc__


def test_only_what_is_given_is_shown() -> None:
    assert repr(Gas(moles=0.5)) == "Gas(moles=0.5)"
    assert repr(Shape.Plane()) == "Shape.Plane()"


def test_a_misspelt_field_is_refused(tmp_path: Path) -> None:
    """Also of a scene that was read, whose class is derived from the generated one."""
    Scene(soft_bodies=[ball()]).save(tmp_path / "a.json")
    read: Any = Scene.load(tmp_path / "a.json")
    for each in (read, read.soft_bodies[0], read.soft_bodies[0].gas):
        with pytest.raises(AttributeError, match="mols"):
            each.mols = 0.5
    read.soft_bodies[0].gas.moles = 0.5
    assert message_of(read).soft_bodies[0].gas.moles == 0.5


def test_a_choice_stands_for_what_it_is_a_choice_of() -> None:
    by_choice = message_of(Scene(colliders=[Collider(name="floor", shape=Shape.Plane(normal=(0, 1, 0)))]))
    whole = message_of(Scene(colliders=[Collider(name="floor", shape=Shape(plane=Shape.Plane(normal=(0, 1, 0))))]))
    assert by_choice == whole
    change = scene_pb2.SceneChange()
    fill(change, SoftBodyChange(name="ball", mass_kg=2), "change")
    assert change.change_soft_body.mass_kg == 2
    added = scene_pb2.SceneChange()
    fill(added, ball(), "change")
    assert added.add_soft_body.name == "ball"


def test_a_shape_without_fields_is_there() -> None:
    message = message_of({"colliders": [{"name": "floor", "shape": {"plane": {}}}]})
    assert message.colliders[0].shape.WhichOneof("shape") == "plane"


def test_none_is_unset_and_zero_is_not() -> None:
    gas = message_of(Scene(soft_bodies=[SoftBody(gas=Gas(moles=0.0))])).soft_bodies[0].gas
    assert gas.HasField("moles") and not gas.HasField("temperature_k")


@pytest.mark.parametrize("seed", range(10))
def test_arrays_become_a_mesh_and_come_back(seed: int) -> None:
    random = np.random.default_rng(seed)
    positions = random.normal(size=(random.integers(3, 50), 3)).astype(["f4", "f8"][seed % 2])
    faces = random.integers(0, len(positions), size=(random.integers(1, 50), 3)).astype(["i4", "u4", "i8"][seed % 3])
    message = message_of(Scene(meshes=[triangles("m", positions, faces)])).meshes[0]
    back = value_of(message)
    assert isinstance(back, Mesh) and back.triangles
    assert np.array_equal(np.array(back.triangles.positions), positions)
    assert np.array_equal(np.array(back.triangles.indices).reshape(-1, 3), faces)


refusals: list[tuple[Any, str, str]] = [
    ({"soft_bodies": [{}, {"mas_kg": 1}]}, "scene.soft_bodies[1].mas_kg", "did you mean mass_kg?"),
    ({"soft_bodies": [{"mass": 1}]}, "scene.soft_bodies[0].mass", "did you mean mass_kg?"),
    ({"gravity": {"down": 1}}, "scene.gravity.down", "there are x, y, z"),
    ({"gravity": (0, 1)}, "scene.gravity", "has 2 numbers; x, y, z are 3"),
    ({"gravity": "down"}, "scene.gravity", "no numbers"),
    ({"gravity": 9.81}, "scene.gravity", "has 1 numbers"),
    ({"soft_bodies": [{"mass_kg": "heavy"}]}, "scene.soft_bodies[0].mass_kg", "'heavy'"),
    ({"soft_bodies": {"name": "a"}}, "scene.soft_bodies", "no list"),
    ({"soft_bodies": [{"pins": [1.5]}]}, "scene.soft_bodies[0].pins", "no whole numbers"),
    ({"soft_bodies": [{"pins": [-1]}]}, "scene.soft_bodies[0].pins", "-1"),
    ({"soft_bodies": [{"start_positions": ["a"]}]}, "scene.soft_bodies[0].start_positions", "no numbers"),
    ({"stepping": {"integrator": "EULER"}}, "scene.stepping.integrator", "is none of EXPLICIT_EULER"),
    ({"meshes": [{"triangles": {"positions": np.zeros((4, 2))}}]}, "scene.meshes[0].triangles.positions", "(4, 2)"),
    ({"colliders": [{"shape": Gas()}]}, "scene.colliders[0].shape", "is a Gas, not a Shape"),
    ({"colliders": [{"shape": 3}]}, "scene.colliders[0].shape", "3 is no Shape"),
    ({"colliders": [{"quux": 3}]}, "scene.colliders[0].quux", "unknown field of Collider"),
    ({"gravity": np.zeros((3, 1))}, "scene.gravity", "has the shape (3, 1); x, y, z have (3,)"),
    ({"gravity": [[0], [-9.81], [0]]}, "scene.gravity", "has the shape (3, 1)"),
    ({"gravity": (0, (1, 2), 0)}, "scene.gravity", "rows of different lengths"),
    ({"soft_bodies": [{"mesh": 3}]}, "scene.soft_bodies[0].mesh", "is 3, not text"),
    ({"soft_bodies": [{"mesh": Mesh(name="m")}]}, "scene.soft_bodies[0].mesh", "is a Mesh, not text"),
    ({"soft_bodies": [{"mass_kg": [1, 2]}]}, "scene.soft_bodies[0].mass_kg", "is [1, 2], not a number"),
    (
        {"meshes": [{"icosphere": {"subdivisions": "2"}}]},
        "scene.meshes[0].icosphere.subdivisions",
        "not a whole number",
    ),
]


@pytest.mark.parametrize("faces", [[(0, 1, 2, 3)] * 3, [0, 1, 2], [[[0, 1, 2]]], []])
def test_faces_that_are_no_triangles_are_refused(faces: Any) -> None:
    """Three faces of four corners are not four faces of three."""
    with pytest.raises(PneumaError, match=r"INVALID_ARGUMENT: have the shape .*triangles have \(m, 3\)"):
        triangles("m", np.zeros((4, 3)), faces)


@pytest.mark.parametrize(
    "positions, faces, told",
    [
        (np.zeros((4, 3)), [(0, 1, 2), (0, 1)], r"has rows of different lengths .triangles\.faces."),
        (np.zeros((4, 3)), [(0, 1, 2.5)], r"has elements that are no whole numbers .triangles\.faces."),
        ([(0, 0, 0), (1, 0)], [(0, 1, 2)], r"has rows of different lengths .triangles\.positions."),
    ],
)
def test_triangles_of_what_are_no_rows_are_refused(positions: Any, faces: Any, told: str) -> None:
    with pytest.raises(PneumaError, match="INVALID_ARGUMENT: " + told):
        triangles("m", positions, faces)


@pytest.mark.parametrize("part", [3, "ball", [ball()], None, Gas()])
def test_what_is_no_part_of_a_scene_is_refused(part: Any) -> None:
    scene = Scene()
    with pytest.raises(TypeError, match="add takes these.*Mesh, SoftBody, RigidBody, Collider, Joint"):
        scene.add(ball(), part)
    assert scene == Scene()  # none, where one is refused


@pytest.mark.parametrize("source", [None, 3, [ball()], ball()])
def test_what_is_no_scene_is_told(source: Any) -> None:
    with pytest.raises(TypeError, match="is no scene, which is a Scene, a dict, JSON"):
        fill_source(session_pb2.CreateWorld(), source)


@pytest.mark.parametrize("scene, where, what", refusals, ids=[where for _, where, _ in refusals])
def test_what_does_not_fit_is_told_with_its_path(scene: Any, where: str, what: str) -> None:
    with pytest.raises(PneumaError) as refused:
        message_of(scene)
    assert (refused.value.code, refused.value.where) == ("INVALID_ARGUMENT", where)
    assert what in refused.value.what


def test_a_scene_is_saved_and_loaded(tmp_path: Path) -> None:
    scene = Scene(name="drop", gravity=(0, -9.81, 0)).add(
        Mesh(name="ball", icosphere=Mesh.Icosphere(subdivisions=2)), ball(), Collider(name="floor", shape=Shape.Plane())
    )
    scene.save(tmp_path / "drop.json")
    assert message_of(Scene.load(tmp_path / "drop.json")) == message_of(scene)


def test_a_file_that_is_no_scene_is_told(tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text('{"gravty": {}}')
    with pytest.raises(PneumaError, match="gravty") as refused:
        Scene.load(tmp_path / "bad.json")
    assert refused.value.where.endswith("bad.json")


def test_messages_of_the_wire_are_taken_as_they_are() -> None:
    message = scene_pb2.Scene(name="as it is")
    assert message_of({"soft_bodies": [scene_pb2.SoftBody(name="b")]}).soft_bodies[0].name == "b"
    target = scene_pb2.Scene()
    fill(target, message, "scene")
    assert target == message
    with pytest.raises(PneumaError, match="is a Gas, not a Scene"):
        fill(target, scene_pb2.Gas(), "scene")


def test_a_scene_change_of_a_dict() -> None:
    change = scene_pb2.SceneChange()
    fill(change, {"set_gravity": np.array([0, -1.62, 0])}, "change")
    assert change.set_gravity.y == -1.62
    fill(change, SceneChange(remove_collider="floor"), "change")
    assert change.remove_collider == "floor"
