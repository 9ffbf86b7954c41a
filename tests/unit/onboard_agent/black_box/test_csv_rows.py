"""A flight as a table."""

from frames_of_flight import attitude, battery, heartbeat, position, sticks

from onboard_agent.black_box.csv_rows import HEADER, CsvRows, clock_offset_us

COLUMNS = HEADER.strip().split(",")


def test_a_row_has_the_newest_of_everything() -> None:
    rows = CsvRows()
    for frame in (heartbeat(), position(), battery(), sticks()):
        assert rows.take(1_000_000, frame) == ""
    values = rows.take(2_000_000, attitude(1)).strip().split(",")
    assert len(values) == len(COLUMNS)
    row = dict(zip(COLUMNS, values, strict=True))
    assert (row["time_s"], row["roll_deg"], row["yaw_rate_deg_s"]) == ("2.0000", "5.730", "34.377")
    assert (row["lat_deg"], row["alt_rel_m"], row["east_m_s"]) == ("52.0000000", "20.000", "-2.00")
    assert (row["stick_x"], row["stick_y"], row["battery_v"], row["battery_percent"]) == ("100", "-200", "15.800", "71")
    assert (row["mode"], row["armed"], row["rc1"]) == ("LOITER", "1", "")


def test_two_attitudes_of_one_moment_are_one_row() -> None:
    rows = CsvRows()
    made = [rows.take(1_000_000 + number * 2_500, attitude(number // 4)) for number in range(400)]
    assert sum(bool(one) for one in made) == 100


def test_rows_have_the_time_of_the_autopilot_on_this_computers_clock() -> None:
    """Frames that come late, in heaps, are no reason to move or leave out a row. A reboot begins anew."""
    entries = [(5_000_000 + 40_000 * (number // 4), attitude(1000 + number)) for number in range(50)]
    offset_us = clock_offset_us(entries)
    rows = CsvRows(offset_us)
    times = [float(rows.take(at_us, frame).split(",")[0]) for at_us, frame in entries]
    assert [round(1000 * (one - times[0])) for one in times] == [10 * number for number in range(50)]
    assert all(one <= at_us / 1e6 + 1e-4 for one, (at_us, _) in zip(times, entries, strict=True))
    assert rows.take(9_000_000, attitude(50)).startswith("9.0000,")
    assert clock_offset_us([(1, heartbeat())]) is None


def test_nothing_known_leaves_the_columns_empty() -> None:
    values = CsvRows().take(1_000_000, attitude(1)).strip().split(",")
    assert len(values) == len(COLUMNS)
    assert not any(values[7:])
