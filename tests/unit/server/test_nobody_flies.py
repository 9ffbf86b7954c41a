"""In the air with nobody, whatever the mode: the whole simulator, the real agent and the hub, and what people are told.

The rules alone are tested in `test_agent_person_watch.py` and `test_open_hold_begun.py`.
"""

import pytest
from alert_flight import UP_M, FlownHub, M
from worlds.held_copter import mode_command

from server.live.live_drone import LeaseView
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from wire.control_messages import ControlChanged
from wire.ids import DroneId, Epoch
from wire.open_holds import LostPhase

ONE = DroneId(1)
BECAUSE = "alice released the controls"


def hovering() -> FlownHub:
    """Up in GUIDED, where no hand is needed."""
    flown = FlownHub()
    flown.take_off()
    flown.hand = None
    flown.send(mode_command(Mode.GUIDED))
    flown.pass_time(3.0)
    assert flown.vehicle.flight.mode is Mode.GUIDED
    flown.watch()
    return flown


def released(flown: FlownHub) -> None:
    """alice lets it go: the hub shuts her out, and tells the agent."""
    flown.epoch += 1
    lease = LeaseView(holder=None, taken_from=None, epoch=Epoch(flown.epoch))
    alice = flown.hub.state.drones[ONE].lease.holder
    flown.hub.apply_lease(ONE, lease, event="released", by=alice, reason="", now=flown.now)
    flown.message(ControlChanged(epoch=flown.epoch, holder=None, holder_present=False))


def expect_countdown(flown: FlownHub) -> None:
    """One countdown, its cause in the drone's view and in its alert, and no second alert of the same danger."""
    flown.pass_until(lambda: flown.is_open("lost-action-counting"), within_s=5.0)
    flown.pass_time(3.0)
    hold = flown.hub.state.drones[ONE].hold_view()
    assert hold is not None
    assert (hold.phase, hold.open, hold.nobody_because) == (LostPhase.COUNTING, False, BECAUSE)
    (alert,) = [one for one in flown.hub.alerts.live() if one.rule.name == "lost-action-counting"]
    assert alert.words.startswith(f"Nobody flies {flown.hub.state.drones[ONE].record.name} ({BECAUSE}). It returns at ")
    assert not flown.is_open("unattended")


def expect_home(flown: FlownHub) -> None:
    flown.pass_until(lambda: flown.vehicle.flight.mode is Mode.RTL, within_s=32.0)
    flown.pass_until(lambda: flown.is_open("lost-action"), within_s=3.0)


def test_a_drone_that_is_released_while_it_hovers_comes_home() -> None:
    flown = hovering()
    released(flown)
    expect_countdown(flown)
    expect_home(flown)


def test_somebody_who_says_stay_is_told_that_nobody_has_the_controls() -> None:
    flown = hovering()
    released(flown)
    expect_countdown(flown)
    flown.stay()
    flown.pass_until(lambda: flown.is_open("unattended"), within_s=5.0)
    flown.pass_time(40.0)
    assert flown.vehicle.flight.mode is Mode.GUIDED


@pytest.mark.parametrize("restarts", [False, True])
def test_a_mission_flies_alone_until_it_is_over(restarts: bool) -> None:
    flown = hovering()
    plans, lat_lon = flown.vehicle.flight.plans, flown.place
    ways = [Item(16, x=e7(lat_lon[0] + north_m * M), y=e7(lat_lon[1]), z=UP_M) for north_m in (0.0, 60.0, 120.0)]
    plans.store(PlanKind.MISSION, ways, flown.vehicle.flight.home)
    flown.send(mode_command(Mode.AUTO))
    flown.pass_time(2.0)
    released(flown)
    flown.pass_until(lambda: flown.is_open("unattended"), within_s=5.0)
    assert flown.state.phase is LostPhase.QUIET, "it was started to fly alone"
    if restarts:
        flown.link_down()
        flown.begin_agent()
        flown.link_up(holder=None, present=False)
    flown.pass_until(lambda: plans.current == len(ways), within_s=90.0)
    assert flown.vehicle.flight.mode is Mode.AUTO, "ArduCopter hovers there, for as long as its battery lasts"
    expect_countdown(flown)
    expect_home(flown)
