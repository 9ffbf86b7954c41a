"""The sign-in throttle, with time passed in."""

from server.accounts.throttle import (
    FIRST_WAIT_S,
    FORGOTTEN_AFTER_S,
    FREE_TRIES,
    FREE_TRIES_OF_ADDRESS,
    FREE_TRIES_OF_NAME,
    LONGEST_WAIT_OF_NAME_S,
    LONGEST_WAIT_S,
    MOST_ENTRIES,
    SignInThrottle,
)


def tries(throttle: SignInThrottle, count: int, now_s: float = 0.0) -> list[float]:
    return [throttle.begin(name="anna", address="a", now_s=now_s) for _ in range(count)]


def test_a_hundred_at_the_same_moment_are_a_hundred_tries() -> None:
    waits = tries(SignInThrottle(), 100)
    assert waits[:FREE_TRIES] == [0.0] * FREE_TRIES
    assert all(wait == FIRST_WAIT_S for wait in waits[FREE_TRIES:])


def test_waits_double_up_to_a_bound() -> None:
    throttle, now_s, waits = SignInThrottle(), 0.0, []
    tries(throttle, FREE_TRIES)
    for _ in range(12):
        wait_s = throttle.begin(name="anna", address="a", now_s=now_s)
        waits.append(wait_s)
        now_s += wait_s
        assert throttle.begin(name="anna", address="a", now_s=now_s) == 0.0
    assert waits[:4] == [1.0, 2.0, 4.0, 8.0]
    assert waits[-1] == LONGEST_WAIT_S


def test_asking_while_waiting_does_not_make_it_longer() -> None:
    throttle = SignInThrottle()
    tries(throttle, FREE_TRIES)
    assert tries(throttle, 50, now_s=0.5) == [0.5] * 50
    assert tries(throttle, 1, now_s=1.0) == [0.0]


def test_success_clears_and_so_does_time() -> None:
    throttle = SignInThrottle()
    tries(throttle, FREE_TRIES)
    throttle.succeeded(name="anna", address="a")
    assert tries(throttle, FREE_TRIES) == [0.0] * FREE_TRIES
    assert tries(throttle, 2, now_s=FORGOTTEN_AFTER_S) == [0.0, 0.0]


def test_names_and_addresses_do_not_share_their_tries() -> None:
    throttle = SignInThrottle()
    tries(throttle, FREE_TRIES + 1)
    assert throttle.begin(name="ben", address="a", now_s=0) == 0.0
    assert throttle.begin(name="anna", address="b", now_s=0) == 0.0


def test_one_password_tried_on_many_names_from_one_address_waits() -> None:
    throttle = SignInThrottle()
    waits = [throttle.begin(name=str(number), address="a", now_s=0.0) for number in range(FREE_TRIES_OF_ADDRESS + 1)]
    assert waits == [0.0] * FREE_TRIES_OF_ADDRESS + [FIRST_WAIT_S]
    assert throttle.begin(name="anna", address="b", now_s=0.0) == 0.0


def test_whoever_has_an_account_does_not_clear_the_address_by_signing_in() -> None:
    throttle = SignInThrottle()
    for number in range(FREE_TRIES_OF_ADDRESS - 1):
        assert throttle.begin(name=str(number), address="a", now_s=0.0) == 0.0
        assert throttle.begin(name="mine", address="a", now_s=0.0) == 0.0
        throttle.succeeded(name="mine", address="a")
    assert throttle.begin(name="last", address="a", now_s=0.0) == 0.0
    assert throttle.begin(name="mine", address="a", now_s=0.0) > 0.0


def test_one_name_from_many_addresses_waits_but_not_for_long() -> None:
    throttle, now_s, waits = SignInThrottle(), 0.0, []
    for number in range(FREE_TRIES_OF_NAME + 20):
        wait_s = throttle.begin(name="anna", address=str(number), now_s=now_s)
        waits.append(wait_s)
        now_s += wait_s
    assert waits[:FREE_TRIES_OF_NAME] == [0.0] * FREE_TRIES_OF_NAME
    assert max(waits) == LONGEST_WAIT_OF_NAME_S


def test_memory_is_bounded_and_the_oldest_goes_first() -> None:
    throttle = SignInThrottle()
    tries(throttle, FREE_TRIES + 1)
    for number in range(MOST_ENTRIES):
        throttle.begin(name=str(number), address=str(number), now_s=0)
    assert len(throttle) == MOST_ENTRIES
    assert tries(throttle, 1) == [0.0]
