"""The server half of the parameter protocol: list, read, set."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Set

from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.notices import Severity
from simulator.parameters import NAME_MAX, Parameter, Parameters

UNNUMBERED = 65535
"""The index in an answer that is not part of a list."""
HASH_NAME = "_HASH_CHECK"
"""PX4: not a parameter, but the hash of all of them; sent before a list, and on request by this name."""
HASH_KIND = int(mavlink.MAV_PARAM_TYPE_UINT32)
LOCKED_PREFIX = "BRD_"
SLOW_TICKS = 4
"""Between two single values while they are slow: 20 ms (seen on ArduCopter 4.7-dev on a busy machine)."""
QUESTIONS_MAX = 20
VALUES_PER_TICK = 10
"""2000 per second, as a real autopilot sends if the link permits. A list of 1,400 takes 0.7 s."""


class ParameterServer:
    def __init__(
        self,
        parameters: Parameters,
        send: Callable[[Message], None],
        say: Callable[[Severity, str], None] = lambda severity, text: None,
    ) -> None:
        self._parameters = parameters
        self._send = send
        self._say = say
        self._next: int | None = None
        self._hash_due = False
        self.drop_every_seventh = False
        self.has_locked = False
        self.is_slow = False
        self._questions: deque[tuple[str, int]] = deque()
        self._ticks = 0

    def suffer(self, failures: Set[Failure]) -> None:
        self.drop_every_seventh = Failure.PARAMETERS_DROPPED in failures
        self.has_locked = Failure.PARAMETERS_LOCKED in failures
        self.is_slow = Failure.PARAMETERS_SLOW in failures

    def list_all(self) -> None:
        """Starts over: a second request during a list means that the requester has lost some values."""
        if self._next is None:
            self._hash_due = True
        self._next = 0

    def read(self, name: str, index: int) -> None:
        """Reads by index, or by name if the index is -1. Unknown parameters get no answer."""
        if index < 0 and name == HASH_NAME:
            self._send_hash()
        elif not self.is_slow:
            self._send_value(name, index)
        elif len(self._questions) < QUESTIONS_MAX:
            self._questions.append((name, index))

    def _send_value(self, name: str, index: int) -> None:
        if index >= 0:
            parameter = self._parameters.at(index)
            number = index
        else:
            parameter = self._parameters.find(name)
            number = UNNUMBERED
        if parameter is not None:
            self._send(self._value(parameter, number))

    def set(self, name: str, value: float, kind: int) -> None:
        """For PX4's hash, any value stops the list."""
        if name == HASH_NAME and self._parameters.hash_on_the_wire() is not None:
            self._next = None
            return
        if self.has_locked and name.startswith(LOCKED_PREFIX):
            self._say(Severity.WARNING, f"Param write denied ({name})")
            parameter = self._parameters.find(name)
        else:
            parameter = self._parameters.from_the_wire(name, value, kind)
        if parameter is not None:
            self._send(self._value(parameter, UNNUMBERED))

    def tick(self) -> None:
        self._ticks += 1
        if self._questions and self._ticks % SLOW_TICKS == 0:
            self._send_value(*self._questions.popleft())
        if self._hash_due:
            self._hash_due = False
            self._send_hash()
        for _ in range(VALUES_PER_TICK):
            if self._next is None:
                return
            parameter = self._parameters.at(self._next)
            if parameter is None:
                self._next = None
                return
            if not (self.drop_every_seventh and self._next % 7 == 6):
                self._send(self._value(parameter, self._next))
            self._next += 1

    def _send_hash(self) -> None:
        table_hash = self._parameters.hash_on_the_wire()
        if table_hash is not None:
            count = len(self._parameters)
            name = HASH_NAME.encode("ascii")
            self._send(mavlink.MAVLink_param_value_message(name, table_hash, HASH_KIND, count, UNNUMBERED))

    def _value(self, parameter: Parameter, index: int) -> Message:
        return mavlink.MAVLink_param_value_message(
            parameter.name.encode("ascii")[:NAME_MAX],
            self._parameters.on_the_wire(parameter),
            int(parameter.kind),
            len(self._parameters),
            index,
        )
