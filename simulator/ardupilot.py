"""The ArduCopter 4.6 flavour, assembled from the other modules of this package.

`arducopter` makes one of another release: it differs in its version and in what it takes of a mission. Parameters and
flight are those of 4.6.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from simulator.arming import why_not_arm, why_not_ready
from simulator.commands import HANDLERS
from simulator.commands_flight import set_mode_number
from simulator.failsafe import Failsafes
from simulator.fence_rules import fence_limits, on_fence_breach
from simulator.flavour import Flavour, Storage
from simulator.mission_plan import PlanKind
from simulator.mission_storage import Release, accept_item, fence_total, why_not_jump, why_not_whole
from simulator.mode_table import make_behaviours
from simulator.modes import RULES, Mode
from simulator.parameters import Parameters
from simulator.reports_camera import camera_feedback
from simulator.reports_health import HEALTH_REPORTS, version_report
from simulator.reports_motion import MOTION_REPORTS
from simulator.sticks import Sticks

RELEASES: dict[str, tuple[int, int, int]] = {"4.5": (4, 5, 7), "4.6": (4, 6, 2), "4.7": (4, 7, 0)}
USUAL = "4.6"


def _storage(release: Release) -> Storage:
    return Storage(partial(accept_item, release=release), why_not_jump, why_not_whole, fence_total)


ARDUPILOT = Flavour(
    name="ardupilot",
    banner=("ArduCopter V4.6.2 (simulated)", "Frame: QUAD/X"),
    first_mode=Mode.STABILIZE,
    land_mode=Mode.LAND,
    rules=RULES,
    make_behaviours=make_behaviours,
    make_parameters=Parameters,
    make_sticks=Sticks,
    make_failsafes=Failsafes,
    why_not_ready=why_not_ready,
    why_not_arm=why_not_arm,
    home_slot=True,
    keeps_dataflash_logs=True,
    keeps_parameter_file=True,
    offers_metadata=False,
    storage=_storage(RELEASES[USUAL][:2]),
    items_max={PlanKind.MISSION: 650, PlanKind.FENCE: 70, PlanKind.RALLY: 46},
    fence_limits=fence_limits,
    on_fence_breach=on_fence_breach,
    handlers=HANDLERS,
    reports={**HEALTH_REPORTS, **MOTION_REPORTS},
    setup_reports={191: lambda flight: flight.setup.progress(flight), 192: lambda flight: flight.setup.report(flight)},
    photo_message=camera_feedback,
    intervals_s={0: 1.0},
    fixed_rates=frozenset(),
    obeys_stream_requests=True,
    answers_modes_twice=False,
    reports_mode_at_once=True,
    system_id_parameter="SYSID_THISMAV",
    battery_parameter="BATT_CAPACITY",
    accepts_any_ground_station=False,
    signs=True,
    disarm_delay_s=lambda flight: flight.parameters["DISARM_DELAY"],
    lands_with_throttle_up=False,
    set_mode_number=set_mode_number,
)


def arducopter(release: str) -> Flavour:
    """`release`: one of RELEASES."""
    major, minor, patch = RELEASES[release]
    return replace(
        ARDUPILOT,
        banner=(f"ArduCopter V{major}.{minor}.{patch} (simulated)", *ARDUPILOT.banner[1:]),
        storage=_storage((major, minor)),
        reports={**ARDUPILOT.reports, 148: version_report(major, minor, patch)},
    )
