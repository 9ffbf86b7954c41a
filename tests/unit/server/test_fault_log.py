"""Errors that the hub survived are counted, and remembered for ten minutes."""

from server.link.api.fault_log import FaultLog
from server.link.core.traffic import Traffic


def test_the_part_with_the_most_errors_of_the_last_ten_minutes() -> None:
    now = [0.0]
    traffic = Traffic()
    log = FaultLog(traffic, lambda: now[0])
    assert log.worst() is None
    log.note("alerts", None, ValueError("a latitude"))
    now[0] = 400.0
    log.note("zones", None, ValueError("a zone"))
    log.note("alerts", None, ValueError("a latitude"))
    assert log.worst() == ("alerts", 2)
    now[0] = 700.0
    log.note("zones", None, ValueError("a zone"))
    assert log.worst() == ("zones", 2)
    now[0] = 1301.0
    assert log.worst() is None
    assert traffic.faults == {"alerts": 2, "zones": 2}
