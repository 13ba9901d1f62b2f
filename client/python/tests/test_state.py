"""States of messages: a soft body is made when it is asked for, and its message is dropped then."""

from __future__ import annotations

import numpy as np
import pytest

from pneuma import wire
from pneuma.state import Unmade, state_of

positions = np.arange(12, dtype="<f4").reshape(4, 3)


def message(*names: str, positions: bytes = positions.tobytes(), velocities: bytes = b"") -> wire.State:
    told = wire.State(world="w", tick=3)
    for name in names:
        soft = told.soft_bodies.add(positions=positions, velocities=velocities)
        soft.body.name = name
    return told


def test_soft_bodies_show_as_in_a_dict() -> None:
    soft = state_of(message("a", "b")).soft
    assert repr(soft) == repr(dict(soft))
    assert repr(soft).startswith("{'a': <a at (0.000, 0.000, 0.000) m, 4 vertices>, 'b': <b ")


def test_a_body_that_is_made_keeps_no_message() -> None:
    soft = state_of(message("a", "b")).soft
    body = soft["a"]
    assert np.array_equal(body.positions, positions) and body.velocities is None
    assert soft["a"] is body
    kept = soft._bodies  # type: ignore[attr-defined]
    assert kept["a"] is body and isinstance(kept["b"], Unmade)
    assert list(soft) == ["a", "b"]


@pytest.mark.parametrize("told", [{"positions": b"0" * 13}, {"velocities": b"0" * 12}])
def test_vertices_that_are_not_whole_are_told(told: dict[str, bytes]) -> None:
    with pytest.raises(ValueError, match="the vertices of a are not whole"):
        state_of(message("a", **told))
