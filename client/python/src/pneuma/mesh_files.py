"""Meshes from files: Wavefront (.obj) and STL, binary or text."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneuma._proto.scene_types import Mesh
from pneuma.messages import invalid
from pneuma.scene import triangles

Triangles = tuple[NDArray[np.float64], NDArray[np.int64]]

# A binary STL file: 80 bytes of anything, a count, and so many of these.
stl_head_bytes = 84
stl_facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_mesh(path: str | PathLike[str], *, name: str | None = None, scale: float = 1.0, mend: bool = False) -> Mesh:
    """The mesh of a file, named after it unless `name` is given.

    scale: metres a unit of the file.
    mend: asks the server to weld, turn and close what is broken. Corners of an STL file are always welded.

    Raises PneumaError (INVALID_ARGUMENT) where the file is none of these.
    """
    file = Path(path)
    kind = file.suffix.lower()
    if kind not in (".obj", ".stl"):
        raise invalid(str(path), f"a mesh is an .obj or .stl file, not {kind or 'one without a suffix'}")
    try:
        positions, faces = read_obj(file) if kind == ".obj" else read_stl(file)
    except (ValueError, IndexError) as error:
        raise invalid(str(path), str(error)) from None
    if not len(faces):
        raise invalid(str(path), "has no faces")
    welded = Mesh.Mend(orient=mend, close=mend) if mend or kind == ".stl" else None
    return triangles(name or file.stem, positions * scale, faces, mend=welded)


def read_obj(file: Path) -> Triangles:
    """Faces of more than three corners become fans."""
    positions: list[list[float]] = []
    faces: list[list[int]] = []
    for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            positions.append([float(word) for word in words[:3]])
        elif kind == "f":
            corners = [int(word.split("/")[0]) for word in words]
            # Counted from 1, or back from the last one.
            corners = [corner - 1 if corner > 0 else len(positions) + corner for corner in corners]
            faces += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
    return np.array(positions, np.float64).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)


def read_stl(file: Path) -> Triangles:
    data = file.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) == stl_head_bytes + count * stl_facet.itemsize:
        corners = np.frombuffer(data, stl_facet, count, stl_head_bytes)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        lines = (line.split() for line in data.decode("utf-8", "replace").splitlines())
        corners = np.array([[float(x) for x in words[1:4]] for words in lines if words[:1] == ["vertex"]], np.float64)
    corners = corners.reshape(-1, 3)
    if len(corners) % 3:
        raise ValueError(f"{len(corners)} corners are no triangles")
    return corners, np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
