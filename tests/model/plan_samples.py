"""Missions distinguished by their heights."""

from __future__ import annotations

from wire.plans import Plan, PlanItem


def mission(count: int, height_m: float) -> Plan:
    """Returns a take-off and way-points at a height that identifies the plan."""
    there = tuple(
        PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473_978_420 + 400 * n, 85_456_940, height_m) for n in range(count)
    )
    return (PlanItem(22, 3, z=height_m), *there)


OLD, NEW, THIRD = mission(3, 20.0), mission(5, 40.0), mission(4, 60.0)
