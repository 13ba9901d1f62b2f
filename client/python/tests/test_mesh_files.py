"""Meshes from files: a tetrahedron in each format is the tetrahedron."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneuma import Mesh, PneumaError, Scene, Server, SoftBody, read_mesh
from pneuma.mesh_files import stl_facet

corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float64)
faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def of(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    assert mesh.triangles
    return np.asarray(mesh.triangles.positions), np.asarray(mesh.triangles.indices).reshape(-1, 3)


def binary_stl() -> bytes:
    facets = np.zeros(len(faces), stl_facet)
    facets["corners"] = corners[faces]
    return b"solid in name only".ljust(80) + len(faces).to_bytes(4, "little") + facets.tobytes()


def text_stl() -> str:
    facets = ""
    for face in faces:
        vertices = "\n".join("vertex {} {} {}".format(*corners[i]) for i in face)
        facets += f"facet normal 0 0 0\nouter loop\n{vertices}\nendloop\nendfacet\n"
    return f"solid tetrahedron\n{facets}endsolid tetrahedron\n"


@pytest.mark.parametrize("back", [False, True])
def test_wavefront(tmp_path: Path, back: bool) -> None:
    """With texture and normal indices, and counted from the first vertex on or from the last one back."""
    shift = -4 if back else 1
    lines = ["# a comment", "", *("v {} {} {}".format(*c) for c in corners)]
    lines += ["f " + " ".join(f"{i + shift}/1/1" for i in face) for face in faces]
    (tmp_path / "t.obj").write_text("\n".join(lines))
    mesh = read_mesh(tmp_path / "t.obj", scale=2.0)
    positions, indices = of(mesh)
    assert mesh.name == "t" and mesh.mend is None
    assert np.array_equal(positions, 2 * corners) and np.array_equal(indices, faces)


def test_a_face_of_five_corners_is_a_fan(tmp_path: Path) -> None:
    (tmp_path / "p.obj").write_text("v 0 0 0\n" * 5 + "f 1 2 3 4 5\n")
    assert of(read_mesh(tmp_path / "p.obj"))[1].tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


@pytest.mark.parametrize("data", [binary_stl(), text_stl().encode()], ids=["binary", "text"])
def test_stl(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "t.STL").write_bytes(data)
    positions, indices = of(read_mesh(tmp_path / "t.STL"))
    assert np.array_equal(positions[indices], corners[faces])


def test_the_server_welds_an_stl_file(shared: Server, tmp_path: Path) -> None:
    (tmp_path / "t.stl").write_bytes(binary_stl())
    scene = Scene().add(read_mesh(tmp_path / "t.stl", name="t"), SoftBody(name="body", mesh="t"))
    with shared.world(scene, name="stl", paused=True) as world:
        assert world.state()["body"].positions.shape == (4, 3)
        assert world.state()["body"].volume_m3 == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    "name, text, what",
    [
        ("a.ply", "", "an .obj or .stl file, not .ply"),
        ("a.obj", "v 0 0 0\n", "has no faces"),
        ("a.obj", "v 0 x 0\n", "'x'"),
        ("a.obj", "v 0 0 0\nf 1 one 1\n", "'one'"),
        ("a.stl", "vertex 0 0 0\n", "1 corners are no triangles"),
        ("a.stl", "", "has no faces"),
    ],
)
def test_what_is_no_mesh_is_told(tmp_path: Path, name: str, text: str, what: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(PneumaError) as refused:
        read_mesh(tmp_path / name)
    assert what in refused.value.what and refused.value.where.endswith(name)
