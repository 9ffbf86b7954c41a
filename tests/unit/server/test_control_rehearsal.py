"""Proof that an autopilot is simulated: a loss may then be rehearsed in flight without further confirmation."""

import pytest
from hub_world import LATER, HubWorld

from server.control.core.simulated import is_simulator
from server.control.store.rehearsal import NOT_ARMED, needs_no_hold, refusal_of
from server.kernel.people import Principal, Role
from wire.control_messages import AutopilotState, LossParameters
from wire.ids import DroneId, UserId


@pytest.mark.parametrize(
    ("autopilot", "values", "simulated"),
    [
        ("ardupilot", {"SIM_SPEEDUP": 1.0}, True),
        ("ardupilot", {"SIM_SPEEDUP": -1.0}, True),
        ("ardupilot", {"FS_GCS_ENABLE": 1.0}, False),
        ("px4", {"SYS_HITL": 0.0, "SIM_GZ_EN": 1.0}, True),
        ("px4", {"SYS_HITL": 0.0, "SIM_GZ_EN": 0.0, "SENS_EN_GPSSIM": 1.0}, True),
        ("px4", {"SYS_HITL": 1.0}, True),
        ("px4", {"SYS_HITL": 2.0}, True),
        # A PX4 on a real board has these as well, switched off.
        ("px4", {"SYS_HITL": 0.0, "SIM_BAT_DRAIN": 60.0}, False),
        ("px4", {"SYS_HITL": -1.0}, False),
        ("", {}, False),
    ],
)
def test_a_simulated_autopilot_is_known_by_its_parameters(
    autopilot: str, values: dict[str, float], simulated: bool
) -> None:
    assert is_simulator(LossParameters(autopilot=autopilot, values=values, complete=True)) is simulated


def test_nothing_told_proves_nothing() -> None:
    assert not is_simulator(None)


ON_GROUND = AutopilotState(heard=True, armed=False, airborne=False)
ARMED = AutopilotState(heard=True, armed=True, airborne=False)
WATCHED = AutopilotState(heard=True, armed=False, airborne=False, watched_only=True)
SILENT = AutopilotState(heard=False, armed=False, airborne=False)


@pytest.mark.parametrize(
    ("state", "words", "needless"),
    [
        (ON_GROUND, None, True),
        (ARMED, "is armed", False),
        (SILENT, "may be in the air", False),
        (None, "may be", False),
    ],
)
def test_only_what_is_known_to_be_on_the_ground_is_rehearsed_without_being_asked(
    state: AutopilotState | None, words: str | None, needless: bool
) -> None:
    world = HubWorld()
    agent, drone = world.agent(1), world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    if state is not None:
        world.hub.reports.receive(agent.link, state)
    admin = Principal(UserId(9), "admin", Role.ADMIN, 9, LATER)
    refused = refusal_of(drone, admin, "tower", in_flight=False)
    assert (refused is None) == (words is None)
    assert refused is None or (words or "") in refused.words
    assert refusal_of(drone, admin, "tower", in_flight=True) is None
    assert (needs_no_hold(drone, "tower", 0.0) == NOT_ARMED) is needless


def test_a_vehicle_that_is_watched_only_has_no_hold_to_rehearse() -> None:
    world = HubWorld()
    agent, drone = world.agent(1), world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    world.hub.reports.receive(agent.link, WATCHED)
    assert drone.view().watched_only
    admin = Principal(UserId(9), "admin", Role.ADMIN, 9, LATER)
    refused = refusal_of(drone, admin, "tower", in_flight=True)
    assert refused is not None and refused.code == "watched-only"
    world.hub.reports.receive(agent.link, ON_GROUND)
    assert refusal_of(drone, admin, "tower", in_flight=True) is None
