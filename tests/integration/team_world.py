"""A team on a running tower, with an admin, an operator, an observer and a drone."""

from dataclasses import dataclass, field

import httpx
from tower_world import NewDrone, Person, TowerWorld

from server.kernel.relations import TeamRole

OBSERVER, OPERATOR, ADMIN = TeamRole.OBSERVER, TeamRole.OPERATOR, TeamRole.ADMIN


@dataclass
class Team:
    """A team with a drone, and a client for each of its people. Every name begins with the team's own word."""

    world: TowerWorld
    word: str
    id: int = 0
    people: dict[TeamRole, Person] = field(default_factory=dict)
    clients: dict[TeamRole, httpx.AsyncClient] = field(default_factory=dict)
    owner: Person | None = None
    drone: NewDrone | None = None

    async def set_up(self) -> "Team":
        for role in TeamRole:
            self.people[role] = await self.world.add_user(f"{self.word}-{role.value}")
            self.clients[role] = await self.world.signed_in(self.people[role])
        self.drone = await self.world.add_drone(f"{self.word}-drone", self.people[ADMIN])
        made = await self.clients[ADMIN].post("/api/v1/teams", json={"name": f"{self.word}-team"})
        assert made.status_code == 201, made.text
        self.id = made.json()["id"]
        for role in (OBSERVER, OPERATOR):
            await self.join(self.people[role], role)
        added = await self.clients[ADMIN].put(f"/api/v1/teams/{self.id}/drones/{self.drone.id}")
        assert added.status_code == 200, added.text
        return self

    async def join(self, person: Person, role: TeamRole) -> None:
        asked = {"name": person.name.upper(), "role": role.value}
        invited = await self.clients[ADMIN].post(f"/api/v1/teams/{self.id}/invitations", json=asked)
        assert invited.status_code == 201, invited.text
        client = await self.world.signed_in(person)
        (waiting,) = (await client.get("/api/v1/me/invitations")).json()
        joined = await client.post(f"/api/v1/me/invitations/{waiting['id']}/accept")
        assert joined.status_code == 200, joined.text

    @property
    def drone_id(self) -> int:
        assert self.drone is not None
        return self.drone.id

    @property
    def path(self) -> str:
        return f"/api/v1/teams/{self.id}"

    async def set_role(self, who: TeamRole, role: TeamRole) -> httpx.Response:
        member = f"{self.path}/members/{self.people[who].id}"
        return await self.clients[ADMIN].put(member, json={"role": role.value})
