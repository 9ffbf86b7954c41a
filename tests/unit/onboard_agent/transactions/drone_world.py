"""The agent's core with a whole simulated vehicle, on one fake clock, and the tower's messages and frames."""

from __future__ import annotations

from typing import Any

from plan_line import MemoryJournal, waypoints

from onboard_agent.onboard import Onboard
from simulator.ardupilot import ARDUPILOT
from simulator.failure_modes import Failure
from simulator.flavour import Flavour
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.vehicle import Vehicle, VehicleSettings
from wire.content import Frames
from wire.control_messages import ControlChanged, Welcome
from wire.dialect import build, decode, mavlink
from wire.ids import DroneId, Epoch
from wire.lateness import stamp_ms
from wire.plans import PlanKind
from wire.transactions import CommandWork, PlanOnBoard, Transaction, TransactionResult

STEP_S = 0.005
TICK_EVERY = 5
"""Steps."""
HOME = Place(47.397742, 8.545594, 488.0)
ARM, SET_MODE, TAKEOFF = 400, 176, 22
AUTO, GUIDED, LOITER, RTL, BRAKE = 3, 4, 5, 6, 17


class DroneWorld:
    """Linked, with a vehicle that is ready to arm. `seen`: frames that went up to the tower, decoded."""

    def __init__(
        self,
        *failures: Failure,
        flavour: Flavour = ARDUPILOT,
        takes: tuple[str, ...] = ("transactions",),
        narrow_line: bool = False,
        journal: MemoryJournal | None = None,
        make_handlers: Any = lambda maker: (),
        metadata: bool | None = None,
        parameters: tuple[tuple[str, float], ...] = (),
    ) -> None:
        self.make_handlers = make_handlers
        self.now = 1000.0
        self.epoch = 5
        self.takes = takes
        self.narrow_line = narrow_line
        self.journal = MemoryJournal() if journal is None else journal
        settings = VehicleSettings(
            FlightSettings(HOME, boot_s=0.5), flavour=flavour, metadata=metadata, parameters=parameters
        )
        self.vehicle = Vehicle(settings, failures)
        self.reported: list[Any] = []
        self.seen: list[Any] = []
        self.sent: list[bytes] = []
        """Frames that went to the autopilot."""
        self.deaf = False
        """True: the autopilot receives nothing from the agent."""
        self.tower_there = True
        self._steps = 0
        self._id = 100
        self.start_agent()

    def start_agent(self) -> None:
        """Starts the agent, also after a kill: only the journal is left."""
        self.onboard = Onboard(
            now=self.now,
            speaks_first=True,
            narrow_line=self.narrow_line,
            journal=self.journal,
            make_handlers=self.make_handlers,
        )
        self.link_up()

    def link_up(self) -> None:
        welcome = Welcome(
            drone_id=7,
            name="kestrel",
            link_id=1,
            public_key=b"k" * 32,
            udp_port=1,
            epoch=self.epoch,
            holder="ada",
            holder_present=True,
            takes=self.takes,
        )
        self.tower_there = True
        self.onboard.welcomed(welcome, self.now)

    def link_down(self) -> None:
        self.tower_there = False
        self.onboard.link_broken(self.now)

    def change_epoch(self) -> None:
        self.epoch += 1
        self.onboard.message(ControlChanged(epoch=self.epoch, holder="bob", holder_present=True), self.now)

    def step(self) -> None:
        self._steps += 1
        self.now += STEP_S
        self.vehicle.step(self.now - 1000.0)
        frames = self.vehicle.datagrams_to_send()
        self._up(self.onboard.from_autopilot(frames, self.now))
        if self._steps % TICK_EVERY == 0:
            if self.tower_there:
                self.onboard.tower_heard(self.now)
            self.onboard.tick(self.now)
            self._up(self.onboard.frames_to_tower(self.now))
        self._collect()

    def _up(self, frames: list[bytes]) -> None:
        self.seen += [message for message in map(decode, frames) if message is not None]

    def _collect(self) -> None:
        for frame in self.onboard.frames_to_autopilot():
            self.sent.append(frame)
            if not self.deaf:
                self.vehicle.receive(frame, self.now - 1000.0)
        self.reported += self.onboard.messages_to_tower(self.now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.step()

    def until(self, condition: Any, limit_s: float = 60.0, what: str = "") -> None:
        until = self.now + limit_s
        while not condition():
            assert self.now < until, f"it never came true: {what}"
            self.step()

    # The tower.

    def tower_sends(self, message: Any, *, system_id: int = 255, component_id: int = 190) -> None:
        """Sends a frame of a ground station that flies through the tower."""
        frame = build(message, system_id=system_id, component_id=component_id, sequence=0)
        content = Frames(DroneId(7), Epoch(self.epoch), stamp_ms(self.now), [frame])
        self.onboard.from_tower(content, self.now)
        self._collect()

    def begin(self, work: Any, *, deadline_s: float = 60.0, epoch: int | None = None, late_s: float = 0.0) -> int:
        self._id += 1
        transaction = Transaction(
            id=self._id,
            epoch=self.epoch if epoch is None else epoch,
            sent_ms=stamp_ms(self.now - late_s),
            deadline_s=deadline_s,
            work=work,
        )
        self.onboard.message(transaction, self.now)
        self._collect()
        return self._id

    def result(self, number: int | None = None, limit_s: float = 60.0) -> TransactionResult:
        wanted = self._id if number is None else number
        self.until(lambda: self.results(wanted), limit_s, f"result of {wanted}")
        return self.results(wanted)[-1]

    def results(self, number: int) -> list[TransactionResult]:
        return [one for one in self.reported if isinstance(one, TransactionResult) and one.id == number]

    def do(self, work: Any, **options: Any) -> TransactionResult:
        return self.result(self.begin(work, **options))

    def command(self, command: int, *params: float, **options: Any) -> TransactionResult:
        return self.do(command_work(command, *params), **options)

    # The drone.

    def ready(self) -> DroneWorld:
        """Waits until its plans were read and it can be armed."""
        self.until(lambda: all(self.on_board(kind) for kind in PlanKind), what="plans are read")
        self.until(lambda: self.vehicle.flight.estimator_was_ready, what="ready to arm")
        return self

    def flies(self, mode: int = GUIDED) -> DroneWorld:
        """Puts it in the air at 10 m, in this mode."""
        assert self.command(SET_MODE, 1, GUIDED).outcome == "done"
        assert self.command(ARM, 1).outcome == "done"
        assert self.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10).outcome == "done"
        self.until(lambda: self.vehicle.flight.alt_over_home_m() > 9.0, what="at height")
        if mode != GUIDED:
            assert self.command(SET_MODE, 1, mode).outcome == "done"
        return self

    def on_board(self, kind: PlanKind = PlanKind.MISSION) -> str | None:
        """Returns the last hash reported to the tower."""
        reported = [one for one in self.reported if isinstance(one, PlanOnBoard) and one.kind == kind]
        return reported[-1].hash if reported else None

    def asked_of_autopilot(self, *names: str) -> list[Any]:
        messages = [decode(frame) for frame in self.sent]
        return [one for one in messages if one is not None and one.get_type() in names]

    def went_up(self, *names: str) -> list[Any]:
        return [one for one in self.seen if one.get_type() in names]

    def commands_sent(self, command: int) -> list[Any]:
        return [one for one in self.asked_of_autopilot("COMMAND_LONG", "COMMAND_INT") if one.command == command]


def command_work(command: int, *params: float) -> CommandWork:
    padded: Any = (*params, *([0.0] * (7 - len(params))))
    return CommandWork(command=command, params=padded)


__all__ = ["DroneWorld", "command_work", "mavlink", "waypoints"]
