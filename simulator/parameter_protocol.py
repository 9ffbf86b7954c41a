"""The server half of the parameter protocol: list, read, set."""

from __future__ import annotations

from collections.abc import Callable

from simulator.dialect import Message, mavlink
from simulator.parameters import NAME_MAX, Parameter, Parameters

UNNUMBERED = 65535
"""The index in an answer that is not part of a list."""
VALUES_PER_TICK = 10
"""2000 a second: what a real one sends where the line lets it. A list of 1,400 takes 0.7 s."""


class ParameterServer:
    def __init__(self, parameters: Parameters, send: Callable[[Message], None]) -> None:
        self._parameters = parameters
        self._send = send
        self._next: int | None = None
        self.drop_every_seventh = False

    def list_all(self) -> None:
        """Start over: a second request during a list is the requester's way to say that it lost some."""
        self._next = 0

    def read(self, name: str, index: int) -> None:
        """By index, or by name where the index is -1. What does not exist gets no answer."""
        if index >= 0:
            parameter = self._parameters.at(index)
            number = index
        else:
            parameter = self._parameters.find(name)
            number = UNNUMBERED
        if parameter is not None:
            self._send(self._value(parameter, number))

    def set(self, name: str, value: float, kind: int) -> None:
        parameter = self._parameters.from_the_wire(name, value, kind)
        if parameter is not None:
            self._send(self._value(parameter, UNNUMBERED))

    def tick(self) -> None:
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

    def _value(self, parameter: Parameter, index: int) -> Message:
        return mavlink.MAVLink_param_value_message(
            parameter.name.encode("ascii")[:NAME_MAX],
            self._parameters.on_the_wire(parameter),
            int(parameter.kind),
            len(self._parameters),
            index,
        )
