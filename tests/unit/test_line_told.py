"""What results keep of the line and its trains, beside the tables."""

import json
import math

import pytest

from kankaku.analysis.tables.columns import json_text
from kankaku.analysis.tables.line_told import finite, line_told
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of


@pytest.mark.parametrize("name", ["rush_hour", "whole_line", "overtaking", "sakai_case1"])
def test_every_shipped_kind_of_line_is_told_as_json(name: str) -> None:
    scenario = load(folder_of(name))
    told = json.loads(json_text(line_told(scenario, ["oracle"])))
    assert told["title"] == scenario.title
    assert told["knows_future"] == ["oracle"]
    assert [one["id"] for one in told["stations"]] == [one.id for one in scenario.line.stations]
    tracks = {track.physical for track in scenario.line.tracks}
    assert {one["id"] for one in told["tracks"]} == tracks
    assert {end for pair in told["joints"] for end in pair} <= tracks
    assert (told["published"] is None) == (scenario.published is None)
    for train, kind in told["type_of"].items():
        assert told["train_types"][kind]["length_m"] > 0.0, train


def test_falling_tracks_are_told_by_chainage() -> None:
    scenario = load(folder_of("whole_line"))
    line = scenario.line
    told = line_told(scenario)
    stop_of = {(one.station, one.track): one for one in line.platforms}
    seen = 0
    for place in told["platforms"]:
        station = line.station_by_id[place["station"]]
        # A platform lies within half a kilometre of its station, whichever way trains pass it.
        assert abs(place["stop_m"] - station.chainage_m) < 500.0
        assert place["start_m"] < place["end_m"]
        seen += 1
    assert seen == len(stop_of)


def test_what_json_cannot_hold_is_nothing() -> None:
    told = finite({"a": [1.0, math.inf, (math.nan, "x")], "b": {"c": True}})
    assert told == {"a": [1.0, None, [None, "x"]], "b": {"c": True}}
