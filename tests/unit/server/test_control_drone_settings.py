"""Which settings of a drone are valid."""

import pytest

from server.kernel.drone_settings import BOUNDS, DEFAULTS, BadDroneSettings, check_ladder, settings_from
from wire.control_messages import SafetySettings, StreamSettings
from wire.open_holds import LostAction
from wire.stream_profiles import StreamChoice


def test_the_defaults_are_those_of_the_wire_and_within_bounds() -> None:
    assert DEFAULTS.safety == SafetySettings()
    assert DEFAULTS.stream == StreamSettings()
    for name, (least, most) in BOUNDS.items():
        assert least <= DEFAULTS.as_values()[name] <= most


@pytest.mark.parametrize(
    "ladder",
    [[], ["ALT_HOLD"], ["LOITER", "POSHOLD", "BRAKE", "ALT_HOLD"], ["AUTO.LOITER", "POSCTL", "ALTCTL"], ["BRAKE"]],
)
def test_a_ladder_that_can_be_climbed_down(ladder: list[str]) -> None:
    assert check_ladder(ladder) == ladder


@pytest.mark.parametrize(
    "ladder",
    [["RTL"], ["loiter"], ["LOITER", "POSCTL"], ["LOITER", "LOITER"], ["ALT_HOLD", "LOITER"], ["ALTCTL", "POSCTL"]],
)
def test_a_ladder_that_cannot(ladder: list[str]) -> None:
    with pytest.raises(ValueError, match=r"modes of one|each mode once|comes last"):
        check_ladder(ladder)


def test_what_was_chosen_stands_and_the_rest_is_as_usual() -> None:
    chosen = {"hold_ladder": ["LOITER"], "lost_action": "continue", "rtt_limit_s": 2.5, "stream_profile": "thin"}
    chosen["of_a_later_version"] = 1
    settings = settings_from(chosen)
    assert settings.safety.hold_ladder == ("LOITER",)
    assert settings.safety.lost_action is LostAction.CONTINUE
    assert (settings.safety.rtt_limit_s, settings.safety.rtt_limit_ms) == (2.5, 500.0)
    assert settings.stream == StreamSettings(profile=StreamChoice.THIN)
    assert settings_from(settings.as_values()) == settings


def test_what_an_older_version_stored_is_understood() -> None:
    settings = settings_from({"lost_action": "nothing", "hold_bound_s": 60.0})
    assert settings.safety.lost_action is LostAction.STAY
    assert "hold_bound_s" not in settings.as_values()


def test_the_action_comes_after_the_hold() -> None:
    with pytest.raises(BadDroneSettings):
        settings_from({"lost_hold_s": 20.0, "lost_action_s": 19.0})
