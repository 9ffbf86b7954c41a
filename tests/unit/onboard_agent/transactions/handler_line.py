"""A line between one of the agent's handlers and an autopilot's server half, with a fake clock and injected faults."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import Any, Protocol

from onboard_agent.transactions.handler import Around, TransactionHandler
from simulator.dialect import Codec, Message
from wire.frames import message_id
from wire.transactions import Transaction, TransactionResult

STEP_S = 0.005
ARDUPILOT, PX4 = 3, 12
Fault = Callable[[int, Message], tuple[float, ...]]
"""Takes the number of earlier frames in that direction and the message. Returns the delay of each copy in seconds."""


class Server(Protocol):
    """The autopilot's half. It sends with the `send` that it was made with."""

    def receive(self, message: Message) -> None: ...
    def tick(self) -> None: ...


def arrives(_number: int, _message: Message) -> tuple[float, ...]:
    return (0.0,)


class HandlerLine:
    """`around`: keywords of Around that differ from a drone on the ground that sends heartbeats."""

    def __init__(self, handler: TransactionHandler, kind: int = ARDUPILOT, **around: Any) -> None:
        self.now = 100.0
        self.handler = handler
        self.kind = kind
        self.around_options = around
        self.server: Server | None = None
        self.to_server: Fault = arrives
        self.to_agent: Fault = arrives
        self.reports: list[Any] = []
        self.sent: list[Message] = []
        """Messages to the autopilot, whether they arrived or not."""
        self.passed_up: list[Message] = []
        """Messages that the handler did not consume."""
        self.step_s = STEP_S
        self._codecs = {"up": Codec(1, 1), "down": Codec(1, 191)}
        self._gimbal = Codec(1, 154)
        self._counts = {"up": 0, "down": 0}
        self._on_the_way: list[tuple[float, int, str, bytes]] = []
        self._id = 0

    def around(self) -> Around:
        common = dict.fromkeys(("armed", "airborne", "starting", "flown_by_hand", "holding", "narrow_line"), False)
        common |= {"vehicle_type": 2, "custom_mode": 0, "commanded": 0, "heard": True}
        return Around(**(common | {"system_id": 1, "autopilot_kind": self.kind} | self.around_options))

    def comes(self) -> None:
        """The autopilot starts to send heartbeats."""
        self.handler.autopilot_came(self.around(), self.now)

    def become(self, system_id: int) -> None:
        """From now on the autopilot sends as this system."""
        self._codecs["up"] = Codec(system_id, 1)
        self.around_options["system_id"] = system_id

    def say(self, message: Message) -> None:
        """The autopilot sends a message."""
        self._put("up", message, self.to_agent)

    def gimbal_says(self, message: Message) -> None:
        """Sends a message from another component of the vehicle, straight to the handler."""
        assert not self.handler.receive(self._gimbal.encode(message), self.now)

    def _put(self, way: str, message: Message, fault: Fault, frame: bytes = b"") -> None:
        self._counts[way] += 1
        delays = fault(self._counts[way], message)
        frame = frame or self._codecs[way].encode(message)
        for delay in delays:
            heapq.heappush(self._on_the_way, (self.now + delay, len(self.sent) + self._counts[way], way, frame))

    def step(self) -> None:
        self.now += self.step_s
        while self._on_the_way and self._on_the_way[0][0] < self.now:
            _, _, way, frame = heapq.heappop(self._on_the_way)
            messages = self._codecs[way].decode(frame)  # no message that the dialect lacks
            if way == "down":
                assert self.server is not None
                for message in messages:
                    self.server.receive(message)
            else:
                if message_id(frame) not in self.handler.hears or not self.handler.receive(frame, self.now):
                    self.passed_up += messages
                self._agent_sends()
        self._agent_sends()
        self.reports += self.handler.reports()
        if self.server is not None:
            self.server.tick()

    def _agent_sends(self) -> None:
        for frame in self.handler.due(self.around(), self.now):
            (message,) = self._codecs["down"].decode(frame)
            self.sent.append(message)
            self._put("down", message, self.to_server, frame)

    def begin(self, work: Any, *, epoch: int = 1, deadline_s: float = 60.0) -> int:
        self._id += 1
        transaction = Transaction(id=self._id, epoch=epoch, deadline_s=deadline_s, work=work)
        self.handler.begin(transaction, self.around(), self.now)
        self.reports += self.handler.reports()
        return self._id

    def result(self, number: int | None = None, limit_s: float = 120.0) -> TransactionResult:
        """Returns the result of the latest transaction, unless `number` is given."""
        number = number or self._id
        self.until(
            lambda: any(isinstance(one, TransactionResult) and one.id == number for one in self.reports), limit_s
        )
        (result,) = (one for one in self.reports if isinstance(one, TransactionResult) and one.id == number)
        return result

    def do(self, work: Any, **options: Any) -> TransactionResult:
        return self.result(self.begin(work, **options))

    def until(self, condition: Callable[[], Any], limit_s: float = 60.0) -> float:
        """Returns the duration."""
        began = self.now
        while not condition():
            assert self.now - began < limit_s, "it never came true"
            self.step()
        return self.now - began

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.step_s)):
            self.step()

    def reported(self, what: type) -> list[Any]:
        return [one for one in self.reports if isinstance(one, what)]

    def sent_count(self, name: str) -> int:
        return sum(1 for message in self.sent if message.get_type() == name)
