"""Controllers by the names of their layers, and options with other values."""

from dataclasses import replace
from typing import cast

import pytest

from kankaku.controllers.choosing import changed_options, named, with_settings
from kankaku.controllers.registry import OPERATIONS, PROTECTIONS, ControllerError, Layer, options_of
from kankaku.railway.plan.scenario import ControllerSpec

PLAIN = ControllerSpec("plain", "moving_block", "two_stage", {"margin_m": 10.0}, {})
DOTTED = ControllerSpec("plain.b", "multi_step_atc", "eco", {}, {})
PEER = ControllerSpec("peer", "", "", {}, {}, peer="sumo_native_fixed")
SPECS = (PLAIN, DOTTED, PEER)


def test_a_controller_of_the_scenario_goes_by_its_name_and_any_other_by_its_layers() -> None:
    assert named(SPECS, "plain") is PLAIN
    found = named(SPECS, "atd+eco")
    assert (found.name, found.protection, found.operation) == ("atd+eco", "atd", "eco")
    assert not changed_options(found)
    assert found.by_default


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "closeup",
            "'closeup' is not a controller of this scenario; allowed: plain, plain.b, peer",
        ),
        (
            "atc+eco",
            "'atc' is not a known protection; allowed: 'atd' (did you mean that?) among ",
        ),
        (
            "atd+echo",
            "'echo' is not a known operation; allowed: 'eco' (did you mean that?) among ",
        ),
        ("atd+eco+eco", "'eco' is not a known supervision"),
        ("+", "'' is not a known protection"),
    ],
)
def test_an_unknown_controller_or_layer_is_answered_with_the_known_ones(
    name: str, told: str
) -> None:
    with pytest.raises(ControllerError, match=r"^--controller: ") as caught:
        named(SPECS, name)
    assert told in str(caught.value)


def test_options_are_set_in_the_layer_that_has_them_and_typed_as_in_the_file() -> None:
    settings = [
        "plain.margin_m=30",
        "plain.slowest_kmh = 20",
        "plain.exclusive_platform=true",
        "plain.b.codes_kmh=[80, 40.5, 0]",
        "plain.b.operation.patience_s=4",
        "plain.margin_m=40",
    ]
    plain, dotted, peer = with_settings(SPECS, settings)
    # The last value of an option counts.
    assert plain.protection_options == {"margin_m": 40.0, "exclusive_platform": True}
    assert plain.operation_options == {"slowest_kmh": 20.0}
    assert dotted.protection_options == {"codes_kmh": (80.0, 40.5, 0.0)}
    assert dotted.operation_options == {"patience_s": 4.0}
    assert peer is PEER
    assert PLAIN.protection_options == {"margin_m": 10.0}
    # What results are told apart by.
    assert options_of(plain)["operation"]["slowest_kmh"] == 20.0
    assert changed_options(plain) == {
        "margin_m": 40.0,
        "exclusive_platform": True,
        "slowest_kmh": 20.0,
    }


def test_the_radio_of_a_controller_can_be_switched_on() -> None:
    assert with_settings((PLAIN,), ["plain.radio=true"])[0].radio


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("plain.slowest=20", "option 'slowest' is not known to plain; allowed: margin_m, "),
        ("other.margin_m=2", "'other' is not a controller that is to run; allowed: plain, "),
        ("plain.margin_m=wide", "'wide'; allowed: a finite number, true or false"),
        ("plain.margin_m=inf", "'inf'; allowed: a finite number"),
        ("plain.margin_m=nan", "'nan'; allowed: a finite number"),
        ("plain.margin_m=1\nradio=true", "allowed: a finite number"),
        ("plain.margin_m=[[1.0]]", "allowed: a finite number"),
        ("plain.margin_m=" + "[" * 100_000, "allowed: a finite number"),
        ("plain.margin_m=1" + "0" * 400, "allowed: a finite number"),
        ("plain.margin_m=", "allowed: a finite number"),
        ("plain.margin_m=true", "--set: plain.margin_m: True; allowed: a number"),
        ("plain.margin_m=-1", "--set: plain.margin_m: margin_m is -1; allowed: 0 to 1000"),
        ("plain.radio=1", "allowed: true or false"),
        ("plain.margin_m", "is no setting; allowed: <controller>.<option>=<value>"),
        ("plain=3", "is no setting"),
        ("peer.margin_m=3", "peer is a peer, which has no options"),
        ("peer.radio=true", "peer is a peer, which has no options"),
    ],
)
def test_a_setting_that_is_not_allowed_is_answered_with_what_is(setting: str, told: str) -> None:
    with pytest.raises(ControllerError, match=r"^--set: ") as caught:
        with_settings(SPECS, [setting])
    assert told in str(caught.value)
    assert len(str(caught.value)) < 400


def test_an_option_of_both_layers_is_named_with_its_layer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    layer = replace(OPERATIONS["close_up"], options=PROTECTIONS["moving_block"].options)
    monkeypatch.setitem(cast("dict[str, Layer]", OPERATIONS), "twin", layer)
    twin = ControllerSpec("twin", "moving_block", "twin", {}, {})
    with pytest.raises(ControllerError) as caught:
        with_settings((twin,), ["twin.margin_m=30"])
    assert caught.value.allowed == "twin.protection.margin_m, twin.operation.margin_m"
    (found,) = with_settings((twin,), ["twin.operation.margin_m=30"])
    assert (found.protection_options, found.operation_options) == ({}, {"margin_m": 30.0})
    both = with_settings((found,), ["twin.protection.margin_m=20"])
    assert changed_options(both[0]) == {"protection.margin_m": 20.0, "operation.margin_m": 30.0}
    both = (ControllerSpec("both", "control_map", "close_up", {}, {}),)
    with pytest.raises(ControllerError, match=r"option .operation\.margin_m. is not known"):
        with_settings(both, ["both.operation.margin_m=30"])
