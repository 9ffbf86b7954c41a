"""What a controller's description of its settings takes and refuses, in words that name the setting."""

import pytest

from wire.control_messages import MAX_MESSAGE_BYTES, decode_to_tower, encode_message
from wire.controller_settings import MAX_CHOICES, ControllerDescribed, ControllerSetting, SettingKind, fault_of
from wire.controllers import MAX_SETTINGS, SettingValue

SETTINGS = (
    ControllerSetting(
        name="height_m", kind=SettingKind.NUMBER, default=10.0, label="Height", unit="m", least=2.0, most=60.0
    ),
    ControllerSetting(name="rounds", kind=SettingKind.NUMBER, default=1.0, label="Rounds", least=1.0),
    ControllerSetting(name="drop_m", kind=SettingKind.NUMBER, default=1.0, label="Drop", unit="m", most=5.0),
    ControllerSetting(
        name="letter", kind=SettingKind.TEXT, default="", label="Letter", characters="ABK", most_characters=2
    ),
    ControllerSetting(name="colour", kind=SettingKind.CHOICE, default="red", label="Colour", choices=("red", "blue")),
    ControllerSetting(name="eye", kind=SettingKind.CAMERA, default="", label="Camera", choices=("", "down")),
    ControllerSetting(name="any_eye", kind=SettingKind.CAMERA, default="", label="Camera"),
)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"height_m": 2.0, "rounds": 1e9, "drop_m": -5.0},
        {"height_m": 60},
        {"letter": "", "colour": "blue", "eye": ""},
        {"letter": "KA", "eye": "down", "any_eye": "whatever"},
    ],
)
def test_what_is_within_its_bounds_passes(given: dict[str, SettingValue]) -> None:
    assert fault_of(SETTINGS, given) is None


@pytest.mark.parametrize(
    ("given", "name", "why"),
    [
        ({"height_m": 1.9}, "height_m", "must be from 2 to 60 m"),
        ({"height_m": 60.1}, "height_m", "must be from 2 to 60 m"),
        ({"height_m": float("nan")}, "height_m", "must be a number"),
        ({"height_m": "10"}, "height_m", "must be a number"),
        ({"rounds": 0.0}, "rounds", "must be at least 1"),
        ({"drop_m": 5.5}, "drop_m", "must be at most 5 m"),
        ({"letter": 6.0}, "letter", "must be a text"),
        ({"letter": "ABK"}, "letter", "must have at most 2 characters"),
        ({"letter": "Z"}, "letter", "must be made of these characters: ABK"),
        ({"colour": "green"}, "colour", "must be one of: red, blue"),
        ({"eye": "up"}, "eye", "must be one of: down"),
        ({"height_m": 3.0, "other": 1.0}, "other", "is no setting of this controller"),
    ],
)
def test_the_first_fault_names_its_setting(given: dict[str, SettingValue], name: str, why: str) -> None:
    assert fault_of(SETTINGS, given) == (name, why)


def test_the_largest_description_of_a_form_fits_into_a_message() -> None:
    largest = tuple(
        ControllerSetting(
            name=f"s{number:02d}".ljust(40, "x"),
            kind=SettingKind.TEXT,
            default="d" * 400,
            label="l" * 60,
            about="a" * 200,
            unit="u" * 12,
            choices=tuple(f"{choice:02d}".ljust(60, "c") for choice in range(MAX_CHOICES)),
            characters="c" * 100,
        )
        for number in range(MAX_SETTINGS)
    )
    described = ControllerDescribed(controller="c" * 40, settings=largest)
    told = encode_message(described)
    assert len(told) < MAX_MESSAGE_BYTES
    assert decode_to_tower(told) == described
