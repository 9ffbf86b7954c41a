"""A real ArduCopter whose own system id is written: up to 4.6 it counts after a restart, but for sticks at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from real.by_wire import CENTRED, CLIMB, by_wire

from bench.real_autopilot import Receiver

NAME = "SYSID_THISMAV"
CLIMBED_S = 5.0


async def test_sticks_for_the_id_under_which_it_sends_are_ignored_before_the_restart(
    arducopter: Path, tmp_path: Path
) -> None:
    async with by_wire(arducopter, tmp_path / "autopilot", Receiver.CENTRED) as hands:
        await hands.up(15.0)
        try:
            await hands.truth.set_parameter(NAME, 7)
        except TimeoutError:
            pytest.skip(f"this ArduCopter has no {NAME}")
        climbed = []
        for system_id in (7, 1):
            await hands.truth.set_parameter(NAME, system_id)
            began_m = hands.truth.alt_m
            hands.sticks = CLIMB
            await hands.passed(CLIMBED_S)
            climbed.append(hands.truth.alt_m - began_m)
            hands.sticks = CENTRED
            await hands.passed(1.0)
        assert climbed[0] < 1.0, "it still sends as system 1, and ignores sticks for it"
        assert climbed[1] > 5.0
