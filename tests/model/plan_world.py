"""The full path of a plan, where only the wires and the database are fake: the tower's hub with its operations service,
the agent with its services and journal, the sealed link between them, the simulator's vehicle. One clock.

`step` advances everything by 10 ms and checks the invariants:
- The vehicle flies one whole plan, never half of one.
- Nothing of a new plan is written under an epoch that the agent knows to be over.
- The reported result of an operation is what is on board, or that it is unknown.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final

from model_store import Account, MemoryStore
from model_tower import ModelTower
from plan_agent import DRONE, MISSION, MemoryJournal, ParamValue, PlanAgent
from plan_samples import NEW, OLD, THIRD

from server.control.core.lease import Event, Lease
from server.kernel.people import Role, UserRef
from server.operations.core.operation import STATE_OF, Lane, Operation, Order, State, Step
from server.operations.core.refusals import DroneBusy, DroneOffline
from server.plans.core import plans
from simulator.dialect import Codec
from simulator.failure_modes import Failure
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.vehicle import Vehicle, VehicleSettings
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.control_messages import SafetySettings
from wire.dialect import build, mavlink
from wire.ids import DroneId, LinkId, UserId
from wire.open_holds import LostAction
from wire.plan_keeping import same_plan
from wire.plans import Plan, PlanItem, plan_hash
from wire.tagged import tag
from wire.transactions import CommandWork, Outcome, PlanUploadWork

STEP_S: Final = 0.01
TOWER_EVERY: Final = 10
ALICE, ROOT = UserId(1), UserId(8)
HOME: Final = Place(47.397742, 8.545594, 488.0)
HEIGHT_M: Final = 2.0
QUIET_S: Final = 40.0
AUTO: Final = (1.0, float(Mode.AUTO), 0.0, 0.0, 0.0, 0.0, 0.0)
SETTINGS: Final = SafetySettings(lost_action=LostAction.CONTINUE, lost_hold_s=1.0, lost_action_s=3.0)
"""Continues when the tower is lost: a mission that resumes then must not be half of one."""


@dataclass
class PlanWorld:
    """One drone of Alice, in the air over home. `in_place`: its autopilot overwrites the old items as the new ones
    arrive, as ArduPilot does."""

    in_place: bool = True
    now: float = 1000.0
    journal: MemoryJournal = field(default_factory=MemoryJournal)
    network: deque[tuple[DroneId, bytes]] = field(default_factory=deque)
    wholes: set[Plan] = field(default_factory=lambda: {OLD})
    results: dict[int, ParamValue] = field(default_factory=dict)
    """By transaction."""
    operations: list[Operation] = field(default_factory=list)
    """Operations of the current tower process."""
    works: dict[int, Any] = field(default_factory=dict)
    """The work of each operation, by operation id: an ended operation does not keep it."""
    forgotten: list[Operation] = field(default_factory=list)
    """Operations of earlier tower processes, which nothing tracks any more."""
    lives: list[ModelTower] = field(default_factory=list)
    agent: PlanAgent | None = None
    slow: bool = False
    """Whether the tower's messages are delayed in transit."""
    unplugged_until: float = 0.0
    """Until then the line between agent and autopilot is unplugged."""
    halves: int = 0
    """Steps in which half a plan was on board, not flown."""
    flown: set[Plan] = field(default_factory=set)
    _steps: int = 0
    _links: int = 0
    _processes: int = 0
    _frames: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        failures = [Failure.MISSION_WRITTEN_IN_PLACE] if self.in_place else []
        self.vehicle = Vehicle(VehicleSettings(FlightSettings(HOME, boot_s=0.1)), failures)
        self.began = self.now
        self._take_off()
        self.load(OLD)
        accounts = {ALICE: Account("alice", Role.OPERATOR, {DRONE}), ROOT: Account("root", Role.ADMIN, set())}
        self.store = MemoryStore(accounts, {DRONE: Lease()})
        self.start_tower()
        self.change_hands(ALICE, Event.ACQUIRE)
        self.start_agent()
        self.run_until(self.is_quiet)

    # -- the vehicle ---------------------------------------------------------------------------------------------

    def _take_off(self) -> None:
        codec = Codec(255, 190)
        for at, (number, *params) in ((0.3, (176, 1, 4)), (0.4, (400, 1)), (0.5, (22, 0, 0, 0, 0, 0, 0, HEIGHT_M))):
            self._fly(at)
            said = mavlink.MAVLink_command_long_message(1, 1, number, 0, *params, *([0] * (7 - len(params))))
            self.vehicle.receive(codec.encode(said), self.now - self.began)
        self._fly(4.0)
        assert self.vehicle.flight.armed and not self.vehicle.flight.landed
        self.vehicle.datagrams_to_send()

    def _fly(self, until: float) -> None:
        self.now = self.began + until
        self.vehicle.step(until)

    def load(self, plan: Plan) -> None:
        """Loads a plan straight into the autopilot."""
        from simulator.mission_plan import Item
        from simulator.mission_plan import PlanKind as Stored

        items = [Item(one.command, one.frame, _numbers(one), one.x, one.y, one.z, 1) for one in plan]
        self.vehicle.flight.plans.store(Stored.MISSION, [Item(16, 0), *items], self.vehicle.flight.home)

    def on_board(self) -> Plan:
        """Returns the plan that the vehicle would fly."""
        return tuple(
            PlanItem(one.command, int(one.frame), one.params, one.x, one.y, one.z, one.autocontinue)
            for one in self.vehicle.flight.plans.mission[1:]
        )

    @property
    def is_whole(self) -> bool:
        return self.on_board() in self.wholes

    @property
    def flies_mission(self) -> bool:
        return self.vehicle.flight.armed and self.vehicle.flight.mode is Mode.AUTO

    def from_vehicle(self) -> list[bytes]:
        frames, self._frames = self._frames, []
        return frames

    def to_vehicle(self, frame: bytes) -> None:
        if self.now >= self.unplugged_until:
            self.vehicle.receive(frame, self.now - self.began)

    def reboot_vehicle(self) -> None:
        """Restarts the vehicle: it keeps its plans, is on the ground and disarmed, and sends nothing for a while."""
        self.vehicle._reboot()
        self.unplugged_until = self.now + 2.0

    def switch_to_mission(self) -> None:
        """Switches to the mission by the pilot's radio, but only before anything is written: nothing can prevent it
        later."""
        if self.is_whole and self.agent is not None and not self.agent.has_written:
            self.vehicle.flight.set_mode(Mode.AUTO)

    # -- lives and deaths ----------------------------------------------------------------------------------------

    def start_tower(self) -> None:
        self.lives.append(ModelTower(self.store, lambda: self.now))
        self.tower.hub.operations._last_id = 1000 * len(self.lives)  # a real tower uses the time of day
        for user_id in (ALICE, ROOT):
            self.tower.open_browser(user_id)

    @property
    def tower(self) -> ModelTower:
        return self.lives[-1]

    def kill_tower(self) -> None:
        """Kills the tower and starts another at once. The agent has to find it."""
        self.tower.die()
        self.forgotten += self.operations
        self.operations.clear()
        if self.agent is not None:
            self.agent.disconnect(None, self.now)
        self.network.clear()
        self.start_tower()

    def start_agent(self) -> None:
        self._processes += 1
        self.agent = PlanAgent(self, self._processes)
        self.connect()

    def kill_agent(self) -> None:
        """Kills the agent until `start_agent`. The tower notices that the connection is gone."""
        if self.agent is not None:
            self.agent.disconnect(self.tower.hub, self.now)
        self.agent = None
        self._frames.clear()

    def connect(self) -> None:
        if self.agent is None or self.agent.is_linked_to(self.tower.hub):
            return
        self._links += 1
        self.agent.connect(self.tower.hub, LinkId(self._links), self.network, self.now)
        self.agent.control.append(SETTINGS)

    def cut(self) -> None:
        """Ends the link on both sides."""
        if self.agent is not None:
            self.agent.disconnect(self.tower.hub, self.now)
        self.network.clear()

    def lose_channel(self) -> None:
        """Breaks the control channel. The data channel continues for a while."""
        if self.agent is not None:
            self.agent.lose_channel(self.tower.hub, self.now)

    def resume(self) -> None:
        if self.agent is not None and not self.agent.has_channel:
            self.agent.resume(self.tower.hub, self.now)

    # -- people --------------------------------------------------------------------------------------------------

    def change_hands(self, user_id: UserId, event: Event) -> None:
        self.tower.ask(user_id, DRONE, event, watch=True)
        self.tower.settle()

    def upload(self, plan: Plan, *, while_flying: bool = False) -> Operation | None:
        """Returns None if the tower refuses the upload."""
        self.wholes.add(plan)
        return self._begin(plans.upload(MISSION, plan, while_flying=while_flying))

    def clear(self) -> Operation | None:
        self.wholes.add(())
        return self._begin(plans.clear(MISSION, while_flying=False))

    def cancel(self) -> None:
        for operation in self.operations:
            if operation.running and operation.order.lane is Lane.PLANS:
                self.tower.hub.operations.cancel(operation)

    def start_mission(self, *, by_frame: bool) -> None:
        """The holder starts the mission, with a frame as an ordinary ground station sends it, or with an operation."""
        holder = self.store.leases[DRONE].holder
        if by_frame and holder is not None:
            message = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, *AUTO)
            frame = build(message, system_id=255, component_id=190, sequence=0)
            browser = self.tower.browsers.get(holder)
            if browser is not None:
                self.tower.hub.frames_from_browser(browser, tag(DRONE, frame), self.now)
        elif holder is not None:
            work = CommandWork(command=mavlink.MAV_CMD_DO_SET_MODE, params=AUTO)
            self._begin(Order("command", Lane.COMMANDS, [Step(work, 5.0)], writes=True))

    def _begin(self, order: Order) -> Operation | None:
        drone = self.tower.hub.state.drones.get(DRONE)
        assert drone is not None
        holder = self.store.leases[DRONE].holder or ALICE
        by = UserRef(holder, self.store.accounts[holder].name)
        try:
            operation = self.tower.hub.operations.begin(drone, order, by=by, now=self.now)
        except (DroneBusy, DroneOffline):
            return None
        self.operations.append(operation)
        self.works[operation.id] = order.steps[0].work
        return operation

    # -- time ----------------------------------------------------------------------------------------------------

    def step(self) -> None:
        self._steps += 1
        self.now += STEP_S
        self.vehicle.step(self.now - self.began)
        frames = self.vehicle.datagrams_to_send()
        if self.agent is not None and self.now >= self.unplugged_until:
            self._frames += frames
        if self.agent is not None:
            self._agent_lives(self.agent)
        if self._steps % TOWER_EVERY == 0:
            self.tower.tick()
            self.tower.settle()
        self._hold_against_the_laws()

    def _agent_lives(self, agent: PlanAgent) -> None:
        hub = self.tower.hub
        while self.network and not self.slow:
            _, datagram = self.network.popleft()
            agent.datagram(datagram, self.now)
        while agent.control and not self.slow:
            agent.next_control_message(hub, self.now)
        agent.tick(self.now)
        agent.speak(hub, self.now)

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self.step()

    def run_until(self, condition: Any, limit_s: float = QUIET_S) -> None:
        until = self.now + limit_s
        while not condition():
            assert self.now < until, "it did not come to that"
            self.step()

    def is_quiet(self) -> bool:
        """Whether nothing is running and the tower knows what is on board."""
        agent = self.agent
        drone = self.tower.hub.state.drones.get(DRONE)
        if agent is None or drone is None or not agent.is_linked_to(self.tower.hub) or not agent.has_channel:
            return False
        known = drone.onboard.plans.mission
        running = any(one.running for one in self.operations)
        return not running and agent.why_no_start is None and known.state == "known" and not agent.service.busy

    def settle(self) -> None:
        """Restores everything and runs on: in the end one whole plan is on board, and all sides know which."""
        self.slow = False
        if self.agent is None:
            self.start_agent()
        self.resume()
        self.connect()
        self.run_until(self.is_quiet)
        assert self.is_whole
        assert self.journal.records == {}
        drone = self.tower.hub.state.drones.get(DRONE)
        assert drone is not None and drone.onboard.plans.mission.hash == plan_hash(MISSION, self.on_board())
        self._outcomes_are_true()

    # -- invariants -------------------------------------------------------------------------------------------------

    def ended(self, transaction_id: int, reported: ParamValue) -> None:
        assert transaction_id not in self.results or reported.outcome is Outcome.REFUSED, "it ended twice"
        self.results[transaction_id] = reported

    def _hold_against_the_laws(self) -> None:
        if self.flies_mission:
            assert self.is_whole, f"half a plan is flown: {self.on_board()}"
            self.flown.add(self.on_board())
        self.halves += not self.is_whole
        assert self.agent is None or not self.agent.writes_under_an_older_epoch()

    def _outcomes_are_true(self) -> None:
        for operation in self.operations:
            work = self.works[operation.id]
            reported = self.results.get(operation.transaction_id)
            if operation.state is State.DONE and operation.order.lane is Lane.PLANS:
                assert reported is not None and reported.outcome is Outcome.DONE
            if reported is None or not isinstance(work, PlanUploadWork):
                continue
            if operation.words.startswith(reported.words):
                assert operation.state is STATE_OF[reported.outcome]
            else:  # no report came in time, so the result is unknown
                assert not operation.running and operation.state in (State.FAILED, State.TIMED_OUT)
                assert "check what is on board" in operation.words, operation.words
            if reported.outcome is Outcome.DONE:
                assert same_plan(ArduPilot(), work.kind, work.items, reported.on_board)
                assert reported.epoch == operation.epoch
            elif "is not known" not in reported.words:
                assert reported.on_board in self.wholes


def _numbers(item: PlanItem) -> tuple[float, float, float, float]:
    first, second, third, fourth = (value or 0.0 for value in item.params)
    return first, second, third, fourth


__all__ = ["ALICE", "NEW", "OLD", "ROOT", "THIRD", "Event", "PlanWorld", "State"]
