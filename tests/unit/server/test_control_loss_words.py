"""The check before flight: what an autopilot's parameters mean when the tower or the pilot is lost."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.control.core.loss_words import findings_hash, is_dangerous, loss_sentences
from server.kernel.drone_settings import DroneSettings
from wire.control_messages import LossParameters, SafetySettings
from wire.open_holds import LostAction

COPTER = {
    "SYSID_MYGCS": 255.0,
    "FS_GCS_ENABLE": 1.0,
    "FS_GCS_TIMEOUT": 5.0,
    "FS_THR_ENABLE": 1.0,
    "FS_OPTIONS": 13.0,
    "RC_OVERRIDE_TIME": 3.0,
    "RC_FS_TIMEOUT": 1.0,
    "RC_OPTIONS": 32.0,
}
PX4 = {"COM_RC_IN_MODE": 1.0, "COM_RC_LOSS_T": 0.5, "COM_DL_LOSS_T": 10.0, "NAV_DLL_ACT": 2.0, "NAV_RCL_ACT": 2.0} | {
    "COM_RCL_EXCEPT": 7.0
}
WITH_RADIO = {"COM_RC_IN_MODE": 3.0}
USUAL = DroneSettings()
STAYS = DroneSettings(safety=SafetySettings(lost_action=LostAction.STAY))


def reported(values: dict[str, float], *, has_radio: bool | None = True, complete: bool = True) -> LossParameters:
    kind = "px4" if "NAV_RCL_ACT" in values or "COM_RC_IN_MODE" in values else "ardupilot"
    return LossParameters(autopilot=kind, values=values, complete=complete, has_radio=has_radio)


@pytest.mark.parametrize("has_radio", [True, False])
@pytest.mark.parametrize("values", [COPTER, PX4], ids=["copter", "px4"])
def test_a_drone_that_is_set_up_well_is_in_no_danger(values: dict[str, float], has_radio: bool) -> None:
    sentences = loss_sentences(reported(values, has_radio=has_radio), USUAL)
    assert not is_dangerous(sentences)
    assert {sentence.about for sentence in sentences} == {"operator", "tower", "radio"}


@pytest.mark.parametrize(
    ("values", "has_radio", "settings", "about", "severity", "words"),
    [
        (COPTER | {"RC_OVERRIDE_TIME": -1.0}, True, USUAL, "operator", "danger", "never expire"),
        (COPTER | {"RC_OVERRIDE_TIME": 0.0}, True, USUAL, "operator", "danger", "impossible"),
        (COPTER | {"RC_OVERRIDE_TIME": 0.0}, False, USUAL, "operator", "danger", "impossible"),
        (COPTER | {"RC_OVERRIDE_TIME": 60.0}, True, USUAL, "operator", "warning", "60 s"),
        (COPTER | {"RC_OPTIONS": 2.0}, True, USUAL, "operator", "danger", "RC_OPTIONS"),
        (COPTER | {"RC_OPTIONS": 1.0}, True, USUAL, "radio", "warning", "ignore the radio receiver"),
        (COPTER | {"RC_OPTIONS": 4.0}, True, USUAL, "radio", "warning", "failsafe signal"),
        (COPTER | {"FS_THR_ENABLE": 0.0}, False, USUAL, "radio", "danger", "the last sticks stay"),
        ({"RC_OVERRIDE_TIME": 3.0}, False, USUAL, "radio", "warning", "not known"),
        (COPTER | {"FS_THR_ENABLE": 0.0}, True, USUAL, "radio", "warning", "does nothing"),
        (COPTER | {"FS_THR_ENABLE": 0.0}, None, USUAL, "radio", "warning", "does nothing"),
        (COPTER, False, USUAL, "radio", "info", "There is no radio. 1 s after the last sticks"),
        (COPTER | {"FS_THR_ENABLE": 3.0}, False, USUAL, "radio", "info", "lands where it is"),
        (
            COPTER | {"FS_OPTIONS": 16.0},
            False,
            USUAL,
            "radio",
            "danger",
            "without sticks the autopilot returns to launch",
        ),
        (COPTER | {"FS_OPTIONS": 16.0, "FS_THR_ENABLE": 3.0}, False, USUAL, "radio", "danger", "autopilot lands"),
        (COPTER, True, USUAL, "radio", "info", "GUIDED without anybody's sticks"),
        (COPTER | {"FS_OPTIONS": 16.0}, True, USUAL, "radio", "info", "whether the transmitter is lost"),
        (COPTER, True, USUAL, "radio", "info", "after 3 s, and after 5 s the autopilot returns to launch"),
        (COPTER | {"FS_GCS_ENABLE": 0.0}, True, USUAL, "radio", "danger", "lands the drone on the spot"),
        (COPTER | {"FS_OPTIONS": 16.0}, True, USUAL, "radio", "danger", "in the first seconds of a hold"),
        (COPTER | {"FS_GCS_TIMEOUT": 60.0}, True, USUAL, "radio", "danger", "lands the drone on the spot"),
        (COPTER, None, USUAL, "radio", "danger", "not known whether"),
        (COPTER | {"FS_OPTIONS": 1.0}, True, USUAL, "radio", "info", "a mission goes on"),
        (COPTER | {"FS_OPTIONS": 16.0}, True, USUAL, "tower", "warning", "flown by hand"),
        (COPTER | {"FS_OPTIONS": 2.0}, True, USUAL, "tower", "info", "not during a mission"),
        (COPTER | {"FS_GCS_ENABLE": 0.0}, True, USUAL, "tower", "warning", "FS_GCS_ENABLE is 0"),
        (COPTER | {"FS_GCS_ENABLE": 0.0, "FS_THR_ENABLE": 0.0}, True, USUAL, "tower", "danger", "nothing else"),
        (COPTER | {"FS_GCS_ENABLE": 5.0}, True, USUAL, "tower", "info", "lands where it is after 5 s"),
        (COPTER | {"SYSID_MYGCS": 42.0}, True, USUAL, "operator", "info", "ground station 42"),
        (PX4 | {"COM_RC_IN_MODE": 0.0}, True, USUAL, "operator", "warning", "ignores sticks"),
        (PX4 | {"COM_RC_IN_MODE": 4.0}, True, USUAL, "operator", "warning", "ignores sticks"),
        (PX4 | {"COM_RC_IN_MODE": 2.0}, True, USUAL, "operator", "warning", "while the radio is on"),
        (PX4 | {"COM_RC_IN_MODE": 3.0}, True, USUAL, "operator", "warning", "while the radio is on"),
        (PX4 | {"COM_RC_IN_MODE": 5.0}, True, USUAL, "operator", "warning", "while the radio is on"),
        (PX4 | {"COM_RC_IN_MODE": 7.0}, True, USUAL, "operator", "warning", "while the radio is on"),
        (PX4 | {"COM_RC_IN_MODE": 3.0}, True, USUAL, "operator", "warning", "but a position"),
        (PX4 | {"NAV_RCL_ACT": 0.0}, False, USUAL, "radio", "danger", "NAV_RCL_ACT is 0"),
        (PX4 | {"NAV_RCL_ACT": 6.0}, False, USUAL, "radio", "danger", "falls"),
        (PX4 | {"NAV_RCL_ACT": 3.0}, False, USUAL, "radio", "info", "lands where it is"),
        (PX4 | {"COM_RCL_EXCEPT": 5.0}, False, USUAL, "radio", "danger", "COM_RCL_EXCEPT lacks 2"),
        (PX4 | WITH_RADIO, True, USUAL, "radio", "info", "stays in AUTO.LOITER"),
        (PX4 | WITH_RADIO, True, USUAL, "radio", "warning", "in the first seconds of a hold"),
        (PX4, True, USUAL, "radio", "info", "There is no radio. 5.5 s after the last sticks"),
        (PX4 | {"COM_FAIL_ACT_T": 2.0}, False, USUAL, "radio", "info", "2.5 s after the last sticks"),
        (PX4 | {"NAV_RCL_ACT": 1.0}, False, USUAL, "radio", "info", "0.5 s after the last sticks"),
        (PX4, True, USUAL, "tower", "info", "after 15 s, the autopilot returns"),
        (PX4, True, USUAL, "tower", "warning", "is gone in a mission"),
        (PX4 | {"COM_OBL_RC_ACT": 0.0}, True, USUAL, "tower", "warning", "5 makes it hold"),
        (PX4 | WITH_RADIO, None, USUAL, "radio", "danger", "not known whether"),
        (PX4 | {"NAV_DLL_ACT": 5.0}, True, USUAL, "tower", "danger", "falls"),
        (PX4 | {"NAV_DLL_ACT": 0.0}, True, USUAL, "tower", "warning", "NAV_DLL_ACT is 0"),
        (PX4 | {"NAV_DLL_ACT": 0.0, "COM_RCL_EXCEPT": 7.0}, False, USUAL, "tower", "info", "Where a mission ends"),
        (PX4 | {"NAV_DLL_ACT": 0.0, "NAV_RCL_ACT": 0.0}, True, USUAL, "tower", "danger", "nothing else"),
        (PX4 | {"COM_RCL_EXCEPT": 5.0}, True, USUAL, "radio", "info", "a mission, offboard flight"),
    ],
)
def test_what_the_parameters_mean(
    values: dict[str, float], has_radio: bool | None, settings: DroneSettings, about: str, severity: str, words: str
) -> None:
    sentences = loss_sentences(reported(values, has_radio=has_radio), settings)
    fitting = [one for one in sentences if one.about == about and words in one.text]
    assert [one.severity for one in fitting] == [severity], sentences


@pytest.mark.parametrize("missing", ["NAV_RCL_ACT", "NAV_DLL_ACT"])
def test_what_px4_does_not_tell_is_said_to_be_unknown(missing: str) -> None:
    values = {name: value for name, value in PX4.items() if name != missing}
    assert any(missing in one.text and one.severity == "warning" for one in loss_sentences(reported(values), USUAL))


def test_the_newer_name_of_the_ground_station_counts_too() -> None:
    values = {name: value for name, value in COPTER.items() if name != "SYSID_MYGCS"}
    assert any("255 is assumed" in one.text for one in loss_sentences(reported(values), USUAL))
    newer = loss_sentences(reported(values | {"MAV_GCS_SYSID": 255.0}), USUAL)
    assert not any("255 is assumed" in one.text for one in newer)


@pytest.mark.parametrize(
    "parameters",
    [None, reported(COPTER, complete=False), LossParameters(autopilot="", values={}, complete=True)],
    ids=["nothing told", "incomplete", "another autopilot"],
)
def test_what_is_not_known_is_a_warning(parameters: LossParameters | None) -> None:
    sentences = loss_sentences(parameters, USUAL)
    assert "warning" in {one.severity for one in sentences}
    assert not is_dangerous(sentences)


def test_our_own_side_is_told_with_the_drones_settings() -> None:
    ladder = ("LOITER", "ALT_HOLD")
    safety = SafetySettings(hold_ladder=ladder, sticks_stale_s=0.7, lost_action=LostAction.LAND, rtt_limit_ms=300.0)
    text = " ".join(one.text for one in loss_sentences(None, DroneSettings(safety=safety)))
    for words in (
        "LOITER, then altitude hold",
        "0.7 s",
        "300 ms",
        "is lost for 30 s, it is told to land where it is",
    ):
        assert words in text
    assert "until the battery is needed" in " ".join(one.text for one in loss_sentences(None, STAYS))


def test_an_acknowledgement_holds_for_these_dangers_only() -> None:
    def hash_of(**values: float) -> str:
        return findings_hash(loss_sentences(reported(COPTER | values, has_radio=False), USUAL))

    one_danger = hash_of(FS_THR_ENABLE=0.0)
    assert hash_of(FS_THR_ENABLE=0.0, FS_GCS_TIMEOUT=2.0) == one_danger
    assert hash_of(FS_THR_ENABLE=0.0, RC_OVERRIDE_TIME=-1.0) != one_danger
    assert hash_of() != one_danger


@given(
    st.sampled_from(["ardupilot", "px4", ""]),
    st.dictionaries(st.sampled_from([*COPTER, *PX4]), st.floats()),
    st.sampled_from([True, False, None]),
    st.booleans(),
)
def test_whatever_an_agent_tells_there_is_an_answer(
    autopilot: str, values: dict[str, float], has_radio: bool | None, complete: bool
) -> None:
    parameters = LossParameters(autopilot=autopilot, values=values, complete=complete, has_radio=has_radio)
    for settings in (USUAL, STAYS):
        assert all(sentence.text.endswith(".") for sentence in loss_sentences(parameters, settings))


def test_a_controller_without_a_hold_is_dangerous_and_says_so() -> None:
    parameters = LossParameters(autopilot="msp", values={}, complete=True)
    dangers = [one.text for one in loss_sentences(parameters, USUAL) if one.severity == "danger"]
    assert len(dangers) == 2
    assert "no hold" in dangers[0]
    assert "failsafe" in dangers[1]


def test_of_a_vehicle_that_is_watched_only_nothing_is_promised() -> None:
    (sentence,) = loss_sentences(reported(COPTER), USUAL, watched_only=True)
    assert sentence.severity == "warning"
    assert "watched only" in sentence.text
    assert loss_sentences(None, USUAL, watched_only=True) == [sentence]
