"""A flying vehicle under random well-formed messages: whatever is set, commanded or uploaded, it keeps responding."""

from __future__ import annotations

import math
import random

import pytest

from simulator.ardupilot import ARDUPILOT
from simulator.dialect import Codec, mavlink
from simulator.modes import Mode

COMMANDS = [16, 17, 20, 21, 22, 115, 176, 178, 179, 192, 193, 224, 241, 300, 400, 401, 410, 510, 511, 512, 520]
ITEMS = [16, 17, 18, 19, 20, 21, 22, 82, 93, 112, 115, 177, 178]


def number(chance: random.Random) -> float:
    common = [0.0, 1.0, -1.0, 2.0, 10.0, math.nan, math.inf, -math.inf, 3.4e38, 1e-40]
    return chance.choice([*common, chance.uniform(-200, 200), chance.uniform(-1e9, 1e9)])


def anything(chance: random.Random, names: list[str]):
    numbers = [number(chance) for _ in range(7)]
    place = (chance.randint(-(2**31), 2**31 - 1), chance.choice([0, 85_455_940, 2**31 - 1]))
    return chance.choice(
        [
            mavlink.MAVLink_command_long_message(1, 1, chance.choice(COMMANDS), 0, *numbers),
            mavlink.MAVLink_command_int_message(
                1, 1, chance.choice([0, 3, 5, 6, 9]), chance.choice(COMMANDS), 0, 0, *numbers[:4], *place, numbers[4]
            ),
            mavlink.MAVLink_command_long_message(1, 1, 176, 0, 1, chance.choice(list(Mode)), 0, 0, 0, 0, 0),
            mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0),
            mavlink.MAVLink_command_long_message(1, 1, 22, 0, 0, 0, 0, 0, 0, 0, 10),
            mavlink.MAVLink_mission_count_message(1, 1, 2, 0),
            mavlink.MAVLink_mission_item_int_message(
                1, 1, chance.choice([0, 1]), 3, chance.choice(ITEMS), 0, 1, *numbers[:4], *place, 10.0, 0
            ),
            mavlink.MAVLink_param_set_message(1, 1, chance.choice(names).encode(), numbers[0], 9),
            mavlink.MAVLink_rc_channels_override_message(1, 1, *(chance.randint(0, 65535) for _ in range(8))),
            mavlink.MAVLink_manual_control_message(
                1, *(chance.randint(-32768, 32767) for _ in range(4)), chance.randint(0, 65535)
            ),
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, chance.choice([1, 7, 8, 9]), chance.randint(0, 65535), *numbers, *numbers[:4]
            ),
        ]
    )


@pytest.mark.parametrize("seed", range(12))
def test_it_goes_on_answering(ground, seed):
    station = ground(wind_mps=5, seed=seed).take_off(10)
    names = [parameter.name for parameter in station.vehicle.parameters]
    chance, codec = random.Random(seed), Codec(255, 190)
    for _ in range(150):
        station.vehicle.receive(codec.encode(anything(chance, names)), station.now_s)
        station.run(chance.choice([0.02, 0.06, 0.3]))
    for message_id in ARDUPILOT.reports:
        report = station.vehicle._telemetry.report(message_id, station.flight)
        if report is not None:
            assert codec.encode(report)
    body = station.body
    assert all(math.isfinite(v) for v in (body.north_m, body.east_m, body.down_m, *body.attitude()))
    station.send(mavlink.MAVLink_ping_message(1, seed, 0, 0))
    assert seed in [m.seq for m in station.run(0.1) if m.get_type() == "PING"]
