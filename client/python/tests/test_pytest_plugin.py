"""The pytest plugin, in runs of pytest of their own: what a test gets, and what is left of one that fails."""

from __future__ import annotations

import re

import pytest

from pneuma import Server
from pneuma.testing import near

first = """
def test_kick(pneuma):
    w = pneuma.world("bouncing-ball", paused=True)
    w["ball"].kick((3, 0, 0))
    assert w.step()["ball"].momentum[0] > 2.9
"""


def run(pytester: pytest.Pytester, source: str, *arguments: str) -> pytest.RunResult:
    pytester.makepyfile(source)
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *arguments)


def test_a_test_has_a_server(pytester: pytest.Pytester) -> None:
    run(pytester, first).assert_outcomes(passed=1)


def test_a_test_has_no_worlds_of_those_before_it(pytester: pytest.Pytester) -> None:
    source = first + "def test_after(pneuma):\n    assert pneuma.worlds() == []\n"
    run(pytester, source).assert_outcomes(passed=2)


def test_the_fixture_has_a_name_that_hides_no_module(pytester: pytest.Pytester) -> None:
    source = """
import pneuma

def test_both(pneuma_server, request):
    assert isinstance(pneuma_server, pneuma.Server)
    assert request.getfixturevalue("pneuma") is pneuma_server
    pneuma_server.world(pneuma.Scene(name="empty"), paused=True)

def test_after(pneuma_server):
    assert pneuma_server.worlds() == []
"""
    run(pytester, source).assert_outcomes(passed=2)


def test_tests_share_a_server_and_get_another_when_it_dies(pytester: pytest.Pytester) -> None:
    source = """
import os, signal

seen = []

def test_first(pneuma):
    seen.append(pneuma.process_id)

def test_second(pneuma):
    assert seen == [pneuma.process_id]
    os.kill(pneuma.process_id, signal.SIGKILL)
    pneuma.world("bouncing-ball")

def test_third(pneuma):
    assert seen != [pneuma.process_id]
    pneuma.world("bouncing-ball", paused=True)
"""
    result = run(pytester, source)
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["worlds could not be kept: UNAVAILABLE: *"])


def test_the_world_of_a_test_that_fails_is_kept(pytester: pytest.Pytester, shared: Server) -> None:
    source = """
import pytest
from pneuma.testing import assert_hash

@pytest.mark.parametrize("name", ["a/b"])
def test_bits(pneuma, name):
    w = pneuma.world("bouncing-ball", name="mine", paused=True)
    assert_hash(w.step(12), "0x12")
"""
    result = run(pytester, source)
    result.assert_outcomes(failed=1)
    output = result.stdout.str()
    found = re.search(r"^mine at tick 12 is kept: (\S+)$", output, re.MULTILINE)
    told = re.search(r"mine at tick 12 has the hash (0x[0-9a-f]{16}), not 0x0{14}12", output)
    assert found and told
    with shared.restore(found[1], name="kept") as world:
        assert world.state().state_hash == int(told[1], 16)


def test_a_kick_takes_at_most_eight_lines() -> None:
    assert len(first.strip().splitlines()) <= 8


def test_near_is_within_a_distance(shared: Server) -> None:
    assert (1, 2, 3) == near((1, 2, 3.05), within_m=0.06)
    assert (1, 2, 3) != near((1, 2, 3.05), within_m=0.04)
    assert [1, 2] != near((1, 2, 3), within_m=9)
    assert (1, 2, float("nan")) != near((1, 2, 3), within_m=9)
    with pytest.raises(ValueError):
        near((1, 2), within_m=1)
    with pytest.raises(ValueError):
        near((1, 2, 3), within_m=float("nan"))
    point = near((0, 0, 0), within_m=0.5)
    assert (0, 3, 0) != point
    assert repr(point) == "within 0.5 m of (0.000, 0.000, 0.000) m; (0.000, 3.000, 0.000) m is 3 m away"
    with shared.world("bouncing-ball", paused=True) as world:
        assert world.state()["ball"] == near((-2, 2, 0), within_m=1e-6)
        for what in (world, world["ball"], world.state()):
            with pytest.raises(
                TypeError, match="near compares points, and bodies of a state.*; a state has the places"
            ):
                assert what == near((0, 0, 0), within_m=1)
    with pytest.raises(TypeError, match="not 'ball'$"):
        assert "ball" == near((0, 0, 0), within_m=1)
