"""What counts on a line with signatures."""

from signing_autopilot import SigningAutopilot

from onboard_agent.signing.signed_line import UNSIGNED, SignedLine
from wire.dialect import build, mavlink
from wire.frame_signing import fits, is_signed, stamp_of, ticks_of
from wire.signing_key import Signing

KEY, OTHER = bytes([1] * 32), bytes([2] * 32)
TODAY = 1_800_000_000.0


def text(words: bytes = b"x") -> bytes:
    return build(mavlink.MAVLink_statustext_message(4, words), system_id=255, component_id=190, sequence=0)


def signing(key: bytes = KEY, *, system_id: int = 1, ticks: int = ticks_of(TODAY)) -> SigningAutopilot:
    autopilot = SigningAutopilot(system_id=system_id)
    autopilot.sign(key, ticks)
    return autopilot


def test_without_a_key_frames_pass_as_they_are() -> None:
    line = SignedLine()
    frames = [text(), *signing().heartbeat()]
    assert line.is_plain and line.open(frames, 0.0) == frames
    assert line.sign(text(), TODAY) == text()
    assert line.state(0.0) is Signing.OFF


def test_with_a_key_only_its_frames_count() -> None:
    line, autopilot = SignedLine((KEY,)), signing()
    plain = SigningAutopilot().heartbeat()
    (opened,) = line.open([*autopilot.heartbeat(), *plain, text(), *signing(OTHER).heartbeat()], 1.0)
    assert opened == plain[0], "without the signature it is the same frame"
    assert line.state(1.0) is Signing.ON
    autopilot.receive([line.sign(text(), TODAY)])
    assert autopilot.heard == ["STATUSTEXT"]
    autopilot.receive([text()])
    assert autopilot.heard == ["STATUSTEXT"]


def test_a_frame_counts_once() -> None:
    line, autopilot = SignedLine((KEY,)), signing()
    first, second = *autopilot.heartbeat(), *autopilot.heartbeat()
    assert len(line.open([second], 0.0)) == 1
    assert line.open([first, second], 0.0) == []
    assert len(line.open(autopilot.heartbeat(), 0.0)) == 1


def test_each_signature_is_newer_than_the_one_before() -> None:
    line = SignedLine((KEY,))
    stamps = [stamp_of(line.sign(text(), TODAY - at))[1] for at in range(5)]
    assert stamps == [ticks_of(TODAY) + at for at in range(5)], "the clock was set back"
    assert stamp_of(line.sign(text(), TODAY + 1))[1] == ticks_of(TODAY + 1)


def test_a_computer_without_a_clock_follows_the_autopilot() -> None:
    line, autopilot = SignedLine((KEY,)), signing()
    line.open(autopilot.heartbeat(), 0.0)
    autopilot.receive([line.sign(text(), 0.0)])
    assert autopilot.heard == ["STATUSTEXT"]
    forged = SignedLine((KEY,))
    forged.open(signing(OTHER, ticks=ticks_of(TODAY) * 2).heartbeat(), 0.0)
    assert stamp_of(forged.sign(text(), TODAY))[1] == ticks_of(TODAY), "only an authentic time moves it"


def test_an_offered_key_counts_with_the_first_heartbeat_that_it_fits() -> None:
    line, autopilot = SignedLine((KEY,)), signing()
    line.offer(OTHER)
    assert len(line.open(autopilot.heartbeat(), 0.0)) == 1
    assert line.keys == (KEY, OTHER) and fits(line.sign(text(), TODAY), KEY)
    autopilot.sign(OTHER, ticks_of(TODAY) + 100)
    assert len(line.open(autopilot.heartbeat(), 0.0)) == 1
    assert line.keys == (OTHER,) and fits(line.sign(text(), TODAY), OTHER)
    assert line.open(signing(KEY, ticks=ticks_of(TODAY) * 2).heartbeat(), 0.0) == [], "the old one counts no more"


def test_only_the_autopilot_takes_a_key() -> None:
    line = SignedLine()
    line.offer(KEY)
    camera = SigningAutopilot()
    camera.sign(KEY)
    beat = camera.codec.encode(mavlink.MAVLink_heartbeat_message(30, 8, 0, 0, 4, 3))
    assert len(line.open([beat], 0.0)) == 1
    assert line.keys == (UNSIGNED, KEY)


def test_a_first_key_is_awaited_without_losing_frames() -> None:
    line, plain = SignedLine(), SigningAutopilot()
    line.offer(KEY)
    beat = plain.heartbeat()
    assert line.open(beat, 0.0) == beat
    assert not is_signed(line.sign(text(), TODAY))
    line.withdraw()
    assert line.is_plain


def test_a_key_goes_when_the_autopilot_signs_no_more_and_was_told_so() -> None:
    line, plain = SignedLine((KEY,)), SigningAutopilot()
    assert line.open(plain.heartbeat(), 0.0) == []
    line.offer(UNSIGNED)
    assert line.open([text()], 0.0) == [], "only a heartbeat of the autopilot shows it"
    assert len(line.open(plain.heartbeat(), 0.0)) == 1
    assert line.is_plain


def test_a_wrong_key_is_told_and_one_that_fits_again_is_too() -> None:
    line, autopilot = SignedLine((KEY,), 1), signing()
    line.open(SigningAutopilot().heartbeat(), 10.0)
    assert line.state(10.0) is Signing.WRONG_KEY
    line.open(autopilot.heartbeat(), 11.0)
    assert line.state(11.0) is Signing.ON
    line.open(SigningAutopilot().heartbeat(), 17.0)
    assert line.state(17.0) is Signing.WRONG_KEY
    assert line.state(30.0) is Signing.ON, "nothing comes at all"
    line.open(SigningAutopilot(system_id=2).heartbeat(), 40.0)
    assert line.state(40.0) is Signing.ON, "another vehicle on the line has no key of this one"


def test_a_forgotten_key_no_longer_counts() -> None:
    line = SignedLine((KEY,))
    line.forget()
    beat = SigningAutopilot().heartbeat()
    assert line.open(beat, 0.0) == beat and line.sign(text(), TODAY) == text()
