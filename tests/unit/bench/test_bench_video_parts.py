"""Which cases of the video benchmark run, and its report on a throttled viewer."""

import math

import pytest

from bench.rows import Report
from bench.video.bench_run import CASES, LONG, ON_A_NETWORK, chosen
from bench.video.settings import H264, LARGE, SMALL
from bench.video.strip import Sight
from bench.video.throttle import Times, announce

BEGIN_MS = 1_000_000.0
TIMES = Times(BEGIN_MS, BEGIN_MS + 10_000, BEGIN_MS + 30_000, BEGIN_MS + 45_000)


def test_cases_by_name() -> None:
    assert chosen(None) == list(CASES)
    assert chosen(f"fanout,{LONG},loopback") == ["fanout", LONG, "loopback"]
    with pytest.raises(ValueError, match="no case 'fan-out'; there are loopback"):
        chosen("loopback,fan-out")
    assert set(CASES) >= ON_A_NETWORK


def test_what_is_asked_of_the_camera() -> None:
    assert [one.words for one in (SMALL, LARGE, H264)] == ["320x240@24", "640x480@30", "640x480@30, H.264"]


def every(seconds: float, begin_ms: float, end_ms: float, delay_ms: float) -> list[Sight]:
    count = int((end_ms - begin_ms) / (1000 * seconds))
    return [Sight(at, at - delay_ms) for at in (begin_ms + 1000 * seconds * n for n in range(count))]


def sent_events(throttled: list[Sight]) -> dict[str, float]:
    report = Report("video")
    announce(report, "case", TIMES, throttled, every(0.04, TIMES.begin, TIMES.end, 50), 25)
    return {row.metric: row.value for row in report.rows}


def test_a_viewer_that_keeps_up_with_key_pictures() -> None:
    rows = sent_events(
        every(0.04, TIMES.begin, TIMES.throttled, 50)
        + every(0.5, TIMES.throttled, TIMES.freed, 400)
        + every(0.04, TIMES.freed + 800, TIMES.end, 50)
    )
    assert rows["throttled: delay before, p95"] == 50
    assert rows["throttled: delay meanwhile_max"] == 400
    assert rows["throttled: oldest on the screen meanwhile"] == 400 + 500 + 800  # until the first one afterwards
    assert rows["throttled: pictures a second meanwhile"] == 2
    assert rows["throttled: as before after"] == 800
    assert rows["throttled: worst delay, -5 to +0 s"] == 50
    assert rows["throttled: worst delay, +0 to +5 s"] == 400
    assert rows["the other: never seen meanwhile"] == 0
    assert rows["the other: delay meanwhile_max"] == 50


def test_a_viewer_that_never_recovers() -> None:
    rows = sent_events(every(0.04, TIMES.begin, TIMES.throttled, 50) + every(0.04, TIMES.throttled, TIMES.end, 9000))
    assert math.isnan(rows["throttled: as before after"])
