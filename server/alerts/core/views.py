"""How an alert looks from outside, in REST answers and live messages alike."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from server.alerts.core.alert import Alert
from server.alerts.core.rules import RANK, RULES, Rule
from server.alerts.core.severity import Severity
from server.fleet.core.views import UserRefView


class AlertView(BaseModel):
    """An alert. It is open until `closed_at`."""

    model_config = ConfigDict(frozen=True)

    id: Annotated[int, Field(description="Random")]
    rule: Annotated[str, Field(description="The name of its rule", examples=["link-lost"])]
    severity: Severity
    badge: Annotated[str, Field(description="A few words for a row")]
    words: Annotated[str, Field(description="What is wrong, naming the drone")]
    advice: Annotated[str, Field(description="What to do")]
    rank: Annotated[int, Field(description="Of its rule: smaller is more urgent")]
    drone_id: Annotated[int | None, Field(description="None: it is about the tower itself, for admins")]
    other_id: Annotated[int | None, Field(description="The second drone of a pair, if you may see it")]
    opened_at: datetime
    acknowledged_at: datetime | None
    acknowledged_by: UserRefView | None
    closed_at: datetime | None
    closed_why: Annotated[str, Field(description="Why it was closed though nobody saw that it is over; else empty")]

    @classmethod
    def of(cls, alert: Alert) -> AlertView:
        by = alert.acknowledged_by
        return cls(
            id=alert.id,
            rule=alert.rule.name,
            severity=alert.rule.severity,
            badge=alert.rule.badge,
            words=alert.words,
            advice=alert.rule.advice,
            rank=RANK[alert.rule.name],
            drone_id=alert.drone_id,
            other_id=None if alert.about_stranger else alert.other_id,
            opened_at=alert.opened_at,
            acknowledged_at=alert.acknowledged_at,
            acknowledged_by=UserRefView.of(by) if by else None,
            closed_at=alert.closed_at,
            closed_why=alert.closed_why,
        )


class AlertRuleView(BaseModel):
    """A row of the table of rules."""

    name: str
    severity: Severity
    badge: str
    when: Annotated[str, Field(description="The condition")]
    advice: Annotated[str, Field(description="What to do")]
    opens_after_s: Annotated[float, Field(description="How long the condition must last")]
    closes_after_s: Annotated[float, Field(description="How long it must be over")]

    @classmethod
    def of(cls, rule: Rule) -> AlertRuleView:
        return cls.model_validate(rule, from_attributes=True)


ALL_RULES: Final = [AlertRuleView.of(rule) for rule in RULES]
"""The most urgent first."""
