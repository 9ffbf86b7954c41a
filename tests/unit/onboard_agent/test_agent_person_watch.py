"""How long nobody has flown: each rule of `onboard_agent/failsafe/person_watch.py`."""

from onboard_agent.failsafe.person_watch import PersonWatch


def test_a_hold_begins_the_count_anew() -> None:
    watch = PersonWatch()
    assert watch.absent_s(10.0) is None
    watch.hold_began(10.0)
    assert watch.absent_s(15.0) == 5.0
    watch.stay("ada")
    watch.hold_began(20.0)
    assert watch.absent_s(21.0) == 1.0
    assert not watch.stayed


def test_whoever_flies_ends_it() -> None:
    watch = PersonWatch()
    watch.hold_began(10.0)
    watch.stay("ada")
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


def test_a_lease_that_ends_while_the_holder_is_gone_changes_nothing_and_a_release_is_no_loss() -> None:
    watch = PersonWatch()
    watch.holder_reported(held=True, present=False, now=10.0)
    watch.holder_reported(held=False, present=False, now=40.0)
    assert watch.absent_s(41.0) == 31.0
    released = PersonWatch()
    released.holder_reported(held=True, present=True, now=10.0)
    released.holder_reported(held=False, present=False, now=20.0)
    assert released.absent_s(50.0) is None


def test_a_command_that_does_not_end_the_hold_shows_that_somebody_is_there() -> None:
    watch = PersonWatch()
    watch.commanded(5.0)
    assert watch.absent_s(6.0) is None
    watch.hold_began(10.0)
    watch.commanded(15.0)
    assert watch.absent_s(20.0) == 5.0


def test_stay_needs_a_count_and_says_by_whom() -> None:
    watch = PersonWatch()
    watch.stay("ada")
    assert not watch.stayed
    watch.hold_began(10.0)
    watch.stay("ada")
    assert (watch.stayed, watch.stayed_by) == (True, "ada")
