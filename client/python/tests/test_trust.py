"""Servers that ask for a token and speak TLS."""

from __future__ import annotations

import ssl

import pytest

import pneuma
from pneuma import PneumaError

from conftest import Guarded


def test_a_token_and_a_certificate_let_in(guarded: Guarded) -> None:
    with pneuma.connect(guarded.address, token=guarded.token, ca=guarded.certificate) as server:
        assert [world.name for world in server.worlds()] == ["bouncing-ball"]
        assert server["bouncing-ball"].url.startswith("https://")


def test_a_context_lets_in(guarded: Guarded) -> None:
    context = ssl.create_default_context(cafile=guarded.certificate)
    with pneuma.connect(guarded.address, token=guarded.token, tls=context) as server:
        assert server["bouncing-ball"].state().tick >= 0


def test_a_wrong_token_does_not(guarded: Guarded) -> None:
    with pytest.raises(PneumaError, match="UNAUTHENTICATED"):
        pneuma.connect(guarded.address, token="wrong", ca=guarded.certificate)


def test_a_stranger_is_not_trusted(guarded: Guarded) -> None:
    with pytest.raises(PneumaError, match="certificate verify failed"):
        pneuma.connect(guarded.address, token=guarded.token, tls=True)


def test_plain_talk_is_refused(guarded: Guarded) -> None:
    with pytest.raises(PneumaError, match="UNSUPPORTED"):
        pneuma.connect(guarded.address, token=guarded.token)
