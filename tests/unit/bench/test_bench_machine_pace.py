"""Which frames count as having met a halt of the machine."""

import asyncio

import pytest

from bench.machine_pace import MachinePace, machine_pace


@pytest.mark.parametrize(
    ("sent_ms", "met"), [(989.0, False), (991.0, True), (1000.0, True), (1019.0, True), (1021.0, False)]
)
def test_a_frame_met_the_halt_that_came_soon_after_it_was_sent_or_just_before(sent_ms: float, met: bool) -> None:
    pace = MachinePace(slow_us=[500_000.0, 1_000_000.0, 5_000_000.0], pieces=100)
    assert pace.stood_still_at(sent_ms * 1000) is met
    assert pace.slow_share == 0.03


def test_without_halts_no_frame_is_left_out() -> None:
    assert not MachinePace().stood_still_at(1.0)
    assert MachinePace().slow_share == 0.0


async def test_the_watching_process_looks_until_the_block_ends() -> None:
    async with machine_pace() as pace:
        await asyncio.sleep(0.1)
    assert pace.pieces > 0
    assert pace.slow_us == sorted(pace.slow_us)
