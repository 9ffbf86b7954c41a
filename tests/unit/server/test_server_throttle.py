"""The sign-in throttle, with simulated time."""

from server.accounts.core.throttle import (
    FIRST_WAIT_S,
    FORGOTTEN_AFTER_S,
    FREE_TRIES,
    FREE_TRIES_OF_ADDRESS,
    MAX_ENTRIES,
    MAX_NAMES,
    MAX_WAIT_S,
    SUSPECT_FROM,
    SignInThrottle,
)
from server.anonymous.core.fair_queue import Priority
from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.limits import LIMITS


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
    assert waits[-1] == MAX_WAIT_S


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


def guesses(throttle: SignInThrottle, count: int, now_s: float = 0.0) -> int:
    """Returns how many of `count` tries pass, each from its own address and network."""
    return sum(
        throttle.begin(name="anna", address=f"10.{n % 250}.{n // 250}.1", now_s=now_s) == 0.0 for n in range(count)
    )


def test_a_name_takes_a_hundred_guesses_an_hour_from_wherever() -> None:
    throttle, most = SignInThrottle(), LIMITS.guesses_per_name_per_hour
    let_through = sum(guesses(throttle, 20, now_s=60.0 * minute) for minute in range(60))
    assert most * 0.9 <= let_through <= most
    assert sum(guesses(throttle, 20, now_s=3600.0 + 60.0 * minute) for minute in range(60)) <= most


def test_who_must_wait_for_a_name_is_told_how_long() -> None:
    throttle = SignInThrottle()
    guesses(throttle, 200)
    wait_s = throttle.begin(name="anna", address="192.0.2.1", now_s=0.0)
    assert 0 < wait_s <= 3600 / LIMITS.guesses_per_name_per_hour * 2
    assert throttle.begin(name="anna", address="192.0.2.1", now_s=wait_s + 0.001) == 0.0


def test_guessing_does_not_lock_the_owner_out_where_they_are_known() -> None:
    known = KnownAddresses(b"k" * 32, 100)
    throttle = SignInThrottle(known)
    assert throttle.begin(name="anna", address="192.0.2.1", now_s=0.0) == 0.0
    throttle.succeeded(name="anna", address="192.0.2.1")
    guesses(throttle, 500)
    assert throttle.begin(name="anna", address="192.0.2.1", now_s=0.0) == 0.0
    assert throttle.begin(name="anna", address="192.0.2.77", now_s=0.0) > 0.0
    # A known address counts only for the account that used it.
    throttle.begin(name="ben", address="192.0.2.9", now_s=0.0)
    throttle.succeeded(name="ben", address="192.0.2.9")
    assert throttle.begin(name="anna", address="192.0.2.9", now_s=0.0) > 0.0


def test_right_passwords_use_up_no_guesses() -> None:
    throttle = SignInThrottle()
    for number in range(2 * LIMITS.guesses_per_name_per_hour):
        address = f"10.{number % 250}.{number // 250}.1"
        assert throttle.begin(name="anna", address=address, now_s=0.0) == 0.0
        throttle.succeeded(name="anna", address=address)


def test_a_64_is_one_address() -> None:
    throttle = SignInThrottle()
    waits = [
        throttle.begin(name=str(number), address=f"2001:db8:1:2::{number:x}", now_s=0.0)
        for number in range(FREE_TRIES_OF_ADDRESS + 20)
    ]
    assert waits[:FREE_TRIES_OF_ADDRESS] == [0.0] * FREE_TRIES_OF_ADDRESS
    assert all(wait > 0 for wait in waits[FREE_TRIES_OF_ADDRESS:])
    assert throttle.begin(name="anna", address="2001:db8:1:3::1", now_s=0.0) == 0.0


def test_who_comes_from_where_it_was_guessed_hashes_last_and_the_known_first() -> None:
    known = KnownAddresses(b"k" * 32, 100)
    throttle = SignInThrottle(known)

    def standing(name: str, address: str, now_s: float = 0.0) -> Priority:
        throttle.begin(name=name, address=address, now_s=now_s)
        return throttle.caller(name=name, address=address, now_s=now_s).standing

    assert [standing(f"n{n}", f"2001:db8:1:{n:x}::1") for n in range(SUSPECT_FROM + 2)] == [
        *[Priority.FRESH] * SUSPECT_FROM,
        *[Priority.SUSPECT] * 2,
    ]
    assert standing("anna", "198.51.100.1") is Priority.FRESH
    throttle.succeeded(name="anna", address="198.51.100.1")
    assert standing("anna", "198.51.100.1") is Priority.KNOWN
    assert standing("ben", "198.51.100.1") is Priority.FRESH
    assert standing("n", "2001:db8:1:ff::1", now_s=FORGOTTEN_AFTER_S) is Priority.FRESH


def test_memory_is_bounded_and_the_oldest_goes_first() -> None:
    throttle = SignInThrottle()
    tries(throttle, FREE_TRIES + 1)
    for number in range(MAX_ENTRIES):
        throttle.begin(name=str(number), address=str(number), now_s=0)
    assert len(throttle) == MAX_ENTRIES
    assert tries(throttle, 1) == [0.0]


def test_spraying_other_names_gives_no_guesses_back() -> None:
    """10,000 other names, a hundred a second from ever new addresses, between two rounds at the same one."""
    throttle, addresses = SignInThrottle(), iter(range(10**6))

    def guess(name: str, now_s: float) -> bool:
        number = next(addresses)
        address = f"10.{number >> 16 & 255}.{number >> 8 & 255}.{number & 255}"
        return throttle.begin(name=name, address=address, now_s=now_s) == 0.0

    assert sum(guess("anna", 0.0) for _ in range(200)) == LIMITS.guesses_per_name_per_hour // 2
    for number in range(3 * MAX_NAMES // 2):
        guess(f"nobody {number}", number / 100.0)
    now_s = 3 * MAX_NAMES / 2 / 100.0
    regrown = now_s * LIMITS.guesses_per_name_per_hour / 2 / 3600
    assert sum(guess("anna", now_s) for _ in range(200)) <= regrown
