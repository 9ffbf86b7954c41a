"""Viewers in a lockstep group receive exactly what each would receive alone."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from video_relay_scene import MEDIUM, FakeViewer, Scene, unit
from worlds.tiers import examples

from server.video.core.drone_video import Flow
from server.video.core.pacing import TRUST_S
from server.video.core.viewer import MAX_MEMBERS
from server.video.core.viewer_messages import Drawn
from wire.ids import DroneId

RATE_S = 1 / 24


def flow_of(scene: Scene) -> Flow:
    drone = scene.hub.state.drones.get(DroneId(1))
    assert drone is not None
    return scene.video.video_of(drone, scene.now).flows[MEDIUM]


def settle(scene: Scene) -> None:
    while scene.later:
        later, scene.later[:] = list(scene.later), []
        for call in later:
            call(scene.now)


def calm(scene: Scene, *viewers: FakeViewer) -> None:
    for viewer in viewers:
        scene.video.got(viewer.viewer, Drawn(viewer.sequences[-1], calm=True), scene.now)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def watched_by(scene: Scene, count: int) -> list[FakeViewer]:
    """All viewers have received the first picture and report that they are calm."""
    viewers = [FakeViewer(scene, 9) for _ in range(count)]
    for one in viewers:
        one.draws = False
    scene.open_channel()
    scene.send(unit(0, key=True))
    settle(scene)
    calm(scene, *viewers)
    return viewers


def test_the_calm_are_in_groups_and_get_everything(scene: Scene) -> None:
    viewers = watched_by(scene, MAX_MEMBERS + 8)
    flow = flow_of(scene)
    assert [len(one) for one in flow.lockstep_groups] == [MAX_MEMBERS, 8]
    assert not flow.alone
    for number in range(1, 30):
        scene.now += RATE_S
        scene.send(unit(number, key=number % 12 == 0))
        settle(scene)
    assert all(one.sequences == list(range(30)) for one in viewers)
    assert scene.video.traffic.units_out == 30 * len(viewers)
    assert sum(scene.video.traffic.wait.counts) == 30 * len(viewers)


def test_a_got_settles_the_account_of_one_and_it_comes_back(scene: Scene) -> None:
    first, second = watched_by(scene, 2)
    for number in range(1, 11):
        scene.now += RATE_S
        scene.send(unit(number))
        settle(scene)
    calm(scene, first)
    assert first.viewer.pace.in_flight == 0
    assert first.viewer.lockstep is second.viewer.lockstep is not None
    flow_of(scene).leave_lockstep(second.viewer)
    assert second.viewer.pace.in_flight > 0
    assert second.viewer.pace.silent_for(scene.now) == pytest.approx(9 * RATE_S)


def test_who_is_late_is_alone_until_it_is_calm_again(scene: Scene) -> None:
    first, second = watched_by(scene, 2)
    scene.now += RATE_S
    scene.send(unit(1))
    settle(scene)
    scene.video.got(first.viewer, Drawn(1), scene.now)
    assert first.viewer.lockstep is None
    assert list(flow_of(scene).alone) == [first.viewer.number]
    for number in range(2, 60):
        scene.now += RATE_S
        scene.send(unit(number, key=number % 12 == 0))
        settle(scene)
    assert second.sequences == list(range(60))
    assert len(first.units) < 20  # it does not report what it has drawn
    calm(scene, first)
    assert first.viewer.pace.skipped > 0


def test_nobody_is_trusted_for_longer_than_it_may_be(scene: Scene) -> None:
    first, second = watched_by(scene, 2)
    said_at = scene.now
    number = 0
    while scene.now < said_at + TRUST_S + 2:
        scene.now += RATE_S
        number += 1
        scene.send(unit(number, key=number % 24 == 0))
        settle(scene)
        if number % 24 == 0:
            calm(scene, second)
    assert second.sequences == list(range(number + 1))
    assert first.viewer.lockstep is None
    assert first.sequences[-1] <= (TRUST_S + 0.3) / RATE_S


def test_who_does_not_read_is_put_out_by_the_write_that_fills_it(scene: Scene) -> None:
    first, second, third = watched_by(scene, 3)
    write = second.viewer.write

    def fills(message: bytes) -> None:
        write(message)
        second.reads = False
        scene.video.is_full(second.viewer)

    scene.video.is_full(second.viewer)
    second.viewer.write = fills
    calm(scene, second)
    for number in (1, 2, 3):
        scene.now += RATE_S
        scene.send(unit(number))
        settle(scene)
    assert first.sequences == third.sequences == [0, 1, 2, 3]
    assert second.sequences == [0, 1]
    second.viewer.write, second.reads = write, True
    scene.video.has_room(second.viewer, scene.now)
    assert second.sequences[:2] == [0, 1]
    assert second.sequences == sorted(set(second.sequences))


def test_who_goes_or_may_not_watch_any_more_gets_nothing_more(scene: Scene) -> None:
    first, second, third = watched_by(scene, 3)
    scene.video.leave(first.viewer)
    scene.video.end(second.viewer, 4403, "not any more")
    scene.now += RATE_S
    scene.send(unit(1))
    settle(scene)
    assert first.sequences == second.sequences == [0]
    assert third.sequences == [0, 1]
    scene.video.leave(third.viewer)
    assert not flow_of(scene).lockstep_groups
    assert not flow_of(scene).alone


def test_a_group_that_is_reached_late_is_no_group_any_more(scene: Scene) -> None:
    """The process paused: each viewer's own rules decide what is still worth sending."""
    viewers = watched_by(scene, MAX_MEMBERS + 3)
    scene.now += RATE_S
    scene.send(unit(1))
    assert len(scene.later) == 1
    scene.now += 0.5
    settle(scene)
    assert viewers[0].sequences == [0, 1]
    assert viewers[-1].sequences == [0]
    scene.send(unit(2, key=True))
    settle(scene)
    assert viewers[-1].sequences == [0, 2]


Act = tuple[str, int, float]
acts = st.lists(
    st.one_of(
        st.tuples(st.just("unit"), st.integers(0, 3), st.floats(0.0, 0.1)),
        st.tuples(st.sampled_from(["calm", "drawn", "overdue", "full", "room"]), st.integers(0, 4), st.floats(0, 0.05)),
        st.tuples(st.sampled_from(["key", "break", "gap", "channel"]), st.just(0), st.floats(0.0, 0.1)),
        st.tuples(st.just("pause"), st.just(0), st.floats(0.0, 3.0)),
        st.tuples(st.sampled_from(["comes", "goes"]), st.integers(0, 4), st.just(0.0)),
    ),
    max_size=120,
)


@settings(max_examples=examples(50, long=300))
@given(acts=acts)
def test_each_gets_what_it_would_get_alone(acts: list[Act]) -> None:
    together = sent_events(acts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Flow, "join_lockstep", lambda self, viewer, now: None)
        alone = sent_events(acts)
    assert together == alone


def sent_events(acts: list[Act]) -> list[Any]:
    """Returns what each viewer received, and its final state."""
    scene = Scene()
    viewers = [FakeViewer(scene, 9) for _ in range(5)]
    for one in viewers:
        one.draws = False
    scene.open_channel()
    sequence = 0
    scene.send(unit(0, key=True))
    settle(scene)
    for viewer in viewers:
        scene.video.got(viewer.viewer, Drawn(0), scene.now)
        scene.video.got(viewer.viewer, Drawn(0, calm=True), scene.now)
    scene.now += RATE_S
    scene.send(unit(sequence := 1))
    settle(scene)
    calm(scene, *viewers)
    for what, which, wait_s in acts:
        scene.now += wait_s
        one = viewers[which]
        do: dict[str, Callable[[], Any]] = {
            "calm": lambda one=one: _say(scene, one, calm=True),
            "drawn": lambda one=one: _say(scene, one),
            "overdue": lambda one=one: _say(scene, one, overdue=True),
            "full": lambda one=one: _turn(scene, one, reads=False),
            "room": lambda one=one: _turn(scene, one, reads=True),
            "goes": lambda one=one: scene.video.leave(one.viewer),
            "comes": lambda one=one: _comes(scene, one),
            "channel": scene.open_channel,
        }
        if what in do:
            do[what]()
        elif what != "pause":
            sequence += 2 if what == "gap" else 1
            scene.send(unit(sequence, key=what in ("key", "channel"), is_break=what == "break"))
        settle(scene)
    account = []
    for one in viewers:
        if one.viewer.lockstep is not None:
            flow_of(scene).leave_lockstep(one.viewer)
        pace = one.viewer.pace
        account.append((one.sequences, pace.in_flight, pace.skipped, pace.silent_for(scene.now), one.closed))
    return account


def _say(scene: Scene, viewer: FakeViewer, *, calm: bool = False, overdue: bool = False) -> None:
    if viewer.sequences:
        scene.video.got(viewer.viewer, Drawn(viewer.sequences[-1], calm=calm, overdue=overdue), scene.now)


def _turn(scene: Scene, viewer: FakeViewer, *, reads: bool) -> None:
    viewer.reads = reads
    if reads:
        scene.video.has_room(viewer.viewer, scene.now)
    else:
        scene.video.is_full(viewer.viewer)


def _comes(scene: Scene, viewer: FakeViewer) -> None:
    if viewer.viewer.lockstep is None and viewer.viewer.number not in flow_of(scene).viewers:
        scene.video.enter(viewer.viewer, scene.now)
