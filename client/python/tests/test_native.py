"""The module in C++, beside Python's protobuf: in any order, and where it is not there."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import environment
from test_package import messages, run

__all__ = ["messages"]  # a fixture

first_uses = {
    "package": "import pneuma; pneuma.wire.Impulse().impulse.x = 3",
    "native": "from pneuma import engine; assert engine.World('bouncing-ball').step(3).tick == 3",
    "protobuf": "from google.protobuf.struct_pb2 import Struct; Struct().update({'a': 1})",
    "others": "from pneuma.v1.session_pb2 import Hello; assert Hello.FromString(Hello(token='a').SerializeToString()).token",
}


@pytest.mark.parametrize("order", itertools.permutations(first_uses), ids="-".join)
def test_in_any_order(order: tuple[str, ...], messages: Path) -> None:
    code = "\n".join(first_uses[each] for each in (*order, *order))
    ended = run("-W", "error", "-c", code, PYTHONPATH=str(messages))
    assert ended.returncode == 0, ended.stderr


def test_the_module_alone() -> None:
    """Loaded first, by itself, it brings what it needs."""
    code = """
import importlib.util, pathlib, site
place = next(pathlib.Path(site.getsitepackages()[0], "pneuma").glob("_native.*.so"))
spec = importlib.util.spec_from_file_location("_native", place)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
module.Decoder()
import pneuma
pneuma.wire.Hello()
"""
    ended = run("-c", code)
    assert ended.returncode == 0, ended.stderr


def test_a_client_does_not_load_it() -> None:
    ended = run("-c", "import pneuma, sys; assert 'pneuma._native' not in sys.modules")
    assert ended.returncode == 0, ended.stderr


def test_where_it_is_missing_the_error_says_so() -> None:
    """As in a package that was built without it. What needs a server alone goes on."""
    code = """
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name == "pneuma._native" else found(name, package)
import pneuma
for use in ("from pneuma import engine", "pneuma.read('x.pneuma')"):
    try:
        exec(use)
    except ImportError as error:
        assert "no part in C++" in str(error), error
    else:
        raise AssertionError(use)
with pneuma.serve("bouncing-ball") as server, server["bouncing-ball"].stream(max_error=1e-3) as frames:
    assert next(frames).positions.shape[1] == 3 and frames.subscribed.grid_step_m == 0
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30, env=environment())
    assert ended.returncode == 0, ended.stderr
