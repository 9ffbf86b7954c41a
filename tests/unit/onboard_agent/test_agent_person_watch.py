"""How long nobody has flown: each rule of `onboard_agent/failsafe/person_watch.py`."""

from onboard_agent.failsafe.person_watch import STAY_FOR_S, PersonWatch


def test_a_hold_begins_the_count_anew() -> None:
    watch = PersonWatch()
    assert watch.absent_s(10.0) is None
    watch.hold_began(10.0)
    assert watch.absent_s(15.0) == 5.0
    watch.stay("ada", 15.0)
    watch.hold_began(20.0)
    assert watch.absent_s(21.0) == 1.0
    assert not watch.stayed


def test_whoever_flies_ends_it() -> None:
    watch = PersonWatch()
    watch.hold_began(10.0)
    watch.stay("ada", 15.0)
    watch.attended()
    assert watch.absent_s(100.0) is None
    assert not (watch.stayed or watch.holding)


def test_a_holder_who_is_gone_begins_it_and_one_who_is_back_ends_it() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=True, present=False, now=10.0)
    watch.holder_reported(held=True, present=False, now=12.0)
    assert watch.absent_s(15.0) == 5.0, "told twice, gone once"
    watch.holder_reported(held=True, present=True, now=16.0)
    assert watch.absent_s(17.0) is None


def test_in_a_hold_being_there_is_not_flying() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=True, present=False, now=8.0)
    watch.hold_began(10.0)
    watch.holder_reported(held=True, present=True, now=15.0)
    assert watch.absent_s(20.0) == 10.0


def test_a_lease_that_ends_while_the_holder_is_gone_changes_nothing() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=True, present=False, now=10.0)
    watch.holder_reported(held=False, present=False, now=40.0)
    assert watch.absent_s(41.0) == 31.0
    watch.seen(42.0, needs_somebody=True)
    assert watch.absent_s(43.0) == 33.0


def test_nobody_has_the_controls_of_what_needs_somebody() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=True, present=True, now=10.0)
    watch.seen(11.0, needs_somebody=True)
    assert watch.absent_s(12.0) is None
    watch.holder_reported(held=False, present=False, now=20.0)
    watch.seen(20.0, needs_somebody=True)
    watch.seen(25.0, needs_somebody=True)
    assert watch.absent_s(50.0) == 30.0
    watch.seen(50.0, needs_somebody=False)
    assert watch.absent_s(51.0) is None, "it was started to fly alone, or is down"
    watch.seen(60.0, needs_somebody=True)
    watch.holder_reported(held=True, present=True, now=61.0)
    assert watch.absent_s(62.0) is None


def test_stay_must_be_renewed() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=False, present=False, now=10.0)
    watch.seen(10.0, needs_somebody=True)
    watch.stay("ada", 20.0)
    watch.seen(20.0 + STAY_FOR_S - 1.0, needs_somebody=True)
    assert watch.stayed
    watch.stay("ada", 500.0)
    watch.seen(20.0 + STAY_FOR_S, needs_somebody=True)
    assert watch.stayed, "renewed"
    watch.seen(500.0 + STAY_FOR_S, needs_somebody=True)
    assert not watch.stayed
    assert watch.absent_s(505.0 + STAY_FOR_S) == 5.0, "the countdown starts again"


def test_a_command_that_does_not_end_the_hold_shows_that_somebody_is_there() -> None:
    watch = PersonWatch()
    watch.commanded(5.0)
    assert watch.absent_s(6.0) is None
    watch.hold_began(10.0)
    watch.commanded(15.0)
    assert watch.absent_s(20.0) == 5.0


def test_stay_needs_a_count_and_says_by_whom() -> None:
    watch = PersonWatch()
    watch.stay("ada", 15.0)
    assert not watch.stayed
    watch.hold_began(10.0)
    watch.stay("ada", 15.0)
    assert (watch.stayed, watch.stayed_by) == (True, "ada")
