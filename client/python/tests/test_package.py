"""The package as it is installed: typed, in a namespace of its own, beside what others generate of the same files."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import metadata, resources
from pathlib import Path

import pytest

import pneuma

from conftest import Guarded, checkout, environment, sources


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with protoc's own pneuma.v1."""
    folder = tmp_path_factory.mktemp("messages")
    protos = [str(proto) for proto in (checkout / "proto" / "pneuma" / "v1").glob("*.proto")]
    subprocess.run(["protoc", f"-I{checkout / 'proto'}", f"--python_out={folder}", *protos], check=True)
    return folder


def run(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, timeout=30, env=environment(**variables)
    )


def test_types_are_told() -> None:
    assert resources.files(pneuma).joinpath("py.typed").is_file()
    assert metadata.version("pneuma") == pneuma.__version__ == "0.1.0"


@pytest.mark.parametrize("tool", ["pytest", "mypy"])
def test_the_environment_has_the_tools(tool: str, tmp_path: Path) -> None:
    """Those of its own python, which finds the package."""
    (tmp_path / "test_it.py").write_text("import pneuma\n\n\ndef test_it() -> None:\n    assert pneuma.Gas()\n")
    launcher = Path(sys.executable).parent / tool
    words = ["-p", "no:cacheprovider"] if tool == "pytest" else ["--follow-imports=skip", f"--cache-dir={tmp_path}"]
    ended = subprocess.run([launcher, *words, "test_it.py"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.parametrize("first", ["pneuma", "pneuma.v1.session_pb2"])
def test_messages_of_others_are_other_messages(messages: Path, first: str) -> None:
    """Whichever is imported first."""
    second = "pneuma.v1.session_pb2" if first == "pneuma" else "pneuma"
    code = f"""
import {first}, {second}
import pneuma
from pneuma.v1.session_pb2 import Hello
assert pneuma.wire.Hello is not Hello
assert pneuma.wire.Hello(token="a").SerializeToString() == Hello(token="a").SerializeToString()
"""
    ended = run("-c", code, PYTHONPATH=str(messages))
    assert ended.returncode == 0, ended.stderr


def test_another_version_of_the_messages_is_no_matter() -> None:
    code = """
from google.protobuf.descriptor_pb2 import FileDescriptorProto
from google.protobuf import descriptor_pool
descriptor_pool.Default().AddSerializedFile(FileDescriptorProto(name="pneuma/v1/scene.proto", package="pneuma.v1",
    message_type=[{"name": "Vec3"}]).SerializeToString())
import pneuma
pneuma.wire.Impulse().impulse.x = 3
"""
    ended = run("-c", code)
    assert ended.returncode == 0, ended.stderr


def test_the_smallest_client_prints_heights(messages: Path) -> None:
    smallest = sources / "examples" / "smallest.py"
    assert len(smallest.read_text().splitlines()) <= 60
    with pneuma.serve("five-balls") as server:
        ended = run(str(smallest), server.address, "five-balls", PYTHONPATH=str(messages))
    lines = ended.stdout.splitlines()
    assert ended.returncode == 0 and len(lines) == 20 * 5, ended.stderr
    assert lines[0].split()[2] == "ball-1" and -2 < float(lines[0].split()[3]) < 2


def test_the_smallest_client_tells_how_it_is_used(messages: Path) -> None:
    ended = run(str(sources / "examples" / "smallest.py"), PYTHONPATH=str(messages))
    assert ended.returncode != 0 and re.fullmatch(r"usage: \S+/smallest.py HOST:PORT WORLD .*\n", ended.stderr)


def test_the_smallest_client_says_a_token_over_tls(messages: Path, guarded: Guarded) -> None:
    smallest = str(sources / "examples" / "smallest.py")
    words = (smallest, guarded.address, "bouncing-ball", str(guarded.certificate))
    good = run(*words, PYTHONPATH=str(messages), PNEUMA_TOKEN=guarded.token)
    assert good.returncode == 0 and len(good.stdout.splitlines()) == 20, good.stderr
    bad = run(*words, PYTHONPATH=str(messages), PNEUMA_TOKEN="wrong")
    assert bad.returncode != 0 and "UNAUTHENTICATED" in bad.stderr
