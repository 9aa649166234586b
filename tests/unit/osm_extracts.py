"""Small invented extracts of OpenStreetMap."""

from collections.abc import Sequence
from pathlib import Path

STEP_DEG = 0.009
"""About a kilometre along the equator. [deg]"""


def extract(
    folder: Path,
    *,
    ways: Sequence[tuple[int, Sequence[int], str]],
    relations: Sequence[str],
    lost: Sequence[int] = (),
    extra: str = "",
) -> Path:
    """
    Write an extract: nodes 1 to 9 lie on the equator, every second one of them a stop.

    Parameters
    ----------
    folder
        Where.
    ways
        Identifier, nodes and further tags as XML.
    relations
        Relations as XML.
    lost
        Nodes that are left out.
    extra
        Further XML.
    """
    rows = ['<?xml version="1.0" encoding="UTF-8"?>', '<osm version="0.6">']
    for number in range(1, 10):
        if number in lost:
            continue
        lon_deg = STEP_DEG * (number - 1)
        tags = (
            f'<tag k="railway" v="stop"/><tag k="name" v="駅{number}"/>'
            f'<tag k="name:en" v="Stop {number}"/>'
            if number % 2
            else ""
        )
        rows.append(f'<node id="{number}" version="1" lon="{lon_deg:.6f}" lat="0.0">{tags}</node>')
    for ref, nodes, tags in ways:
        inner = "".join(f'<nd ref="{node}"/>' for node in nodes)
        rows.append(f'<way id="{ref}" version="1">{inner}{tags}</way>')
    rows += [*relations, extra, "</osm>"]
    path = folder / "town.osm"
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


def rail(*tags: tuple[str, str]) -> str:
    """Return the tags of a way with rails."""
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in (("railway", "rail"), *tags))


def route(number: int, ref: str, ways: Sequence[int], stops: Sequence[int], more: str = "") -> str:
    """Return a route relation."""
    members = "".join(f'<member type="node" ref="{node}" role="stop"/>' for node in stops)
    members += "".join(f'<member type="way" ref="{way}" role=""/>' for way in ways)
    return (
        f'<relation id="{number}" version="1">{members}{more}<tag k="type" v="route"/>'
        f'<tag k="route" v="train"/><tag k="ref" v="{ref}"/><tag k="name" v="Line {ref}"/>'
        "</relation>"
    )
