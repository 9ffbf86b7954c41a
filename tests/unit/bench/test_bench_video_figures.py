"""The video benchmark's figures from its observations."""

import math

import pytest

from bench.video.figures import (
    TS_PACKET_BYTES,
    TransportStream,
    drift_ms_per_minute,
    frozen_ms,
    oldest_on_screen_ms,
    recovered_after_ms,
    unseen,
)
from bench.video.strip import Sight


def seen(*pairs: tuple[float, float]) -> list[Sight]:
    """Sights from pairs of (when, delay)."""
    return [Sight(at, at - delay) for at, delay in pairs]


def steady(rate_hz: float, seconds: float, delay_ms: float = 50.0) -> list[Sight]:
    return seen(*((1000 * n / rate_hz, delay_ms) for n in range(round(rate_hz * seconds))))


def test_pictures_that_nobody_saw() -> None:
    all_of_them = steady(24, 5)
    assert unseen(all_of_them, 24) == 0
    assert unseen([one for n, one in enumerate(all_of_them) if n % 10 != 3], 24) == 12
    assert unseen(all_of_them[:1], 24) == 0


def test_how_stale_the_screen_was() -> None:
    poses = seen((100, 50), (140, 50), (640, 500), (680, 50))
    assert oldest_on_screen_ms(poses, 700) == 640 - 90
    assert oldest_on_screen_ms(poses, 2000) == 2000 - 630
    assert frozen_ms(poses) == 500
    assert math.isnan(oldest_on_screen_ms([], 700))


def test_an_older_picture_does_not_make_the_screen_older_than_it_was() -> None:
    assert oldest_on_screen_ms(seen((100, 50), (110, 90), (150, 50)), 150) == 100


def test_drift() -> None:
    growing = seen(*((1000.0 * second, 50 + second / 10) for second in range(120)))
    assert drift_ms_per_minute(growing) == pytest.approx(6.0)
    assert drift_ms_per_minute(steady(24, 60)) == pytest.approx(0.0)


def test_recovery_counts_only_when_it_stays() -> None:
    late = seen(*((100.0 * n, 800.0) for n in range(10)))
    a_moment = seen((1000.0, 50.0))
    late_again = seen(*((1000.0 + 100 * n, 300.0) for n in range(1, 5)))
    well = seen(*((1500.0 + 40 * n, 55.0) for n in range(40)))
    assert recovered_after_ms([*late, *a_moment, *late_again, *well], 900.0, 50.0) == 600.0
    assert math.isnan(recovered_after_ms([*late, *a_moment, *late_again], 900.0, 50.0))
    assert math.isnan(recovered_after_ms([*late, *well[:5]], 900.0, 50.0))  # it is unknown whether it stayed


def packet(stream: int, counter: int, *, payload: bool = True) -> bytes:
    flags = (0x10 if payload else 0x20) | counter & 0x0F
    return (b"\x47" + stream.to_bytes(2, "big") + bytes((flags,))).ljust(TS_PACKET_BYTES, b"\xff")


@pytest.mark.parametrize("size", [1, 100, 188, 4096])
def test_missing_packets_of_a_transport_stream(size: int) -> None:
    whole = [packet(256, n) for n in range(40)]
    counter = TransportStream()
    stream = b"".join([*whole[:10], packet(256, 9, payload=False), packet(17, 5), *whole[13:]])
    for at in range(0, len(stream), size):
        counter.feed(stream[at : at + size])
    assert (counter.packets, counter.missing, counter.out_of_step) == (39, 3, 0)


def test_bytes_that_are_no_packet() -> None:
    counter = TransportStream()
    counter.feed(b"abc" + packet(256, 0) + packet(256, 1))
    assert (counter.packets, counter.missing, counter.out_of_step) == (2, 0, 3)
