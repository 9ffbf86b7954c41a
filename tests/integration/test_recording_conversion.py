"""From units to an MP4, with the tower's converter program: ffprobe's report, and the pictures shown over time."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import av
import pytest
from worlds.camera_units import number_in, units

from server.video.core.recordings.units import MAGIC, entry_of
from server.video.store import finisher
from wire.video import Codec, decode_unit

US = 1_000_000
STEADY = [3 * US + number * 41_667 for number in range(48)]
PAUSED = [*STEADY[:24], *(20 * US + number * 83_333 for number in range(24))]
"""A second at 24 Hz, a pause of 16 s, and two seconds at 12 Hz."""


def write(path: Path, messages: Sequence[bytes]) -> Path:
    """Writes the units with a transit delay of 60 ms."""
    came = [decode_unit(message).capture_us + 60_000 for message in messages]
    path.write_bytes(MAGIC + b"".join(entry_of(message, at) for message, at in zip(messages, came, strict=True)))
    return path


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def convert(source: Path, *, code: int = 0) -> dict[str, Any]:
    """Runs the converter and returns the last line of its output."""
    arguments = [sys.executable, "-m", "server.video.store.make_mp4", str(source), str(source.with_suffix(".mp4"))]
    pipe = subprocess.PIPE
    with subprocess.Popen(arguments, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        said, wrong = running.stdout.read(), running.stderr.read()
        assert (running.wait(60), wrong) == (code, "")
    last: dict[str, Any] = json.loads(said.splitlines()[-1])
    return last


def probe(path: Path) -> dict[str, Any]:
    asked = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-show_format", "-of", "json", str(path)]
    answer = subprocess.run(asked, capture_output=True, text=True, check=True, timeout=60)
    assert answer.stderr == ""
    reported = json.loads(answer.stdout)
    assert len(reported["streams"]) == 1
    return {**reported["streams"][0], "format": reported["format"]}


def seen(path: Path) -> list[tuple[int, float]]:
    """Returns (picture, time in seconds) of each picture shown."""
    with av.open(str(path)) as container:
        return [(number_in(frame), frame.time) for frame in container.decode(video=0)]


def assert_shown(path: Path, numbers: Sequence[int], times_us: Sequence[int]) -> None:
    found = seen(path)
    assert [number for number, _ in found] == list(numbers)
    assert [at for _, at in found] == pytest.approx([(at - times_us[0]) / US for at in times_us], abs=0.002)


@pytest.mark.parametrize("codec", list(Codec), ids=lambda one: one.name)
@pytest.mark.parametrize("times", [STEADY, PAUSED], ids=["steady", "paused"])
def test_every_picture_is_there_at_its_time(tmp_path: Path, codec: Codec, times: list[int]) -> None:
    source = write(tmp_path / "a.units", units(codec, times))
    made = convert(source)
    target = source.with_suffix(".mp4")
    reported = probe(target)
    lasts = (times[-1] - times[0]) / US + (times[-1] - times[-2]) / US
    assert (reported["codec_name"], reported["pix_fmt"], reported["width"], reported["height"]) == (
        "h264",
        "yuv420p",
        320,
        240,
    )
    assert int(reported["nb_read_frames"]) == 48
    assert float(reported["duration"]) == pytest.approx(lasts, abs=0.05)
    assert float(reported["start_time"]) == 0
    assert made == {
        "duration_s": pytest.approx(lasts, abs=0.05),
        "width": 320,
        "height": 240,
        "pictures": 48,
        "recoded": codec is Codec.MPEG1,
        "first_lag_s": 0.0,
    }
    assert_shown(target, range(48), times)


def test_the_index_comes_first_so_that_it_plays_while_it_loads(tmp_path: Path) -> None:
    for codec in Codec:
        source = write(tmp_path / f"{codec.name}.units", units(codec, STEADY))
        convert(source)
        content = source.with_suffix(".mp4").read_bytes()
        assert 0 < content.index(b"moov") < content.index(b"mdat")


@pytest.mark.parametrize("codec", list(Codec), ids=lambda one: one.name)
def test_another_size_in_the_middle_becomes_one_file_of_the_largest(tmp_path: Path, codec: Codec) -> None:
    small, large = units(codec, STEADY[:24]), units(codec, STEADY[24:36], width=640, height=480, first_number=24)
    wide = units(codec, STEADY[36:], width=480, height=180, first_number=36)
    source = write(tmp_path / "a.units", [*small, *large, *wide])
    made = convert(source)
    assert (made["width"], made["height"], made["pictures"], made["recoded"]) == (640, 480, 48, True)
    target = source.with_suffix(".mp4")
    reported = probe(target)
    assert (reported["width"], reported["height"], reported["nb_read_frames"]) == (640, 480, "48")
    with av.open(str(target)) as container:
        frames = list(container.decode(video=0))
    assert [number_in(frame) for frame in frames[:36]] == list(range(36))
    # Wider than the file: black above and below, not stretched. 640 x 240 in the middle.
    light = frames[40].to_ndarray(format="gray")
    assert light[60].max() < 30
    assert light[420].max() < 30
    assert light[330].min() > 50


def test_a_change_of_parameters_alone_is_coded_again(tmp_path: Path) -> None:
    """Two encoders of one size with different parameter sets: one MP4 track holds one set."""
    first = units(Codec.H264, STEADY[:24])
    second = units(Codec.H264, STEADY[24:], first_number=24, group=11, preset="medium")
    source = write(tmp_path / "a.units", [*first, *second])
    assert convert(source)["recoded"] is True
    assert_shown(source.with_suffix(".mp4"), range(48), STEADY)


@pytest.mark.parametrize("codec", list(Codec), ids=lambda one: one.name)
def test_a_recording_that_was_cut_off_anywhere_has_what_was_whole(tmp_path: Path, codec: Codec) -> None:
    source = write(tmp_path / "a.units", units(codec, STEADY))
    content = source.read_bytes()
    source.write_bytes(content[: len(content) * 2 // 3])
    made = convert(source)
    assert 20 < made["pictures"] < 48
    assert_shown(source.with_suffix(".mp4"), range(made["pictures"]), STEADY[: made["pictures"]])


def test_it_begins_with_the_first_picture_that_can_be_decoded(tmp_path: Path) -> None:
    for codec in Codec:
        source = write(tmp_path / f"{codec.name}.units", units(codec, STEADY)[5:])
        convert(source)
        assert_shown(source.with_suffix(".mp4"), range(12, 48), STEADY[12:])


def test_a_damaged_picture_leaves_the_one_before_it_and_the_times_stay_right(tmp_path: Path) -> None:
    messages = units(Codec.MPEG1, STEADY)
    hurt = bytearray(messages[30])
    hurt[28:] = bytes([0x47]) + bytes(len(hurt) - 29)
    source = write(tmp_path / "a.units", [*messages[:30], bytes(hurt), *messages[31:]])
    made = convert(source)
    assert made["pictures"] == 47
    found = seen(source.with_suffix(".mp4"))
    assert len(found) == 48
    assert found[30][0] == found[29][0] == 29
    assert found[36] == (36, pytest.approx((STEADY[36] - STEADY[0]) / US, abs=0.002))


def test_where_nothing_can_be_made_it_says_so(tmp_path: Path) -> None:
    for name, content in (("none", MAGIC), ("foreign", b"hello"), ("torn", MAGIC + b"\x01\x02")):
        source = tmp_path / f"{name}.units"
        source.write_bytes(content)
        reported = convert(source, code=2)
        assert reported["problem"]
    assert "No such file" in convert(tmp_path / "missing.units", code=1)["problem"]


def test_it_ends_with_whoever_started_it(tmp_path: Path) -> None:
    times = [3 * US + number * 20_000 for number in range(1500)]
    source = write(tmp_path / "a.units", units(Codec.MPEG1, times, width=640, height=480))
    arguments = [sys.executable, "-m", "server.video.store.make_mp4", str(source), str(source.with_suffix(".mp4"))]
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as running:
        assert running.stdin is not None
        running.stdin.close()
        assert running.wait(20) == 3


async def test_a_file_that_takes_too_long_does_not_keep_the_others_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finisher, "MAX_DURATION_S", 0.3)
    times = [3 * US + number * 20_000 for number in range(1500)]
    source = write(tmp_path / "a.units", units(Codec.MPEG1, times, width=640, height=480))
    with pytest.raises(finisher.CannotFinish, match="takes too long") as found:
        await finisher.make_mp4(source, tmp_path / "a.mp4")
    assert not found.value.hopeless
    assert names_in(tmp_path) == ["a.units"]
