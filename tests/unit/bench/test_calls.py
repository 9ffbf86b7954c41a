"""How much of the product one frame passes through: a newcomer reads as many files."""

import pytest

from bench.calls import cases


@pytest.mark.parametrize(
    ("case", "calls", "files"),
    [
        ("agent: an attitude", 60, 25),
        ("agent: a stick", 80, 36),
        ("tower: an attitude", 30, 20),
        ("tower: a stick", 80, 28),
    ],
)
async def test_a_frame_calls_no_more_than_it_needs(case: str, calls: int, files: int) -> None:
    found = (await cases())[case]
    assert sum(found.values()) <= calls, found
    assert len({name.partition(":")[0] for name in found}) <= files, found


async def test_a_stick_reaches_the_autopilot_before_anything_is_reported() -> None:
    names = list((await cases())["agent: a stick"])
    sent = next(n for n, name in enumerate(names) if name.endswith(":Onboard.frames_to_autopilot"))
    assert not [name for name in names[:sent] if "reports" in name or "messages_to_tower" in name]
    assert not [name for name in names if name.endswith("TowerOutbox.take")], "that waits for the next tick"
