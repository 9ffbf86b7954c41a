"""When a silent video process is reported, and when it is given up."""

import pytest

from onboard_agent.video.core.child_watch import CHECK_EVERY_S, FIRST_WORD_WITHIN_S, ChildWatch, Verdict, state_of
from onboard_agent.video.core.lines import REPORT_EVERY_S

TICK_S = 0.1
"""Tick of the video process: the maximum delay of a report."""


class Scene:
    """A child process that has reported once; the test sets the clock."""

    def __init__(self) -> None:
        self.now = 100.0
        self.watch = ChildWatch(self.now)
        self.watch.heard()

    def silent_for(self, states: str, most_s: float) -> tuple[float | None, float | None]:
        """Returns the times until it was reported silent, and given up. `states`: thread states as the system shows
        them."""
        began, said_s, hung_s = self.now, None, None
        while hung_s is None and self.now < began + most_s:
            self.now += CHECK_EVERY_S
            verdict = self.watch.judge(states if self.watch.is_silent else "", self.now)
            if verdict is not Verdict.WELL and said_s is None:
                said_s = self.now - began
            if verdict is Verdict.HUNG:
                hung_s = self.now - began
        return said_s, hung_s


@pytest.mark.parametrize(
    ("states", "given_up_s"),
    [
        ("TTTT", (1.0, 1.6)),
        ("SSSS", (2.0, 3.3)),
        ("RSSS", (5.9, 6.6)),  # waits for the CPU, or loops
        ("SSSR", (5.9, 6.6)),  # another thread has Python's lock, and waits for the CPU
        ("SDSS", (5.9, 6.6)),  # reads from a slow memory card
        ("TSSS", (5.9, 6.6)),
        ("", (5.9, 6.6)),
    ],
)
def test_it_is_said_within_a_second_and_given_up_the_sooner_the_surer(
    states: str, given_up_s: tuple[float, float]
) -> None:
    said_s, hung_s = Scene().silent_for(states, 10)
    assert said_s is not None
    assert REPORT_EVERY_S + TICK_S < said_s <= 0.8
    assert hung_s is not None
    assert given_up_s[0] <= hung_s <= given_up_s[1]


def test_who_speaks_as_a_healthy_one_does_is_never_said_to_be_silent() -> None:
    scene = Scene()
    for _ in range(1000):
        assert scene.silent_for("SSSS", REPORT_EVERY_S + TICK_S) == (None, None)
        scene.watch.heard()


def test_now_asleep_and_now_waiting_for_its_turn_is_not_hung() -> None:
    scene = Scene()
    for states in ("SSSS", "RSSS", "SSSS", "SSSR"):
        assert scene.silent_for(states, 1.3)[1] is None
    assert scene.silent_for("SSSS", 2.6)[1] is not None


def test_a_process_that_goes_on_after_it_was_stopped_is_kept() -> None:
    scene = Scene()
    for _ in range(20):
        assert scene.silent_for("TTTT", 1.0)[1] is None
        scene.watch.heard()


@pytest.mark.parametrize("away_s", [3.0, 3600.0])
def test_when_we_were_away_ourselves_it_was_not_silent(away_s: float) -> None:
    scene = Scene()
    scene.silent_for("", 0.25)
    scene.now += away_s
    assert scene.watch.judge("", scene.now) is Verdict.WELL
    said_s, _ = scene.silent_for("SSSS", 1.0)
    assert said_s is not None


def test_before_its_first_word_it_is_waited_for() -> None:
    scene = Scene()
    scene.watch = ChildWatch(scene.now)
    said_s, hung_s = scene.silent_for("SSSS", 2 * FIRST_WORD_WITHIN_S)
    assert hung_s == said_s
    assert hung_s == pytest.approx(FIRST_WORD_WITHIN_S, abs=2 * CHECK_EVERY_S)


@pytest.mark.parametrize(
    ("stat", "letter"),
    [
        ("4711 (python) S 1 4711 4711 0 -1", "S"),
        ("4711 (a) R (b) T 1 4711", "T"),
        ("", ""),
        ("4711 (python)", ""),
    ],
)
def test_the_letter_of_a_thread(stat: str, letter: str) -> None:
    assert state_of(stat) == letter
