"""How a world looks in a notebook."""

from __future__ import annotations

from html import escape
from typing import Any

from pneuma._proto import session_pb2 as wire


def table_of(stats: wire.Stats, url: str) -> str:
    """HTML: a row a body with its volume, pressure and place, under a link to the world's page."""
    rows = [
        row(body.name, f"{body.volume_m3:.4g}", f"{body.pressure_pa:.4g}", body.centre_of_mass)
        for body in stats.soft_bodies
    ]
    rows += [row(body.name, "", "", body.position) for body in stats.rigid_bodies]
    return (
        f'<p><a href="{escape(url)}" target="_blank">{escape(stats.world)}</a> at tick {stats.tick}, '
        f"{stats.time_s:.3f} s</p>"
        "<table><tr><th>body</th><th>volume m³</th><th>pressure Pa</th><th>place m</th></tr>"
        + "".join(rows)
        + "</table>"
    )


def row(name: str, volume: str, pressure: str, place: Any) -> str:
    cells = (name, volume, pressure, f"{place.x:.3f}, {place.y:.3f}, {place.z:.3f}")
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
