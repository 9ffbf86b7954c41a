"""An agent that reads parameters from a simulated autopilot."""

from __future__ import annotations

from typing import Any

from handler_line import ARDUPILOT, PX4, HandlerLine

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.parameter_encoding import as_kept
from onboard_agent.transactions.parameter_handler import ParameterHandler
from simulator.dialect import Message
from simulator.parameter_protocol import ParameterServer
from simulator.parameters import Parameters
from simulator.px4.parameters import Px4Parameters
from wire.parameters import Parameter as Row
from wire.parameters import Table, unpack_table
from wire.transactions import (
    ParameterCache,
    ParameterTable,
)


class MemoryStore:
    def __init__(self) -> None:
        self.records: dict[str, bytes] = {}

    def load(self, autopilot: str) -> bytes | None:
        return self.records.get(autopilot)

    def save(self, autopilot: str, record: bytes) -> None:
        self.records[autopilot] = record


class Half:
    """The simulator's server half behind the messages of its vehicle."""

    def __init__(self, line: HandlerLine, parameters: Parameters) -> None:
        self.parameters = parameters
        self.server = ParameterServer(parameters, line.say)
        self.deaf = False

    def receive(self, message: Message) -> None:
        name = message.get_type()
        if self.deaf:
            return
        if name == "PARAM_REQUEST_LIST":
            self.server.list_all()
        elif name == "PARAM_REQUEST_READ":
            self.server.read(str(message.param_id), message.param_index)
        elif name == "PARAM_SET":
            self.server.set(str(message.param_id), message.param_value, message.param_type)

    def tick(self) -> None:
        self.server.tick()


def parameter_line(kind: int = ARDUPILOT, *, store: MemoryStore | None = None, **options: Any) -> HandlerLine:
    keys = ("narrow_line", "flown_by_hand", "armed", "system_is_fixed", "other_systems")
    around = {key: options.pop(key) for key in keys if key in options}
    line = HandlerLine(ParameterHandler(FrameMaker(), store or MemoryStore()), kind, **around)
    line.server = Half(line, (Px4Parameters if kind == PX4 else Parameters)(**options))
    line.comes()
    return line


def table_of(line: HandlerLine) -> Table:
    rows = [Row(one.name, as_kept(one.value, int(one.kind)), int(one.kind)) for one in line.server.parameters]
    return tuple(sorted(rows, key=lambda row: row.name))


def complete(line: HandlerLine) -> bool:
    caches = line.reported(ParameterCache)
    return bool(caches) and caches[-1].hash is not None and caches[-1].verified


def tables(line: HandlerLine) -> list[Table]:
    return [unpack_table(one.packed) for one in line.reported(ParameterTable)]


def remembered(kind: int = ARDUPILOT, said: Message | None = None) -> MemoryStore:
    store = MemoryStore()
    line = parameter_line(kind, store=store)
    if said is not None:
        line.say(said)
    line.until(lambda: complete(line))
    line.until(lambda: store.records)
    return store
