"""Servos on PWM pins: settings, pulses, and every byte that a kernel would read."""

import errno
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.payload.servo import Servo, Write, parse_servos
from onboard_agent.payload.servo_commands import ServoCommands
from onboard_agent.payload.sysfs_pwm import SysfsPwm
from onboard_agent.unusable import Unusable
from wire.dialect import build, decode, mavlink

GRIPPER = Servo(15, 0, 1, low_us=1000, high_us=2000)


class Kernel(SysfsPwm):
    """What pwm/sysfs.c and pwm_apply_state() do with the writes."""

    def __init__(self, *, exported: bool = False, period: int = 0, duty: int = 0, udev_after: int = 0) -> None:
        super().__init__()
        self.writes: list[Write] = []
        self.exported, self.values = exported, {"period": period, "duty_cycle": duty, "enable": 0}
        self.udev_after = udev_after
        """Writes to the channel's files that are refused until udev has given them away."""

    def _write(self, write: Write) -> None:
        path, data = write
        folder, _, name = path.rpartition("/")
        if name == "export":
            assert (folder, data) == ("pwmchip0", b"1")
            if self.exported:
                raise OSError(errno.EBUSY, "busy")
            self.exported = True
        elif name == "unexport":
            self.exported = False
        else:
            assert folder == "pwmchip0/pwm1"
            if not self.exported:
                raise FileNotFoundError(errno.ENOENT, "no file")
            if self.udev_after > 0:
                self.udev_after -= 1
                raise PermissionError(errno.EACCES, "denied")
            after = self.values | {name: int(data)}
            if not after["period"] or after["duty_cycle"] > after["period"]:
                raise OSError(errno.EINVAL, "invalid")
            self.values = after
        self.writes.append(write)


def test_every_write_in_its_order() -> None:
    kernel = Kernel()
    kernel.move(GRIPPER, 1900)
    kernel.move(GRIPPER, 1000.4)
    kernel.close()
    assert kernel.writes == [
        ("pwmchip0/export", b"1"),
        ("pwmchip0/pwm1/period", b"20000000"),
        ("pwmchip0/pwm1/duty_cycle", b"1900000"),
        ("pwmchip0/pwm1/enable", b"1"),
        ("pwmchip0/pwm1/duty_cycle", b"1000400"),
        ("pwmchip0/pwm1/enable", b"1"),
        ("pwmchip0/pwm1/enable", b"0"),
        ("pwmchip0/unexport", b"1"),
    ]
    assert not kernel.exported


def test_a_pin_that_was_left_with_a_longer_pulse() -> None:
    kernel = Kernel(exported=True, period=50_000_000, duty=40_000_000)
    kernel.move(GRIPPER, 1500)
    assert kernel.values == {"period": 20_000_000, "duty_cycle": 1_500_000, "enable": 1}
    assert next(write for write in kernel.writes if write[0].endswith("duty_cycle"))[1] == b"0"


def test_files_that_udev_gives_away_later() -> None:
    kernel = Kernel(udev_after=1)
    with pytest.raises(PermissionError):
        kernel.move(GRIPPER, 1500)
    kernel.move(GRIPPER, 1500)
    assert kernel.values["duty_cycle"] == 1_500_000


def test_real_files(tmp_path: Path) -> None:
    channel = tmp_path / "pwmchip0" / "pwm1"
    channel.mkdir(parents=True)
    for path in (tmp_path / "pwmchip0" / "export", *(channel / name for name in ("period", "duty_cycle", "enable"))):
        path.touch()
    SysfsPwm(tmp_path).move(GRIPPER, 1234)
    assert (tmp_path / "pwmchip0" / "export").read_bytes() == b"1"
    assert [(channel / name).read_bytes() for name in ("period", "duty_cycle", "enable")] == [
        b"20000000",
        b"1234000",
        b"1",
    ]
    with pytest.raises(FileNotFoundError):
        SysfsPwm(tmp_path).move(Servo(15, 7, 1), 1234)
    assert not (tmp_path / "pwmchip7").exists(), "nothing is created"


@given(st.floats(-45, 45))
def test_angles_are_pulses(angle_deg: float) -> None:
    pulse_us = GRIPPER.pulse_of(angle_deg)
    assert GRIPPER.takes(pulse_us)
    assert (pulse_us - 1500) / 500 * 45 == pytest.approx(angle_deg, abs=1e-6)


def test_angles_beyond_its_range() -> None:
    assert (GRIPPER.pulse_of(-45), GRIPPER.pulse_of(0), GRIPPER.pulse_of(45)) == (1000, 1500, 2000)
    for angle_deg in (45.1, -90, float("nan")):
        with pytest.raises(ValueError, match="45 degrees"):
            GRIPPER.pulse_of(angle_deg)
    with pytest.raises(ValueError, match="1000 to 2000"):
        GRIPPER.move(2001)


def test_settings() -> None:
    assert parse_servos(["15=pwmchip0/1"]) == (GRIPPER,)
    assert parse_servos(["9=pwmchip2/0?min=500&max=2500&range=180&period=3333,10=pwmchip2/1"]) == (
        Servo(9, 2, 0, 500, 2500, 180.0, 3333),
        Servo(10, 2, 1),
    )


@pytest.mark.parametrize(
    "text",
    [
        "15",
        "15=pwm0/1",
        "15=pwmchip0/1?min=2000&max=1000",
        "15=pwmchip0/1?max=9000",
        "15=pwmchip0/1?min=x",
        "15=pwmchip0/1?period=100",
        "15=pwmchip0/1?range=nan",
        "15=pwmchip0/1?speed=1",
        "15=pwmchip0/1,15=pwmchip0/2",
        "15=pwmchip0/1,16=pwmchip0/1",
        "15=pwmchip0/../1",
    ],
)
def test_settings_that_cannot_be(text: str) -> None:
    with pytest.raises(Unusable, match="servos"):
        parse_servos([text])


def command(number: float, pulse_us: float, command: int = 183, target: int = 1) -> bytes:
    message = mavlink.MAVLink_command_long_message(target, 1, command, 0, number, pulse_us, 0, 0, 0, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


def test_commands_move_it_and_are_answered() -> None:
    moved: list[tuple[Servo, float]] = []
    commands = ServoCommands((GRIPPER,), lambda servo, pulse_us: moved.append((servo, pulse_us)))
    answer = commands.take(command(15, 1900), 1)
    assert answer is not None
    ack = decode(answer)
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (183, 0, 255, 190)
    assert (ack.get_srcSystem(), ack.get_srcComponent()) == (1, 1)
    assert moved == [(GRIPPER, 1900.0)]


@pytest.mark.parametrize(
    "frame",
    [
        command(9, 1900),
        command(15, 1900, command=184),
        command(15, 1900, target=7),
        command(15.5, 1900),
        build(mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0), system_id=255, component_id=190, sequence=0),
    ],
)
def test_what_is_the_autopilots_passes(frame: bytes) -> None:
    commands = ServoCommands((GRIPPER,), lambda servo, pulse_us: pytest.fail("moved"))
    assert commands.take(frame, 1) is None


def test_refusals_and_failures_are_answered() -> None:
    def broken(servo: Servo, pulse_us: float) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    commands = ServoCommands((GRIPPER,), broken)
    for pulse_us, result in ((900, mavlink.MAV_RESULT_DENIED), (float("nan"), 2), (1500, mavlink.MAV_RESULT_FAILED)):
        answer = commands.take(command(15, pulse_us), 1)
        assert answer is not None
        assert decode(answer).result == result
        assert "servo 15" in commands.failure
