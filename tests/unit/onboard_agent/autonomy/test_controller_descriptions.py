"""What controllers say of their settings: to the tower, and before they begin."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise
from math import dist

import pytest
from controller_world import ControllerWorld

from onboard_agent.autonomy.built_in_settings import BUILT_IN_SETTINGS
from onboard_agent.autonomy.challenge import Challenge
from onboard_agent.autonomy.challenge_settings import SETTINGS, ChallengeSettings
from onboard_agent.autonomy.controller_settings import BadSetting, with_settings
from onboard_agent.autonomy.core.lines import CameraSetting, SetUp
from onboard_agent.autonomy.loading import load
from onboard_agent.autonomy.search_pattern import square_spiral
from onboard_agent.autonomy.setting import BUILT_IN
from wire.controller_settings import (
    CONTROLLER_SETTINGS,
    ControllerDescribed,
    ControllerSetting,
    SettingKind,
    fault_of,
)

EYES = (CameraSetting("down", "video"), CameraSetting("ahead", "v4l2:/dev/video0", tilt_deg=0.0))
ROUNDS = ControllerSetting(name="rounds", kind=SettingKind.NUMBER, default=2.0, label="Rounds", least=1.0, most=9.0)


def test_every_setting_of_the_challenge_is_described_once_with_its_own_default() -> None:
    described = {one.name: one.default for one in SETTINGS}
    assert described == {one.name: one.default for one in fields(ChallengeSettings)}
    assert len(SETTINGS) == len(described)
    assert fault_of(SETTINGS, described) is None
    assert ChallengeSettings.of(described) == ChallengeSettings()
    assert all(one.label and one.about for one in SETTINGS)
    assert all(one.unit and one.least is not None for one in SETTINGS if one.kind is SettingKind.NUMBER)


def test_every_built_in_controller_says_what_its_class_says() -> None:
    assert {name: load(name, "").described_settings for name in BUILT_IN} == BUILT_IN_SETTINGS


def told(world: ControllerWorld) -> list[ControllerDescribed]:
    return [one for one in world.reported if isinstance(one, ControllerDescribed)]


def test_the_tower_is_told_once_for_each_link_with_the_cameras_of_this_drone() -> None:
    world = ControllerWorld(Challenge(), cameras=("down,tilt=90 video",), takes=("transactions", CONTROLLER_SETTINGS))
    world.ready()
    assert sorted(one.controller for one in told(world)) == ["challenge", "scripted"]
    (challenge,) = (one for one in told(world) if one.controller == "challenge")
    camera = next(one for one in challenge.settings if one.kind is SettingKind.CAMERA)
    assert camera.choices == ("", "down")
    assert [one.name for one in challenge.settings] == [one.name for one in SETTINGS]


def test_an_older_tower_is_told_nothing() -> None:
    world = ControllerWorld(takes=("transactions",))
    world.ready()
    assert told(world) == []


def test_a_controller_gets_each_described_setting() -> None:
    given = with_settings(SetUp("survey", settings={}), (ROUNDS,))
    assert given.settings == {"rounds": 2.0}
    given = with_settings(SetUp("survey", settings={"rounds": 3.0}), (ROUNDS,))
    assert given.settings == {"rounds": 3.0}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rounds": 10.0}, "rounds: must be from 1 to 9"),
        ({"round": 1.0}, "round: is no setting of this controller"),
        ({"eye": "left"}, "eye: must be one of: down, ahead"),
    ],
)
def test_what_is_no_setting_never_reaches_the_controller(settings: dict[str, str | float], words: str) -> None:
    eye = ControllerSetting(name="eye", kind=SettingKind.CAMERA, default="", label="Camera")
    with pytest.raises(BadSetting, match=f"^{words}$"):
        with_settings(SetUp("survey", settings=settings, cameras=EYES), (ROUNDS, eye))


def test_a_controller_that_describes_nothing_gets_what_was_given() -> None:
    set_up = SetUp("survey", settings={"whatever": "x"})
    assert with_settings(set_up, None) is set_up


@pytest.mark.parametrize(("around_m", "apart_m"), [(20.0, 8.0), (8.0, 8.0), (100.0, 1.6), (5.0, 8.0)])
def test_a_spiral_stays_within_its_square_and_passes_every_place_in_it(around_m: float, apart_m: float) -> None:
    corners = square_spiral(around_m, apart_m)
    assert corners[0] == (0.0, 0.0)
    assert all(max(abs(north), abs(east)) <= around_m for north, east in corners)
    assert all(a != b and min(abs(a[0] - b[0]), abs(a[1] - b[1])) < 1e-9 for a, b in pairwise(corners))
    reached = int(around_m / apart_m) * apart_m
    seen = list(_along(corners, apart_m / 4))
    for place in ((reached, reached), (-reached, reached / 2), (reached / 3, -reached), (-reached / 2, reached / 4)):
        assert min(dist(place, one) for one in seen) <= 0.75 * apart_m


def _along(corners: list[tuple[float, float]], every_m: float) -> list[tuple[float, float]]:
    places = [corners[0]]
    for a, b in pairwise(corners):
        steps = max(1, round(dist(a, b) / every_m))
        places += [(a[0] + (b[0] - a[0]) * n / steps, a[1] + (b[1] - a[1]) * n / steps) for n in range(1, steps + 1)]
    return places
