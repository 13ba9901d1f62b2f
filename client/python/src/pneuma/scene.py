"""Scenes: built in Python, read from files, saved to them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Self, TypeAlias, get_args

import numpy as np
from google.protobuf import json_format
from numpy.typing import NDArray

from pneuma import messages
from pneuma._proto import scene_pb2 as wire
from pneuma._proto import scene_types, session_pb2
from pneuma._proto.scene_types import Collider, Joint, Mesh, RigidBody, SoftBody
from pneuma.arrays import Points

Part: TypeAlias = Mesh | SoftBody | RigidBody | Collider | Joint


class Scene(scene_types.Scene):
    """What a world is made of: see `scene_types.Scene` for its fields.

    >>> scene = Scene(name="drop", gravity=(0, -9.81, 0))
    >>> scene.add(Mesh(name="ball", icosphere=Mesh.Icosphere(subdivisions=2, radius_m=0.5)))
    """

    __slots__ = ()

    def add(self, *parts: Part) -> Self:
        """Appends each to the list of its kind. Returns the scene. Raises TypeError where one is of no such kind."""
        for part in parts:
            if not isinstance(part, get_args(Part)):
                kinds = ", ".join(kind.__name__ for kind in get_args(Part))
                raise TypeError(f"add takes these, one after the other: {kinds}; not {part!r}")
        for part in parts:
            if isinstance(part, Mesh):
                self.meshes.append(part)
            elif isinstance(part, SoftBody):
                self.soft_bodies.append(part)
            elif isinstance(part, RigidBody):
                self.rigid_bodies.append(part)
            elif isinstance(part, Collider):
                self.colliders.append(part)
            else:
                self.joints.append(part)
        return self

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Reads a scene's file, JSON. Raises PneumaError where it is none."""
        try:
            return cls.of_message(json_format.Parse(Path(path).read_text(encoding="utf-8"), wire.Scene()))
        except json_format.ParseError as error:
            raise messages.invalid(str(path), str(error)) from None

    @classmethod
    def of_message(cls, message: wire.Scene) -> Self:
        read = messages.value_of(message)
        return cls(**{each.name: getattr(read, each.name) for each in fields(read)})

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the scene as JSON, which `pneuma create` and `pneuma-sim` take too."""
        Path(path).write_text(json_of(message_of(self)), encoding="utf-8")


def message_of(scene: scene_types.Scene | Mapping[str, object]) -> wire.Scene:
    """The message; a dict has the fields of the JSON form, and tuples and arrays where the dataclasses take them."""
    message = wire.Scene()
    messages.fill(message, scene, "scene")
    return message


Source: TypeAlias = str | PathLike[str] | scene_types.Scene | Mapping[str, object]


def fill_source(request: session_pb2.CreateWorld, source: Source) -> None:
    """Says which scene a world is made of: a built-in one, a scene, a dict like its JSON form, JSON, or a file's path."""
    if not isinstance(source, (str, PathLike, scene_types.Scene, Mapping)):
        forms = "a Scene, a dict, JSON, a built-in scene's name or the path of a .json file"
        raise TypeError(f"{source!r} is no scene, which is {forms}")
    if isinstance(source, (scene_types.Scene, Mapping)):
        request.scene.CopyFrom(message_of(source))
    elif isinstance(source, str) and source.lstrip().startswith("{"):
        request.scene_json = source
    elif Path(source).suffix == ".json":
        request.scene_json = Path(source).read_text("utf-8")
    else:
        request.builtin = fspath(source)


def json_of(message: wire.Scene) -> str:
    return json.dumps(json_format.MessageToDict(message, preserving_proto_field_name=True), indent=2) + "\n"


def triangles(
    name: str, positions: Points, faces: Sequence[Sequence[int]] | NDArray[Any], *, mend: Mesh.Mend | None = None
) -> Mesh:
    """A mesh of numpy arrays or lists.

    positions: (n, 3), metres. faces: (m, 3) indices of vertices, counter-clockwise seen from outside.

    Raises PneumaError where faces have another shape, or what is given are no numbers. What else is wrong, the server
    tells.
    """
    indices = messages.array_of(faces, "triangles.faces", whole=True)
    points = messages.array_of(positions, "triangles.positions")
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise messages.invalid("triangles.faces", f"have the shape {indices.shape}; triangles have (m, 3)")
    return Mesh(
        name=name,
        triangles=Mesh.Triangles(positions=points, indices=indices.reshape(-1)),
        mend=mend,
    )
