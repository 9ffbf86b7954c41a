"""The profiles: modes by name and number, the registry, and the simulator's mode numbers."""

import math
import re
from itertools import combinations
from pathlib import Path

import pytest

from simulator.modes import RULES, Mode
from simulator.px4.modes import RULES as PX4_RULES
from simulator.px4.modes import Px4Mode
from wire.autopilots import arducopter, arduplane, msp_multicopter, px4_multicopter, registry
from wire.autopilots.profile import AutopilotProfile, Sticks, mode_named
from wire.autopilots.registry import FAMILIES, PROFILES
from wire.dialect import mavlink

CHECKOUT = Path(__file__).resolve().parents[4]
ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
per_profile = pytest.mark.parametrize("profile", PROFILES, ids=lambda one: one.key)


@per_profile
def test_names_and_numbers_go_both_ways(profile: AutopilotProfile) -> None:
    for mode in profile.modes:
        assert profile.family.custom_mode(*mode.command_parameters) == mode.custom_mode
        assert profile.mode(mode.custom_mode) is mode
        assert profile.mode_name(mode.custom_mode) == mode.name
        for name in (mode.name, *mode.aliases):
            assert mode_named(profile.modes, name.lower().replace("_", " ")) is (mode if mode.settable else None)
    assert profile.mode_name(99) == "mode 99"


@per_profile
def test_no_name_or_number_is_given_twice(profile: AutopilotProfile) -> None:
    names = [name for mode in profile.modes for name in (mode.name, *mode.aliases)]
    assert len(names) == len(set(names))
    assert len({mode.custom_mode for mode in profile.modes}) == len(profile.modes)


@per_profile
def test_roles_are_modes_of_the_table(profile: AutopilotProfile) -> None:
    roles = [mode for mode in vars(profile.roles).values() if mode is not None]
    assert roles and all(mode in profile.modes and mode.settable for mode in roles)
    if profile.failsafe is not None:
        modes = profile.failsafe
        assert {*modes.ladder, *modes.going_home, *modes.pauses, modes.mission} <= set(profile.modes)
        assert all(mode.sticks is Sticks.IGNORED for mode in (*modes.pauses, *modes.going_home, modes.return_))
        assert modes.altitude_hold.drifts and not modes.altitude_hold.needs_position


def test_no_vehicle_has_two_profiles() -> None:
    for one, other in combinations(PROFILES, 2):
        assert one.key != other.key
        assert one.family.autopilot != other.family.autopilot or not one.vehicle_types & other.vehicle_types


def test_vehicles_are_found_by_autopilot_and_type() -> None:
    assert registry.of(ARDUPILOT, mavlink.MAV_TYPE_HEXAROTOR) is arducopter.PROFILE
    assert registry.of(ARDUPILOT, mavlink.MAV_TYPE_FIXED_WING) is arduplane.PROFILE
    assert registry.of(PX4, mavlink.MAV_TYPE_QUADROTOR) is px4_multicopter.PROFILE
    assert registry.of(PX4, mavlink.MAV_TYPE_FIXED_WING) is None
    assert registry.of(mavlink.MAV_AUTOPILOT_RESERVED, mavlink.MAV_TYPE_QUADROTOR) is msp_multicopter.PROFILE
    assert registry.of(mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR) is None


def test_the_nearest_kin_only_reads_modes() -> None:
    assert registry.nearest(PX4, mavlink.MAV_TYPE_FIXED_WING) is px4_multicopter.PROFILE
    assert registry.nearest(ARDUPILOT, mavlink.MAV_TYPE_AIRSHIP) is arduplane.PROFILE
    assert registry.nearest(mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR) is arducopter.PROFILE


def test_the_agent_acts_by_itself_with_multicopters_only() -> None:
    assert [profile.key for profile in PROFILES if profile.failsafe is not None] == ["arducopter", "px4_multicopter"]


def test_arducopters_sub_mode_is_not_read() -> None:
    assert FAMILIES[ARDUPILOT].custom_mode(5.0, math.nan) == 5
    with pytest.raises(ValueError):
        FAMILIES[PX4].custom_mode(4.0, math.nan)


@pytest.mark.parametrize(
    ("profile", "modes"), [(arducopter.PROFILE, Mode), (px4_multicopter.PROFILE, Px4Mode)], ids=["copter", "px4"]
)
def test_the_simulator_has_the_same_numbers(profile: AutopilotProfile, modes: type[Mode] | type[Px4Mode]) -> None:
    for mode in modes:
        known = profile.mode(mode.value)
        assert known is not None, mode
        assert mode.name in (known.name, known.name.removeprefix("AUTO.")), mode
        rules = {**RULES, **PX4_RULES}[mode] if modes is Px4Mode else RULES[mode]
        assert (known.sticks is Sticks.FLY) == rules.pilot_controlled, mode
        assert known.needs_position == rules.needs_position, mode


LOG_READERS = CHECKOUT / "server" / "flights" / "core" / "imports"
"""Each reads the log format of one autopilot, and says in the heartbeats that it writes whose it is."""
SOURCES = ("wire", "server", "onboard_agent", "connect")
COMPARES = re.compile(r"MAV_AUTOPILOT_(PX4|ARDUPILOTMEGA)|(COPTER|PLANE|ROVER|SUB)_MODE|px4_custom_mode|is_px4")


def test_nobody_else_asks_which_autopilot_it_is() -> None:
    """Facts belong to profiles. Code that compares the autopilot's name would duplicate them."""
    found = [
        f"{path.relative_to(CHECKOUT)}: {line.strip()}"
        for package in SOURCES
        for path in sorted((CHECKOUT / package).rglob("*.py"))
        if path.parent not in (CHECKOUT / "wire" / "autopilots", LOG_READERS)
        for line in path.read_text(encoding="utf-8").splitlines()
        if COMPARES.search(line)
    ]
    assert found == []
    assert any(COMPARES.search(path.read_text()) for path in (CHECKOUT / "wire" / "autopilots").glob("*.py"))
