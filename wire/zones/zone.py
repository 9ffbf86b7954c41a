"""A zone: where drones may not be, not above a height, or only. Values alone: the tower checks what is one. Pure."""

from dataclasses import dataclass, field
from datetime import datetime
from math import inf

from wire.zones.area import Area
from wire.zones.kinds import HeightAbove, ZoneKind, ZoneRule


@dataclass(frozen=True, kw_only=True)
class ZoneShape:
    """`points`: latitude and longitude. `width_m`: of a line; None: the corners of an area."""

    points: tuple[tuple[float, float], ...]
    width_m: float | None = None


@dataclass(frozen=True, kw_only=True)
class Zone:
    """`team_id` None: for the whole tower. Heights None: unbounded. Times None: always."""

    id: int
    name: str
    kind: ZoneKind
    rule: ZoneRule
    shape: ZoneShape
    team_id: int | None = None
    floor_m: float | None = None
    ceiling_m: float | None = None
    height_above: HeightAbove = HeightAbove.HOME
    valid_from: datetime | None = None
    valid_until: datetime | None = None
    reason: str = ""
    version: int = 1
    area: Area = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "area", Area(self.shape.points, self.shape.width_m))

    @property
    def is_corridor(self) -> bool:
        return self.kind is ZoneKind.CORRIDOR

    @property
    def binds(self) -> bool:
        """Whether it refuses and holds."""
        return self.rule is ZoneRule.REFUSE

    @property
    def heights_m(self) -> tuple[float, float]:
        """What is forbidden, or in a corridor allowed, from and to."""
        floor = -inf if self.floor_m is None else self.floor_m
        ceiling = inf if self.ceiling_m is None else self.ceiling_m
        return (ceiling, inf) if self.kind is ZoneKind.HEIGHT_LIMIT else (floor, ceiling)

    def is_valid_at(self, at: datetime) -> bool:
        return (self.valid_from is None or self.valid_from <= at) and (
            self.valid_until is None or at < self.valid_until
        )

    @property
    def words(self) -> str:
        """As in a sentence: "the no-fly zone Airport"."""
        what = {
            ZoneKind.NO_FLY: "the no-fly zone",
            ZoneKind.HEIGHT_LIMIT: f"the zone with at most {self.ceiling_m or 0:.0f} m,",
            ZoneKind.CORRIDOR: "the corridor",
        }[self.kind]
        return f"{what} {self.name}"
