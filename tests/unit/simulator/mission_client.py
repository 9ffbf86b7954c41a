"""A ground station that uploads and downloads plans, message by message."""

from __future__ import annotations

from simulator.dialect import mavlink

from_item = ("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")


def item(seq: int, command: int = 16, *, frame: int = 3, x: int = 473977420, y: int = 85455940, z: float = 10.0,
         kind: int = 0, params: tuple[float, ...] = (1, 0, 0, 0)):  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *params, x + seq, y, z, kind)


def mission(count: int = 5, kind: int = 0) -> list:
    command = {0: 16, 1: 5001, 2: 5100}[kind]
    params = (count, 0, 0, 0) if kind == 1 else (1, 0, 0, 0)
    return [item(seq, command, kind=kind, params=params) for seq in range(count)]


def upload(station, items: list, kind: int = 0, *, resend: bool = True) -> int | None:
    """Uploads and returns the result in the acknowledgement. `resend`: repeats messages that get no response."""
    for _ in range(3):
        station.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        for _ in range(200):
            for message in station.run(0.02):
                if message.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
                    assert message.mission_type == kind
                    station.send(items[message.seq])
                elif message.get_type() == "MISSION_ACK":
                    return int(message.type)
        if not resend:
            return None
    return None


def download(station, kind: int = 0, compid: int = 190) -> list:
    def ask(question, answer: str):
        for _ in range(5):
            station.send(question, 255, compid)
            for message in station.run(0.1):
                if message.get_type() == answer:
                    return message
        raise AssertionError(f"no {answer}")

    count = ask(mavlink.MAVLink_mission_request_list_message(1, 1, kind), "MISSION_COUNT").count
    return [
        ask(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind), "MISSION_ITEM_INT") for seq in range(count)
    ]


def fields(message) -> tuple:
    return tuple(getattr(message, name) for name in from_item)
