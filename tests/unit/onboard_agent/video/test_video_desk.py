"""The flight process's side of video: when the video process runs, and what the tower is told."""

import pytest

from onboard_agent.video.desk import KEEP_S, SILENT_WORDS, STOPPED_WORDS, VideoDesk
from onboard_agent.video.lines import BadLine, Report, SetUp, Watched, decode_from_child, decode_to_child, encode_line
from onboard_agent.video.link_memory import Remembered
from wire.transactions import TRANSACTIONS
from wire.video import VIDEO, CameraState, Codec, Quality, StreamWish, VideoWanted

WISH = StreamWish(Quality.LOW, Codec.MPEG1)
WANTED = VideoWanted(ticket="t", streams=(WISH,))


@pytest.fixture
def desk() -> VideoDesk:
    desk = VideoDesk(has_camera=True)
    desk.link_up((TRANSACTIONS, VIDEO))
    return desk


def told(desk: VideoDesk) -> CameraState | None:
    state = desk.take_to_tower()
    return None if state is None else state.camera


def test_it_runs_when_something_is_watched_and_a_while_longer(desk: VideoDesk) -> None:
    assert not desk.should_run(0.0)
    desk.wanted(WANTED, 1.0)
    assert desk.should_run(1.0)
    assert desk.should_run(1e6)
    assert desk.watched == Watched(ticket="t", streams=(WISH,))
    desk.wanted(VideoWanted(ticket="t"), 2.0)
    assert desk.watched.streams == ()
    assert desk.should_run(2.0 + KEEP_S - 1)
    assert not desk.should_run(2.0 + KEEP_S)


def test_nothing_is_watched_over_a_link_that_is_down(desk: VideoDesk) -> None:
    desk.wanted(WANTED, 1.0)
    desk.link_down(2.0)
    assert desk.watched == Watched()
    assert desk.should_run(3.0), "the next link comes soon"
    assert desk.take_to_tower() is None
    desk.link_up((VIDEO,))
    assert told(desk) is CameraState.IDLE
    desk.wanted(WANTED, 3.0)
    assert told(desk) is CameraState.OPENING


def test_that_it_does_not_answer_is_said_until_it_does(desk: VideoDesk) -> None:
    desk.wanted(WANTED, 0.0)
    desk.silent()
    assert told(desk) is CameraState.OPENING, "it has not said anything yet"
    desk.reported(Report(camera=CameraState.LIVE))
    assert told(desk) is CameraState.LIVE
    desk.silent()
    state = desk.take_to_tower()
    assert state is not None
    assert (state.camera, state.words) == (CameraState.LOST, SILENT_WORDS)
    desk.silent()
    assert told(desk) is None, "said once"
    desk.reported(Report(camera=CameraState.LIVE))
    assert told(desk) is CameraState.LIVE
    desk.reported(Report(camera=CameraState.LOST, words="unplugged"))
    desk.silent()
    state = desk.take_to_tower()
    assert state is not None
    assert state.words == "unplugged", "that is why there are no pictures"
    desk.ended()
    state = desk.take_to_tower()
    assert state is not None
    assert state.words == STOPPED_WORDS


def test_what_was_learnt_of_the_link_is_kept_for_the_next_process_and_goes_with_the_link(desk: VideoDesk) -> None:
    link = Remembered(local="192.0.2.7", at=1.0, pacing_bps=2e6, budget_bps=1e6, bound_bps=None, base_s=0.05)
    desk.wanted(WANTED, 0.0)
    desk.reported(Report(camera=CameraState.LIVE, link=link))
    desk.ended()
    assert desk.link == link
    desk.reported(Report(camera=CameraState.LIVE, link=link))
    desk.reported(Report(camera=CameraState.LIVE))
    assert desk.link is None, "the process has forgotten it"
    desk.reported(Report(camera=CameraState.LIVE, link=link))
    desk.link_down(2.0)
    desk.reported(Report(camera=CameraState.LIVE, link=link))
    assert desk.link is None


@pytest.mark.parametrize(("has_camera", "takes"), [(False, (VIDEO,)), (True, (TRANSACTIONS,))])
def test_without_a_camera_or_a_tower_for_it_there_is_no_video(has_camera: bool, takes: tuple[str, ...]) -> None:
    desk = VideoDesk(has_camera=has_camera)
    desk.link_up(takes)
    assert desk.take_to_tower() is None
    desk.wanted(WANTED, 1.0)
    assert not desk.should_run(1.0)


def test_the_tower_is_told_each_change_once(desk: VideoDesk) -> None:
    assert told(desk) is CameraState.IDLE
    assert told(desk) is None
    desk.wanted(WANTED, 0.0)
    assert told(desk) is CameraState.OPENING
    desk.reported(Report(camera=CameraState.IDLE))
    assert told(desk) is None
    desk.reported(Report(camera=CameraState.LIVE, codecs=(Codec.MPEG1,)))
    state = desk.take_to_tower()
    assert state is not None
    assert (state.camera, state.codecs) == (CameraState.LIVE, (Codec.MPEG1,))
    desk.reported(Report(camera=CameraState.LIVE, codecs=(Codec.MPEG1,)))
    assert told(desk) is None
    desk.reported(Report(camera=CameraState.LOST, words="x" * 500, thin=True))
    state = desk.take_to_tower()
    assert state is not None
    assert (state.camera, len(state.words), state.thin, state.codecs) == (CameraState.LOST, 200, True, (Codec.MPEG1,))
    desk.ended()
    state = desk.take_to_tower()
    assert state is not None
    assert (state.camera, state.words) == (CameraState.LOST, STOPPED_WORDS)
    desk.reported(Report(camera=CameraState.OPENING))
    assert told(desk) is CameraState.OPENING
    desk.link_resumed()
    assert told(desk) is CameraState.OPENING, "all again on another control channel"
    desk.wanted(VideoWanted(ticket="t"), 5.0)
    desk.ended()
    assert told(desk) is CameraState.IDLE, "nobody watches: nobody need know"


@pytest.mark.parametrize(
    "message",
    [
        SetUp(tower="https://t", camera="rtsp://u:p@h", uplinks=("",)),
        Watched(ticket="t", streams=(WISH,)),
        Watched(),
    ],
)
def test_lines_to_the_child(message: SetUp | Watched) -> None:
    line = encode_line(message)
    assert line.endswith(b"\n")
    assert line.count(b"\n") == 1
    assert decode_to_child(line) == message


def test_lines_from_the_child() -> None:
    link = Remembered(local="192.0.2.7", at=1.0, pacing_bps=2e6, budget_bps=1e6, bound_bps=None, base_s=0.05)
    report = Report(camera=CameraState.LOST, words='"unplugged"\n', thin=True, codecs=(Codec.H264,), link=link)
    line = encode_line(report)
    assert line.count(b"\n") == 1
    assert decode_from_child(line) == report


@pytest.mark.parametrize("line", [b"", b"\n", b"{}", b'{"type":"report"}', b"Segmentation fault\n", b"\xff\xfe"])
def test_what_is_no_line(line: bytes) -> None:
    with pytest.raises(BadLine):
        decode_from_child(line)
    with pytest.raises(BadLine):
        decode_to_child(line)
