"""How a world looks in a notebook."""

from __future__ import annotations

from html import escape

from pneuma.state import Array, State


def table_of(state: State, url: str) -> str:
    """HTML: a row a body with its volume, pressure and place, under a link to the world's page."""
    rows = [
        row(body.name, f"{body.volume_m3:.4g}", f"{body.pressure_pa:.4g}", body.centre_of_mass)
        for body in state.soft.values()
    ]
    rows += [row(body.name, "", "", body.position) for body in state.rigid.values()]
    return (
        f'<p><a href="{escape(url)}" target="_blank">{escape(state.world)}</a> at tick {state.tick}, '
        f"{state.time_s:.3f} s</p>"
        "<table><tr><th>body</th><th>volume m³</th><th>pressure Pa</th><th>place m</th></tr>"
        + "".join(rows)
        + "</table>"
    )


def row(name: str, volume: str, pressure: str, place: Array) -> str:
    cells = (name, volume, pressure, ", ".join(f"{number:.3f}" for number in place))
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
