"""A working agent in the hub of a running tower: it keeps plans unchanged and answers each transaction."""

import asyncio
import time
from collections.abc import Callable, Iterable
from typing import Any

from control_world import ObedientAgent

from server.live.hub import Hub
from server.operations.core.service import OperationService
from wire.control_messages import ToAgent
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch
from wire.parameters import Parameter, by_name, pack_table, table_hash
from wire.plans import Plan, PlanKind, pack_plan, plan_hash
from wire.transactions import (
    TRANSACTIONS,
    CancelTransaction,
    LogEntry,
    LogListWork,
    Outcome,
    ParameterCache,
    ParameterRefusal,
    ParametersReadWork,
    ParametersWriteWork,
    ParameterTable,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionResult,
    TransactionToTower,
)


class WorkingAgent(ObedientAgent):
    """`asked` holds all requests from the tower. `waits` True: it begins, and answers when `go_on` is called."""

    def __init__(self, hub: Hub, drone_id: int) -> None:
        self.plans: dict[PlanKind, Plan] = dict.fromkeys(PlanKind, ())
        self.table = by_name([Parameter("RTL_ALT", 1500.0, 9), Parameter("ARMING_CHECK", 1.0, 6)])
        self.logs = (LogEntry(7, 5, 1_700_000_000), LogEntry(6, 3, None))
        self.asked: list[Transaction] = []
        self.cancelled: list[int] = []
        self.waits = False
        self.answer_with: Callable[[Transaction], dict[str, Any]] | None = None
        """Fields of the result that replace the usual ones."""
        super().__init__(hub, drone_id, takes=(TRANSACTIONS,))
        self.state()

    @property
    def service(self) -> OperationService:
        return self._hub.operations

    def beat(self, *, px4: bool = False, mode: int = 5) -> None:
        """Sends a heartbeat of the autopilot."""
        kind = mavlink.MAV_AUTOPILOT_PX4 if px4 else mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        self.frame(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, kind, 81, mode, 4, 3))

    def home(self, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        """Sends the autopilot's position of home."""
        place = (round(lat_deg * 1e7), round(lon_deg * 1e7), round(alt_m * 1000))
        self.frame(mavlink.MAVLink_home_position_message(*place, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))

    def frame(self, message: Any) -> None:
        now = time.monotonic()
        frame = build(message, system_id=1, component_id=1, sequence=0)
        for datagram in self._sealed.seal_frames(Epoch(0), [frame], now):
            self._hub.datagram(datagram, self.link.link_id, ("203.0.113.1", 5), now)

    def announce(self, message: TransactionToTower) -> None:
        self._hub.reports.receive(self.link, message)

    def go_on(self) -> None:
        """Answers the last request."""
        self.waits = False
        self._work(self.asked[-1])

    def _post(self, message: ToAgent) -> None:
        super()._post(message)
        if isinstance(message, Transaction):
            self.asked.append(message)
            if not self.waits:
                asyncio.get_running_loop().call_soon(self._work, message)
        elif isinstance(message, CancelTransaction):
            self.cancelled.append(message.id)
            words = "It was stopped: the old plan is untouched."
            result = TransactionResult(id=message.id, outcome=Outcome.CANCELLED, words=words)
            asyncio.get_running_loop().call_soon(self.announce, result)

    def _work(self, asked: Transaction) -> None:
        drone = self._hub.state.drones.get(DroneId(self.link.drone_id))
        if drone is None or drone.link is not self.link:
            return
        fields = self.answer_with(asked) if self.answer_with else self._usual(asked)
        self.announce(TransactionResult(id=asked.id, **({"outcome": Outcome.DONE, "words": "Done."} | fields)))

    def _usual(self, asked: Transaction) -> dict[str, Any]:
        match asked.work:
            case PlanUploadWork(kind=kind, items=items):
                return self._keep(kind, items)
            case PlanClearWork(kind=kind):
                return self._keep(kind, ())
            case PlanDownloadWork(kind=kind):
                return {"plan": pack_plan(kind, self.plans[kind])}
            case ParametersReadWork():
                self.report_parameters()
                self.announce(ParameterTable(hash=table_hash(self.table), packed=pack_table(self.table)))
            case ParametersWriteWork(values=values):
                return self._write(values)
            case LogListWork():
                return {"logs": self.logs}
            case PlanVerifyWork(kind=kind, items=items) if items != self.plans[kind]:
                return {"outcome": Outcome.FAILED, "words": "The plan on board is another."}
        return {}

    def report_parameters(self) -> None:
        """Reports that all parameters are known."""
        count = len(self.table)
        self.announce(ParameterCache(hash=table_hash(self.table), count=count, total=count))

    def _write(self, values: Iterable[tuple[str, float]]) -> dict[str, Any]:
        """Refuses values above 9000 and unknown parameters."""
        there, refusals = {one.name: one for one in self.table}, []
        for name, value in values:
            if name not in there:
                refusals.append(ParameterRefusal(name, value, None, "There is no such parameter."))
            elif value > 9000:
                refusals.append(ParameterRefusal(name, value, there[name].value, "It was not taken."))
            else:
                there[name] = Parameter(name, value, there[name].kind)
        self.table = by_name(there.values())
        self.report_parameters()
        outcome = Outcome.FAILED if refusals else Outcome.DONE
        return {"outcome": outcome, "words": "Written.", "refusals": tuple(refusals), "refused": len(refusals)}

    def _keep(self, kind: PlanKind, items: Plan) -> dict[str, Any]:
        self.plans[kind] = items
        packed, hash_ = pack_plan(kind, items), plan_hash(kind, items)
        self.announce(PlanOnBoard(kind=kind, hash=hash_, count=len(items), plan=packed))
        return {"words": "It is on board."}
