"""How long an agent that is sent away stays with its old tower, by a loop whose clock is the test's."""

import asyncio
import selectors
from collections.abc import Coroutine, Sequence
from typing import Any, Final, cast

import pytest

from onboard_agent.sockets.control_channel import NoLink, OpenedChannel
from onboard_agent.sockets.replacement_channel import CHECK_EVERY_S, STAYS_S, successor

TICK_S: Final = 0.001


class _NoWait(selectors.SelectSelector):
    """Moves the clock instead of waiting."""

    now = 0.0

    def select(self, timeout: float | None = None) -> Any:
        assert timeout is not None, "nothing would ever happen"
        self.now += timeout
        return super().select(0)


class _FakeLoop(asyncio.SelectorEventLoop):
    def __init__(self) -> None:
        self._clock = _NoWait()
        super().__init__(self._clock)

    def time(self) -> float:
        return self._clock.now


class _Transport:
    aborted = False

    def abort(self) -> None:
        self.aborted = True


class _Connection:
    local_address: Final = ("127.0.0.1", 1)
    close_code: int | None = None

    def __init__(self) -> None:
        self.transport = _Transport()


class _Channel:
    def __init__(self) -> None:
        self.connection = _Connection()


class _Data:
    """Datagrams of the old tower arrive."""

    over_udp: Final = True
    silent = 0.1

    def silent_s(self, now: float) -> float:
        return self.silent

    def is_cut_off(self, address: str, now: float) -> bool:
        return False

    def uplinks_that_work(self, now: float) -> Sequence[str]:
        return ()


class _Elsewhere:
    """Another tower. `answers`: seconds until it answers, for each attempt; None: it cannot be reached."""

    is_known: Final = True

    def __init__(self, *answers: float | None, sent_away: bool = True) -> None:
        self._answers = list(answers)
        self.is_sent_away = sent_away
        self.found = _Channel()
        self.found_at = 0.0

    def wants_to_look(self, *, silent_s: float, now: float) -> bool:
        return bool(self._answers)

    async def look(self, opened: OpenedChannel, data: Any) -> OpenedChannel:
        answers = self._answers.pop(0)
        if answers is None:
            raise NoLink("refused")
        await asyncio.sleep(answers)
        self.found_at = asyncio.get_running_loop().time()
        return cast("OpenedChannel", self.found)


class _Scene:
    """An agent's old tower, which it has been told to leave."""

    def __init__(self, elsewhere: _Elsewhere) -> None:
        self.elsewhere = elsewhere
        self.old = _Channel()
        self.data = _Data()
        self.replaced = 0
        self.sticks: list[float] = []
        """When sticks arrived from the old tower."""

    async def leave(self, *, closes_at: float = float("inf"), code: int | None = 1001) -> tuple[Any, float]:
        """`closes_at`: when the old tower closes the channel, with this code. Returns the next channel and when."""
        loop = asyncio.get_running_loop()
        reading = asyncio.create_task(self._read(closes_at, code))
        try:
            found = await successor(
                cast("OpenedChannel", self.old),
                cast("Any", self.data),
                reading,
                self._replace,
                cast("Any", self.elsewhere),
            )
            return found, loop.time()
        finally:
            reading.cancel()

    async def _read(self, closes_at: float, code: int | None) -> None:
        loop = asyncio.get_running_loop()
        while loop.time() < closes_at:
            self.sticks.append(loop.time())
            await asyncio.sleep(min(0.02, closes_at - loop.time()))
        self.old.connection.close_code = code

    async def _replace(self, opened: OpenedChannel, uplinks: Sequence[str]) -> OpenedChannel:
        self.replaced += 1
        raise NoLink("the old tower takes nobody any more")


def run(coroutine: Coroutine[Any, Any, tuple[Any, float]]) -> tuple[Any, float]:
    with asyncio.Runner(loop_factory=_FakeLoop) as runner:
        return runner.run(coroutine)


def test_sticks_come_through_the_old_tower_until_the_new_one_has_the_drone() -> None:
    scene = _Scene(_Elsewhere(0.25))
    found, at = run(scene.leave(closes_at=0.6))
    assert found is scene.elsewhere.found
    assert scene.elsewhere.found_at == pytest.approx(0.25, abs=TICK_S)
    assert at == pytest.approx(0.6, abs=TICK_S), "as soon as the old tower closes the link"
    assert scene.sticks[-1] == pytest.approx(0.58, abs=TICK_S)
    assert not scene.elsewhere.found.connection.transport.aborted


def test_it_stays_for_one_second_at_most() -> None:
    scene = _Scene(_Elsewhere(0.25))
    found, at = run(scene.leave())
    assert found is scene.elsewhere.found
    stays = at - scene.elsewhere.found_at
    assert STAYS_S == 1.0
    assert STAYS_S <= stays <= STAYS_S + CHECK_EVERY_S + TICK_S
    assert scene.sticks[-1] > at - 0.03, "and has sticks all the time"


def test_it_goes_at_once_when_the_old_tower_is_gone_before() -> None:
    scene = _Scene(_Elsewhere(0.3))
    found, at = run(scene.leave(closes_at=0.1, code=1006))
    assert found is scene.elsewhere.found
    assert at == pytest.approx(0.3, abs=TICK_S)


def test_it_goes_at_once_from_a_tower_that_is_silent() -> None:
    scene = _Scene(_Elsewhere(0.3, sent_away=False))
    scene.data.silent = 2.0
    found, at = run(scene.leave())
    assert found is scene.elsewhere.found
    assert at == pytest.approx(0.3, abs=TICK_S)


def test_it_looks_again_while_no_other_tower_answers_and_keeps_its_own() -> None:
    scene = _Scene(_Elsewhere(None, None, 0.2))
    found, at = run(scene.leave(closes_at=1.0))
    assert found is scene.elsewhere.found
    assert at == pytest.approx(1.0, abs=TICK_S)
    assert scene.replaced == 0


def test_a_tower_that_closes_before_another_one_answers_ends_the_link() -> None:
    scene = _Scene(_Elsewhere())
    found, at = run(scene.leave(closes_at=0.5))
    assert found is None
    assert at == pytest.approx(0.5, abs=TICK_S)


def test_the_new_link_ends_with_an_agent_that_ends_before_it_has_moved() -> None:
    scene = _Scene(_Elsewhere(0.2))

    async def ended() -> tuple[Any, float]:
        leaving = asyncio.create_task(scene.leave())
        await asyncio.sleep(0.5)
        assert not leaving.done()
        leaving.cancel()
        await asyncio.gather(leaving, return_exceptions=True)
        return None, asyncio.get_running_loop().time()

    run(ended())
    assert scene.elsewhere.found.connection.transport.aborted
