"""When the loss of the tower means that no pilot has the sticks any more."""

from onboard_agent.failsafe.link_loss import LinkLoss

STEP_S = 0.025
LOST_HOLD_S = 2.0


def alarm(loss: LinkLoss, begin: float, end: float) -> float | None:
    """Returns the time of the alarm, or None. Asserts that it is raised only once."""
    raised = []
    now = begin
    while now < end:
        if loss.lost_by_hand(now, lost_hold_s=LOST_HOLD_S):
            raised.append(now)
        now += STEP_S
    assert len(raised) <= 1
    return raised[0] if raised else None


def flown_until(now: float) -> LinkLoss:
    loss = LinkLoss(0.0)
    loss.tower_heard(now)
    loss.sticks_passed(now)
    return loss


def test_silence_of_two_seconds_while_flying_by_hand() -> None:
    raised = alarm(flown_until(10.0), 10.0, 20.0)
    assert raised is not None
    assert 12.0 <= raised < 12.1


def test_no_alarm_while_the_tower_is_heard() -> None:
    loss = flown_until(10.0)
    for n in range(100):
        loss.tower_heard(10.0 + n)
        assert alarm(loss, 10.0 + n, 11.0 + n) is None


def test_no_alarm_where_the_sticks_had_ended_before() -> None:
    loss = flown_until(10.0)
    loss.tower_heard(11.1)
    assert alarm(loss, 11.1, 20.0) is None


def test_no_alarm_where_nobody_ever_flew() -> None:
    assert alarm(LinkLoss(0.0), 0.0, 20.0) is None


def test_no_alarm_where_the_drone_flies_by_command() -> None:
    loss = flown_until(10.0)
    loss.flies_without_sticks()
    assert alarm(loss, 10.0, 20.0) is None


def test_a_link_that_is_back_without_the_pilot_is_not_safe() -> None:
    loss = flown_until(10.0)
    loss.pilot_cut_off(10.5)
    loss.tower_heard(10.8)
    for n in range(10):
        loss.tower_heard(11.0 + n / 5)
    raised = alarm(loss, 11.0, 20.0)
    assert raised is not None
    assert 12.0 <= raised < 12.1


def test_a_link_that_is_back_with_the_pilot_is() -> None:
    loss = flown_until(10.0)
    loss.pilot_cut_off(10.5)
    loss.tower_heard(10.8)
    loss.sticks_passed(11.0)
    loss.tower_heard(12.9)
    assert alarm(loss, 11.0, 12.95) is None


def test_the_next_loss_needs_a_hand_again() -> None:
    loss = flown_until(10.0)
    assert alarm(loss, 10.0, 20.0)
    loss.tower_heard(30.0)
    assert alarm(loss, 30.0, 40.0) is None
    loss.tower_heard(50.0)
    loss.sticks_passed(50.0)
    assert alarm(loss, 50.0, 60.0)


def test_a_tower_that_was_never_there_cannot_be_lost() -> None:
    assert LinkLoss(0.0).tower_gone_s(3600.0) == 0.0


def test_the_tower_is_gone_since_its_last_datagram_where_the_channel_lingered() -> None:
    loss = LinkLoss(0.0)
    loss.link_up(1.0)
    loss.tower_heard(10.0)
    assert loss.tower_gone_s(12.0) == 0.0, "the control channel is still there"
    loss.link_down(13.0)
    assert loss.tower_gone_s(20.0) == 10.0
    loss.link_down(15.0)
    assert loss.tower_gone_s(20.0) == 10.0, "said twice"
    loss.link_up(21.0)
    assert loss.tower_gone_s(22.0) == 0.0


def test_a_tower_that_could_only_be_reached_by_the_channel_is_gone_with_it() -> None:
    loss = LinkLoss(0.0)
    loss.link_up(1.0)
    loss.link_down(600.0)
    assert loss.tower_gone_s(610.0) == 10.0
