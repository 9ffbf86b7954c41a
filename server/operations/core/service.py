"""The operations service: sends transactions to agents, takes their reports, and sees each to its end.

Rules, each tested:

- Plain methods without await: it is part of the hub's world, and nothing happens between its reads and writes.
- An operation ends exactly once, with a text. An agent may later correct only an end that was unknown.
- An agent's report counts only for operations of its own drone.
- A lost link ends nothing at once: the agent works on beside the autopilot and reports when it is back. A restarted
  agent knows nothing, so what it ran has failed, unless the order was to start it again. If an agent reports nothing of
  a plan, which it would do five times a second, it is asked to stop it: a request lost on its way ends with that
  answer.
- A command that the autopilot still works on has longer, within a bound: the agent reports progress meanwhile.
- All steps of an operation are sent under the epoch of its beginning, and none after the controls changed hands, the
  drone was made to hold, or another flight command came. The same ends an operation whose next step waits for its
  moment, at once.
- Bounded: a number at a time per lane of a drone, and 1,000 ended ones, for an hour at most.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from server.kernel.clock import Clock
from server.kernel.people import UserRef
from server.link.core.agent_link import AgentLink
from server.live import live_messages as live
from server.live.hub_events import TurnRequested
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.end_words import moved_words, not_sent_words, overruled_words, unknown_words
from server.operations.core.kept_operations import KeptOperations
from server.operations.core.onboard_reports import OnboardReport, OnboardReports
from server.operations.core.onboard_state import checked_plan
from server.operations.core.operation import (
    MAX_RUNNING,
    STATE_OF,
    Lane,
    Operation,
    Order,
    State,
    is_another_agent,
)
from server.operations.core.refusals import AgentTooOld, DroneBusy, DroneOffline
from server.operations.core.table_fetching import FETCH, TableFetching
from wire.ids import DroneId, UserId
from wire.lateness import stamp_ms
from wire.transactions import (
    MAX_EXTENDED_S,
    PROGRESS_EXTENDS_S,
    TRANSACTIONS,
    CancelTransaction,
    CommandWork,
    LogListWork,
    Outcome,
    ParametersReadWork,
    PlanDownloadWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
    TransactionToTower,
)

GRACE_S: Final = 10.0
"""Beyond the agent's deadline: the way there, the end of what it is at, the way back."""

ASK_AFTER_S: Final = 8.0
"""How long a returned agent may be silent about a plan: stopping a mission before a write takes it 5 s."""

MAX_PHASE_LENGTH: Final = 80
"""Maximum length of an agent's progress text, which goes to many browsers."""

LINK_LOST: Final = "link lost"
STOPPING: Final = "being stopped"


class OperationService:
    """One for the hub. `clock`: the time of day, for people; `now`: monotonic seconds."""

    def __init__(self, state: LiveState, clock: Clock) -> None:
        self._state = state
        self._clock = clock
        # Ids grow over a restart too, or an agent that still works for the tower before could be taken at its word.
        self._last_id = int(clock().timestamp()) & 0xFFFFFFFF
        self._running: dict[int, Operation] = {}
        """By the transaction that runs."""
        self._waiting: dict[int, Operation] = {}
        """Those whose next step waits for its moment, by their own id."""
        self._kept = KeptOperations()
        self._tables = TableFetching(state, self._fetch_table)
        self._onboard = OnboardReports(clock, self._tables, reads_parameters=self._reads_parameters)
        self._now = 0.0
        self.on_began: Callable[[Operation], None] = lambda operation: None
        self.on_ended: Callable[[Operation], None] = lambda operation: None
        self.on_ordered: Callable[[Operation], None] = lambda operation: None
        self.on_answered: Callable[[Operation, TransactionResult], None] = lambda operation, result: None
        """Each step: sent to the agent, answered by it."""

    # -- what people ask -------------------------------------------------------------------------------------

    def begin(
        self, drone: LiveDrone, order: Order, *, by: UserRef, now: float, address: str = "", request_id: str = ""
    ) -> Operation:
        """Sends the first step. Raises DroneOffline, AgentTooOld, DroneBusy."""
        return self._begin(drone, order, by=by, now=now, address=address, request_id=request_id)

    def has_turn(self, drone: LiveDrone, user_id: UserId, now: float) -> bool:
        """While an admin assists, they have the turn during their operations. False: the turn was requested, or is the
        other's."""
        assistant, turn = drone.lease.assistant, drone.turn
        if assistant is None:
            return True
        if user_id != assistant.id:
            return turn.whose == turn.wanted == "holder"
        before = turn.wanted
        may = turn.asks(now)
        if before != turn.wanted:
            self._state.on_event(TurnRequested(drone.drone_id, "assistant"))
        return may

    def cancel(self, operation: Operation) -> None:
        """Asks the agent to stop it; the end still comes from there. Harmless after the end."""
        if not operation.running:
            return
        if operation.id in self._waiting:
            self._end(operation, State.CANCELLED, not_sent_words(operation, "It was cancelled."))
            return
        operation.cancelling = True
        operation.phase = STOPPING
        link = operation.link
        if link is not None and link.has_channel and not operation.link_lost:
            link.post(CancelTransaction(id=operation.transaction_id))
        self._notify(operation)

    def find(self, operation_id: int) -> Operation | None:
        """One that runs, or that has ended not long ago."""
        return self._kept.find(operation_id)

    def running_at(self, drone_id: DroneId, lane: Lane) -> list[Operation]:
        """What this drone does there at the moment."""
        there = (*self._running.values(), *self._waiting.values())
        return [one for one in there if one.drone_id == drone_id and one.order.lane is lane]

    def transaction(self, drone_id: DroneId, transaction_id: int) -> Operation | None:
        """The operation whose transaction this drone runs."""
        operation = self._running.get(transaction_id)
        return operation if operation is not None and operation.drone_id == drone_id else None

    # -- agents' reports -------------------------------------------------------------------------------------

    def receive(self, drone: LiveDrone, link: AgentLink, message: TransactionToTower) -> None:
        """Raises MalformedMessage."""
        match message:
            case TransactionProgress():
                self._progress(drone, link, message)
            case TransactionResult():
                self._result(drone, link, message, self._now)
            case _ if isinstance(message, OnboardReport):
                self._onboard.receive(drone, message, self._now)

    def resumed(self, link: AgentLink) -> None:
        """The link has another control channel: messages of the last one may be lost in either direction."""
        for operation in self._running.values():
            if operation.link is link:
                self._ask_later(operation, self._now)

    def tick(self, now: float) -> None:
        """Several times a second: links that went and came, deadlines, tables that are lacking."""
        self._now = now
        for operation in list(self._running.values()):
            self._check(operation, now)
        for operation in list(self._waiting.values()):
            self._check_waiting(operation, now)
        self._tables.tick(now)
        self._kept.forget_old(now, running=len(self._running) + len(self._waiting))

    # -- inside ----------------------------------------------------------------------------------------------

    def _begin(
        self,
        drone: LiveDrone,
        order: Order,
        *,
        by: UserRef | None,
        now: float,
        address: str = "",
        request_id: str = "",
    ) -> Operation:
        self._now = now
        name = drone.record.name
        link = drone.link
        if link is None or not link.has_channel or not drone.online:
            raise DroneOffline(name)
        if not link.takes.issuperset((TRANSACTIONS, order.needs)):
            raise AgentTooOld(name)
        self._make_space(drone, order)
        drone.commanded += order.overrules
        operation = Operation(
            id=self._last_id + 1,
            drone_id=drone.drone_id,
            drone_name=name,
            order=order,
            by=by,
            epoch=drone.lease.epoch,
            began_at=self._clock(),
            address=address,
            request_id=request_id,
            commanded=drone.commanded,
        )
        if by is not None:
            self._kept.add(operation)
        operation.link = link
        self._send_next(operation, link, now)
        if by is not None:
            self.on_began(operation)
        return operation

    def _make_space(self, drone: LiveDrone, order: Order) -> None:
        """A write of a plan does not wait for a read."""
        there = self._asked_at(drone, order.lane)
        if order.writes and order.lane is Lane.PLANS:
            for one in there:
                if not one.order.writes:
                    self.cancel(one)
                    self._end(
                        one, State.CANCELLED, "Reading the plan was stopped because another one is being written."
                    )
            there = self._asked_at(drone, order.lane)
        if order.lane is Lane.PARAMETERS:  # the agent reads and writes them side by side
            there = [one for one in there if one.order.writes == order.writes]
        if order.overrules and len(there) >= MAX_RUNNING[order.lane]:
            self.cancel(there[0])
            if there[0].running:
                self._end(there[0], State.CANCELLED, unknown_words(there[0], "got other commands before it answered"))
        elif len(there) >= MAX_RUNNING[order.lane]:
            busy = there[0]
            who = f" for {busy.by.name}" if busy.by else ""
            raise DroneBusy(f"{drone.record.name} is busy{who} ({busy.order.work.replace('_', ' ')}): wait, or stop it")

    def _asked_at(self, drone: LiveDrone, lane: Lane) -> list[Operation]:
        """Operations that a user requested. The tower's own reads block nobody."""
        return [one for one in self.running_at(drone.drone_id, lane) if one.by is not None]

    def _send_next(self, operation: Operation, link: AgentLink, now: float) -> bool:
        """Whether there was another step. It may have to wait."""
        steps = operation.order.steps
        while operation.next_step < len(steps):
            step = steps[operation.next_step]
            operation.next_step += 1
            if step.skip is not None and step.skip():
                continue
            if step.waits is None:
                self._send(operation, link, now)
            else:
                self._waiting[operation.id] = operation
            return True
        return False

    def _send(self, operation: Operation, link: AgentLink, now: float) -> None:
        step = operation.step
        self._last_id = (self._last_id + 1) & 0xFFFFFFFF
        operation.transaction_id = self._last_id
        operation.deadline = now + step.deadline_s
        operation.latest = operation.deadline + (MAX_EXTENDED_S if isinstance(step.work, CommandWork) else 0.0)
        operation.phase, operation.done, operation.total = step.phase, 0, 0
        self._running[operation.transaction_id] = operation
        link.post(
            Transaction(
                id=operation.transaction_id,
                epoch=operation.epoch,
                sent_ms=stamp_ms(now),
                deadline_s=step.deadline_s,
                work=step.work,
                trace=operation.request_id,
            )
        )
        self.on_ordered(operation)
        self._notify(operation)

    def _check_waiting(self, operation: Operation, now: float) -> None:
        """Sends the step whose moment has come, or ends the operation: then nothing more is sent."""
        drone, waits = self._state.drones.get(operation.drone_id), operation.step.waits
        assert waits is not None
        if drone is None:
            self._end(operation, State.FAILED, "The drone has been removed.")
            return
        if drone.lease.epoch != operation.epoch or drone.fenced:
            self._end(operation, State.CANCELLED, not_sent_words(operation, "The controls changed hands."))
            return
        if drone.commanded != operation.commanded:
            self._end(operation, State.CANCELLED, not_sent_words(operation, "A hold or another command came."))
            return
        link, assistant = drone.link, drone.lease.assistant
        if link is not None and is_another_agent(operation.link, link):
            self._end(operation, State.FAILED, not_sent_words(operation, "Its agent was started again."))
            return
        wait = waits(now)
        if wait is not None and wait.failed:
            self._end(operation, State.FAILED, not_sent_words(operation, wait.failed))
            return
        if operation.by is not None and assistant is not None and operation.by.id == assistant.id:
            drone.turn.asks(now)
        if wait is None and link is not None and link.has_channel:
            del self._waiting[operation.id]
            operation.link = link
            self._send(operation, link, now)
        elif wait is not None and (wait.phase, wait.done) != (operation.phase, operation.done):
            operation.phase, operation.done, operation.total = wait.phase, wait.done, wait.total
            self._notify(operation)

    def _of(self, drone: LiveDrone, transaction_id: int, link: AgentLink) -> Operation | None:
        operation = self._running.get(transaction_id)
        if operation is None or operation.drone_id != drone.drone_id:
            return None
        operation.link, operation.link_lost = link, False
        return operation

    def _progress(self, drone: LiveDrone, link: AgentLink, report: TransactionProgress) -> None:
        operation = self._of(drone, report.id, link)
        if operation is None:
            return
        operation.ask_at = None
        operation.deadline = min(max(operation.deadline, self._now + PROGRESS_EXTENDS_S), operation.latest)
        operation.phase = operation.step.phase or report.phase[:MAX_PHASE_LENGTH]
        operation.done, operation.total = report.done, report.total
        self._notify(operation)

    def _result(self, drone: LiveDrone, link: AgentLink, report: TransactionResult, now: float) -> None:
        late = self._kept.late(report.id)
        operation = self._of(drone, report.id, link) if late is None else late
        if operation is None or operation.drone_id != drone.drone_id:
            return
        self.on_answered(operation, report)
        work = operation.step.work
        if report.plan is not None and isinstance(work, PlanDownloadWork):
            checked_plan(work.kind, report.plan)
            operation.plan = report.plan
        if report.logs is not None and isinstance(work, LogListWork) and report.outcome is Outcome.DONE:
            drone.onboard.logs, drone.onboard.logs_read_at = report.logs, self._clock()
        if isinstance(work, ParametersReadWork) and report.outcome is Outcome.DONE:
            drone.onboard.parameters.read_again(self._clock())
        operation.item, operation.code, operation.seen, operation.logs = (
            report.item,
            report.code,
            report.seen,
            report.logs,
        )
        if report.outcome is not Outcome.DONE and report.item is None:
            operation.item = operation.step.item
        operation.refusals, operation.refused = report.refusals, report.refused
        if late is None and report.outcome is Outcome.DONE and operation.next_step < len(operation.order.steps):
            del self._running[report.id]
            if operation.cancelling:
                self._end(operation, State.CANCELLED, f"It was stopped after this step: {operation.step.phase}.")
                return
            if drone.lease.epoch != operation.epoch or drone.fenced:
                self._end(operation, State.CANCELLED, moved_words(operation))
                return
            if drone.commanded != operation.commanded:
                self._end(operation, State.CANCELLED, overruled_words(operation))
                return
            if self._send_next(operation, link, now):
                return
        self._kept.end_late(report.id)
        if report.outcome is Outcome.DONE and operation.next_step < len(operation.order.steps):
            rest = "the report came too late, and the rest was not sent"
            self._end(operation, State.FAILED, f"{operation.drone_name}, {operation.step.phase}: done, but {rest}.")
            return
        words = operation.order.result_text(operation.step, report.outcome, report.words, report.seen)
        self._end(operation, STATE_OF[report.outcome], words)

    def _end(self, operation: Operation, state: State, words: str) -> None:
        if self._running.get(operation.transaction_id) is operation:
            del self._running[operation.transaction_id]
        self._waiting.pop(operation.id, None)
        operation.state, operation.words, operation.phase = state, words, ""
        operation.ended_at = self._clock()
        operation.link, operation.link_lost = None, False
        operation.ended_s = self._now
        self._notify(operation)
        listeners, operation.on_end = operation.on_end, []
        for listener in listeners:
            listener(operation)
        if operation.by is not None:
            self.on_ended(operation)
        self._kept.ended(operation)

    def _check(self, operation: Operation, now: float) -> None:
        drone = self._state.drones.get(operation.drone_id)
        if drone is None:
            self._end(operation, State.FAILED, "The drone has been removed.")
            return
        link, assistant = drone.link, drone.lease.assistant
        is_same_link = link is operation.link
        if operation.by is not None and assistant is not None and operation.by.id == assistant.id:
            drone.turn.asks(now)  # else the turn goes back in the middle of it, and the agent undoes what it wrote
        restarted = link is not None and not is_same_link and is_another_agent(operation.link, link)
        if restarted and not operation.order.restarts_agent:
            self._end(operation, State.FAILED, unknown_words(operation, "was started again in between"))
        elif now > operation.deadline + GRACE_S:
            self._give_up(operation, link)
        elif link is None or not link.has_channel:
            if not operation.link_lost:
                operation.link_lost, operation.phase = True, LINK_LOST
                self._notify(operation)
        elif operation.link_lost or not is_same_link:
            operation.link, operation.link_lost = link, False
            operation.phase = operation.step.phase
            self._ask_later(operation, now)
            if operation.cancelling:
                self.cancel(operation)
            else:
                self._notify(operation)
        elif operation.ask_at is not None and now > operation.ask_at:
            operation.ask_at = None
            link.post(CancelTransaction(id=operation.transaction_id))

    @staticmethod
    def _ask_later(operation: Operation, now: float) -> None:
        if operation.order.lane in (Lane.PLANS, Lane.FOLLOWING, Lane.CONTROLLER):
            operation.ask_at = now + ASK_AFTER_S

    def _give_up(self, operation: Operation, link: AgentLink | None) -> None:
        if link is not None and link.has_channel:
            link.post(CancelTransaction(id=operation.transaction_id))
        self._kept.add_late(operation)
        self._end(operation, State.TIMED_OUT, unknown_words(operation, "did not report the result in time"))

    def _reads_parameters(self, drone: LiveDrone) -> bool:
        there = self.running_at(drone.drone_id, Lane.PARAMETERS)
        return any(isinstance(one.step.work, ParametersReadWork) for one in there)

    def _fetch_table(self, drone: LiveDrone, now: float) -> bool:
        if not self.running_at(drone.drone_id, Lane.PARAMETERS):
            with suppress(DroneOffline, AgentTooOld):
                self._begin(drone, FETCH, by=None, now=now)
                return True
        return False

    def _notify(self, operation: Operation) -> None:
        drone = self._state.drones.get(operation.drone_id)
        if drone is not None and operation.by is not None:
            drone.notify_frame_watchers(live.OperationChanged.of(operation), operation.began_at)
