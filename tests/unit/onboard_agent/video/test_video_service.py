"""The flight process's side of video: when the video process runs, and the reports to the tower."""

import pytest

from onboard_agent.video.core.lines import (
    BadLine,
    Report,
    SetUp,
    Watched,
    decode_from_child,
    decode_to_child,
    encode_line,
)
from onboard_agent.video.core.link_memory import Remembered
from onboard_agent.video.core.service import KEEP_S, SILENT_WORDS, STOPPED_WORDS, VideoService
from wire.transactions import TRANSACTIONS
from wire.video import VIDEO, CameraState, Codec, Quality, StreamRequest, VideoWanted

REQUEST = StreamRequest(Quality.LOW, Codec.MPEG1)
WANTED = VideoWanted(ticket="t", streams=(REQUEST,))


@pytest.fixture
def service() -> VideoService:
    service = VideoService(has_camera=True)
    service.link_up((TRANSACTIONS, VIDEO))
    return service


def sent_states(service: VideoService) -> CameraState | None:
    state = service.messages_to_tower()
    return None if state is None else state.camera


def test_it_runs_when_something_is_watched_and_a_while_longer(service: VideoService) -> None:
    assert not service.should_run(0.0)
    service.wanted(WANTED, 1.0)
    assert service.should_run(1.0)
    assert service.should_run(1e6)
    assert service.watched == Watched(ticket="t", streams=(REQUEST,))
    service.wanted(VideoWanted(ticket="t"), 2.0)
    assert service.watched.streams == ()
    assert service.should_run(2.0 + KEEP_S - 1)
    assert not service.should_run(2.0 + KEEP_S)


def test_nothing_is_watched_over_a_link_that_is_down(service: VideoService) -> None:
    service.wanted(WANTED, 1.0)
    service.link_down(2.0)
    assert service.watched == Watched()
    assert service.should_run(3.0), "the next link comes soon"
    assert service.messages_to_tower() is None
    service.link_up((VIDEO,))
    assert sent_states(service) is CameraState.IDLE
    service.wanted(WANTED, 3.0)
    assert sent_states(service) is CameraState.OPENING


def test_that_it_does_not_answer_is_said_until_it_does(service: VideoService) -> None:
    service.wanted(WANTED, 0.0)
    service.silent()
    assert sent_states(service) is CameraState.OPENING, "it has not said anything yet"
    service.reported(Report(camera=CameraState.LIVE))
    assert sent_states(service) is CameraState.LIVE
    service.silent()
    state = service.messages_to_tower()
    assert state is not None
    assert (state.camera, state.words) == (CameraState.LOST, SILENT_WORDS)
    service.silent()
    assert sent_states(service) is None, "said once"
    service.reported(Report(camera=CameraState.LIVE))
    assert sent_states(service) is CameraState.LIVE
    service.reported(Report(camera=CameraState.LOST, words="unplugged"))
    service.silent()
    state = service.messages_to_tower()
    assert state is not None
    assert state.words == "unplugged", "that is why there are no pictures"
    service.ended()
    state = service.messages_to_tower()
    assert state is not None
    assert state.words == STOPPED_WORDS


def test_what_was_learnt_of_the_link_is_kept_for_the_next_process_and_goes_with_the_link(service: VideoService) -> None:
    link = Remembered(local="192.0.2.7", at=1.0, pacing_bps=2e6, budget_bps=1e6, bound_bps=None, base_s=0.05)
    service.wanted(WANTED, 0.0)
    service.reported(Report(camera=CameraState.LIVE, link=link))
    service.ended()
    assert service.link == link
    service.reported(Report(camera=CameraState.LIVE, link=link))
    service.reported(Report(camera=CameraState.LIVE))
    assert service.link is None, "the process has forgotten it"
    service.reported(Report(camera=CameraState.LIVE, link=link))
    service.link_down(2.0)
    service.reported(Report(camera=CameraState.LIVE, link=link))
    assert service.link is None


@pytest.mark.parametrize(("has_camera", "takes"), [(False, (VIDEO,)), (True, (TRANSACTIONS,))])
def test_without_a_camera_or_a_tower_for_it_there_is_no_video(has_camera: bool, takes: tuple[str, ...]) -> None:
    service = VideoService(has_camera=has_camera)
    service.link_up(takes)
    assert service.messages_to_tower() is None
    service.wanted(WANTED, 1.0)
    assert not service.should_run(1.0)


def test_the_tower_is_told_each_change_once(service: VideoService) -> None:
    assert sent_states(service) is CameraState.IDLE
    assert sent_states(service) is None
    service.wanted(WANTED, 0.0)
    assert sent_states(service) is CameraState.OPENING
    service.reported(Report(camera=CameraState.IDLE))
    assert sent_states(service) is None
    service.reported(Report(camera=CameraState.LIVE, codecs=(Codec.MPEG1,)))
    state = service.messages_to_tower()
    assert state is not None
    assert (state.camera, state.codecs) == (CameraState.LIVE, (Codec.MPEG1,))
    service.reported(Report(camera=CameraState.LIVE, codecs=(Codec.MPEG1,)))
    assert sent_states(service) is None
    service.reported(Report(camera=CameraState.LOST, words="x" * 500, thin=True))
    state = service.messages_to_tower()
    assert state is not None
    assert (state.camera, len(state.words), state.thin, state.codecs) == (CameraState.LOST, 200, True, (Codec.MPEG1,))
    service.ended()
    state = service.messages_to_tower()
    assert state is not None
    assert (state.camera, state.words) == (CameraState.LOST, STOPPED_WORDS)
    service.reported(Report(camera=CameraState.OPENING))
    assert sent_states(service) is CameraState.OPENING
    service.link_resumed()
    assert sent_states(service) is CameraState.OPENING, "all again on another control channel"
    service.wanted(VideoWanted(ticket="t"), 5.0)
    service.ended()
    assert sent_states(service) is CameraState.IDLE, "nobody watches: nobody need know"


@pytest.mark.parametrize(
    "message",
    [
        SetUp(tower="https://t", camera="rtsp://u:p@h", uplinks=("",)),
        Watched(ticket="t", streams=(REQUEST,)),
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
