"""A model of two towers that share a database and a bus: the bus loses, repeats, delays and reorders, towers freeze and
die at any step, agents move from one to the other, people are connected to either or to both. All parts are real but
the database, the bus and the wires.

Invariants at every step:
- The sticks of two people never reach an autopilot in one epoch, and only those of its holder and assistant do.
- Epochs at the autopilot never go back, whichever tower its agent is linked to: who was taken from never flies again.
- While a drone's agent has linked and the database has not confirmed its home, that tower passes no sticks.
- A TAKE that is answered over the bus was fenced and its hold ordered (in `model_towers`).
Once everything has settled, each drone has one home, which knows its lease, and every TAKE has become a hold on board.
"""

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from two_towers import ALICE, BOB, EVERYBODY, ONE, ROOT, TOOR, TWO, A, B, TwoTowers
from worlds.tiers import examples

from server.control.core.lease import Event
from server.towers.core.place import Place
from wire.ids import DroneId, LinkId, UserId

MAX_CONCURRENT = 4

operators = st.sampled_from([ALICE, BOB])
admins = st.sampled_from([ROOT, TOOR])
drones = st.sampled_from([ONE, ONE, ONE, TWO])
places = st.sampled_from([A, B])
parts = st.sampled_from(["holder", "holder", "assistant", "taken_from"])
operator_events = st.sampled_from([Event.ACQUIRE, Event.ACQUIRE, Event.ACCEPT, Event.RELEASE])
admin_events = st.sampled_from([Event.TAKE, Event.TAKE, Event.GIVE, Event.ASSIST, Event.ASSIST_END, Event.RELEASE])
numbers = st.integers(0, 20)


class TwoTowersModel(RuleBasedStateMachine, TwoTowers):
    """Rules are the actions of people, networks, the bus and power cuts."""

    def __init__(self) -> None:
        RuleBasedStateMachine.__init__(self)
        TwoTowers.__init__(self)

    @initialize(
        asked=st.sampled_from(
            [
                (),
                ((B, ALICE, Event.ACQUIRE),),
                ((B, ALICE, Event.ACQUIRE), (A, ROOT, Event.ASSIST)),
                ((A, ALICE, Event.ACQUIRE), (B, ROOT, Event.TAKE)),
                ((B, ALICE, Event.ACQUIRE), (B, ROOT, Event.TAKE), (A, ROOT, Event.GIVE)),
            ]
        )
    )
    def everybody_comes(self, asked: tuple[tuple[int, UserId, Event], ...]) -> None:
        self._meet()
        for number in (A, B):
            for user_id in EVERYBODY:
                self.towers[number].open_browser(user_id)
        self.connect(ONE, A, noticed=True)
        self.connect(TWO, B, noticed=True)
        self.everything_settles()
        for number, user_id, event in asked:
            self.asks(number, user_id, ONE, event, at_once=True)

    # -- people ----------------------------------------------------------------------------------------------

    @rule(number=places, user_id=operators, drone_id=drones, event=operator_events, at_once=st.booleans())
    def operator_asks(self, number: int, user_id: UserId, drone_id: DroneId, event: Event, at_once: bool) -> None:
        self.asks(number, user_id, drone_id, event, at_once=at_once)

    @rule(number=places, user_id=admins, drone_id=drones, event=admin_events, at_once=st.booleans())
    def admin_asks(self, number: int, user_id: UserId, drone_id: DroneId, event: Event, at_once: bool) -> None:
        self.asks(number, user_id, drone_id, event, at_once=at_once)

    def asks(self, number: int, user_id: UserId, drone_id: DroneId, event: Event, *, at_once: bool) -> None:
        if self.frozen[number] or len(self.towers[number].running) >= MAX_CONCURRENT:
            return
        self.towers[number].open_browser(user_id)
        self.towers[number].ask(user_id, drone_id, event, watch=True)
        if at_once:
            self.everything_settles()

    @rule(number=places, part=parts, drone_id=drones, arrives=st.booleans())
    def sticks(self, number: int, part: str, drone_id: DroneId, arrives: bool) -> None:
        user_id = getattr(self.store.leases[drone_id], part)
        if user_id is not None:
            self.sticks_of(number, user_id, drone_id)
        if arrives:
            self.bus_delivers_all()
            self.everything_arrives()

    @rule(number=places, user_id=st.sampled_from(EVERYBODY), drone_id=drones)
    def sticks_of(self, number: int, user_id: UserId, drone_id: DroneId) -> None:
        if self._runs(number):
            self.towers[number].send_sticks(user_id, drone_id, centred=True)

    @rule(number=places, user_id=st.sampled_from(EVERYBODY), what=st.sampled_from(["comes", "goes", "signs out"]))
    def browser(self, number: int, user_id: UserId, what: str) -> None:
        if not self._runs(number):
            return
        tower = self.towers[number]
        {"comes": tower.open_browser, "goes": tower.close_browser, "signs out": tower.sign_out}[what](user_id)
        tower.flush()

    @rule(what=st.sampled_from(["disabled", "no owner", "as usual", "as usual"]), read_by=st.sampled_from([A, B, None]))
    def rights_of_alice_change(self, what: str, read_by: int | None) -> None:
        """`read_by`: the tower that learns of it now; both if None."""
        account = self.store.accounts[ALICE]
        account.disabled = what == "disabled"
        (account.owns.discard if what == "no owner" else account.owns.add)(ONE)
        self.store.revision += 1
        for number in (A, B) if read_by is None else (read_by,):
            if self._runs(number):
                self.towers[number].read_fleet()

    # -- the database ----------------------------------------------------------------------------------------

    @rule(number=places, which=numbers)
    def database_answers(self, number: int, which: int) -> None:
        if self._runs(number):
            self.towers[number].step(which)

    @rule(number=places)
    def event_handler_works(self, number: int) -> None:
        if self._runs(number):
            self.towers[number].see_to_next_event()

    @rule(number=places)
    def homes_are_read(self, number: int) -> None:
        if self._runs(number):
            self.towers[number].learn()
            self.towers[number].check_links()

    @rule()
    def everything_settles(self) -> None:
        for _ in range(3):
            for number in (A, B):
                if self._runs(number):
                    self.towers[number].settle()
            self.bus_delivers_all()
            self.everything_arrives()

    # -- the bus ---------------------------------------------------------------------------------------------

    @precondition(lambda self: self.bus.on_the_way)
    @rule(number=numbers, again=st.booleans())
    def bus_delivers(self, number: int, again: bool) -> None:
        place = number % len(self.bus.on_the_way)
        to, packet = self.bus.on_the_way[place]
        if not again:
            del self.bus.on_the_way[place]
        self._deliver(to, packet)

    @precondition(lambda self: self.bus.on_the_way)
    @rule(number=numbers)
    def bus_loses(self, number: int) -> None:
        del self.bus.on_the_way[number % len(self.bus.on_the_way)]

    @rule()
    def bus_delivers_all(self) -> None:
        self._deliver_all()

    # -- the network, time ----------------------------------------------------------------------------------

    @precondition(lambda self: self.network)
    @rule(number=numbers, again=st.booleans())
    def datagram_arrives(self, number: int, again: bool) -> None:
        place = number % len(self.network)
        drone_id, datagram = self.network[place]
        if not again:
            del self.network[place]
        self.agents[drone_id].datagram(datagram, self.now)

    @rule(drone_id=drones, count=st.integers(1, 8))
    def control_messages(self, drone_id: DroneId, count: int) -> None:
        number = self.at[drone_id]
        if number is not None:
            for _ in range(count):
                self.agents[drone_id].next_control_message(self.towers[number].hub, self.now)

    @rule()
    def everything_arrives(self) -> None:
        for drone_id in self.agents:
            self.control_messages(drone_id, 1000)
        while self.network:
            drone_id, datagram = self.network.popleft()
            self.agents[drone_id].datagram(datagram, self.now)

    @rule(seconds=st.sampled_from([0.02, 0.1, 0.1, 0.4, 0.6, 1.1, 2.5, 31.0, 61.0]))
    def time_passes(self, seconds: float) -> None:
        self._time_passes(seconds)

    # -- links, deaths ---------------------------------------------------------------------------------------

    @rule(drone_id=drones, number=places, noticed=st.booleans())
    def connect(self, drone_id: DroneId, number: int, noticed: bool) -> None:
        """The agent links to this tower. `noticed`: by its former tower."""
        if not self._runs(number):
            return
        agent, before = self.agents[drone_id], self.at[drone_id]
        if noticed and before is not None and self._runs(before):
            agent.disconnect(self.towers[before].hub, self.now)
        self.links += 1
        self.at[drone_id] = number
        agent.connect(self.towers[number].hub, LinkId(self.links), self.network, self.now)
        self._check_the_fence(drone_id, self.towers[number])
        self.towers[number].flush()

    @rule(drone_id=drones, number=places)
    def agent_moves_and_flies(self, drone_id: DroneId, number: int) -> None:
        """A shortcut to a state that chance rarely reaches."""
        self.connect(drone_id, number, noticed=False)
        self.control_messages(drone_id, 1000)
        for place in (A, B):
            self.sticks(place, "taken_from", drone_id, arrives=True)
            self.sticks(place, "holder", drone_id, arrives=True)

    @rule(drone_id=drones, claim_is_under_way=st.booleans(), told=st.booleans())
    def agent_is_taken_elsewhere_and_comes_back(self, drone_id: DroneId, claim_is_under_way: bool, told: bool) -> None:
        """A shortcut, as above. `told`: the bus has not lost what the towers say."""
        here = self.at[drone_id]
        if here is None or not (self._runs(A) and self._runs(B)):
            return
        there = 1 - here
        if claim_is_under_way:
            self.connect(drone_id, here, noticed=False)
            self.towers[here].step(len(self.towers[here].running) - 1)
        self.connect(drone_id, there, noticed=False)
        self.control_messages(drone_id, 1000)
        self.towers[there].settle()
        self.towers[there].open_browser(TOOR)
        self.towers[there].ask(TOOR, drone_id, Event.TAKE, watch=True)
        self.towers[there].settle()
        self.sticks_of(there, TOOR, drone_id)
        self.everything_arrives()
        if told:
            self.bus_delivers_all()
        self.bus.on_the_way.clear()
        self.connect(drone_id, here, noticed=False)
        self.control_messages(drone_id, 1000)
        for _ in range(3):
            for user_id in EVERYBODY:
                self.sticks_of(here, user_id, drone_id)
            self.everything_arrives()
            self.one_person_flies_in_one_epoch_and_has_a_right_to()
            self.towers[here].step(0)

    @rule(number=places)
    def tower_freezes(self, number: int) -> None:
        if not self.frozen[1 - number]:
            self.frozen[number] = True

    @rule(number=places, declared_dead=st.booleans())
    def tower_thaws(self, number: int, declared_dead: bool) -> None:
        """One that was declared dead meanwhile ends at once (`may_act`)."""
        if not self.frozen[number]:
            return
        self.frozen[number] = False
        if declared_dead:
            self.tower_dies(number)

    @rule(number=places)
    def tower_dies(self, number: int) -> None:
        """kill -9, and it is started again."""
        self._note_who_flew()
        dead = self.towers[number]
        dead.die()
        self.frozen[number] = False
        for drone_id, agent in self.agents.items():
            if self.at[drone_id] == number:
                agent.disconnect(None, self.now)
                self.at[drone_id] = None
        self.store.members.remove(dead.name)
        self.towers[number] = self._new_tower()
        for tower in self.towers:
            if not self._is_frozen(tower.name):
                tower.set_members()

    # -- invariants ------------------------------------------------------------------------------------------

    @invariant()
    def one_person_flies_in_one_epoch_and_has_a_right_to(self) -> None:
        self._note_who_flew()
        for (drone_id, epoch), who in self.flown.items():
            assert len(who) == 1, f"in epoch {epoch} of drone {drone_id} the sticks of {who} passed"
            lease = self.store.history[drone_id, epoch]
            assert who <= {lease.holder, lease.assistant}, f"{who} flew drone {drone_id} under {lease}"

    @invariant()
    def an_operator_holds_one_drone_at_most(self) -> None:
        for operator in (ALICE, BOB):
            assert sum(lease.holder == operator for lease in self.store.leases.values()) <= 1

    def teardown(self) -> None:
        self.one_person_flies_in_one_epoch_and_has_a_right_to()
        self.frozen = [False, False]
        self.bus.on_the_way.clear()
        self._meet()
        for number in (A, B):
            self.towers[number].read_fleet()
        for _ in range(5):
            for drone_id, agent in self.agents.items():
                number = self.at[drone_id]
                if number is None or not agent.is_linked_to(self.towers[number].hub):
                    self.connect(drone_id, A, noticed=False)
            self.everything_settles()
            for tower in self.towers:
                tower.learn()
                tower.check_links()
            self._time_passes(0.1)
        self.everything_settles()
        self.one_person_flies_in_one_epoch_and_has_a_right_to()
        for drone_id, agent in self.agents.items():
            number = self.at[drone_id]
            assert number is not None
            home, other = self.towers[number], self.towers[1 - number]
            mine, theirs = (one.hub.state.drones[drone_id] for one in (home, other))
            assert self.store.homes[drone_id][0] == home.name, "the home is where the agent is"
            assert (mine.place, theirs.place) == (Place.HERE, Place.ELSEWHERE)
            assert mine.lease.epoch == self.store.leases[drone_id].epoch
            assert not mine.fenced
            assert agent.onboard.downlink.epoch == mine.lease.epoch
            assert agent.held_at >= self.store.takes.get(drone_id, 0), "a TAKE without a hold on board"


TwoTowersModel.TestCase.settings = settings(
    max_examples=examples(60, long=300),
    stateful_step_count=50,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestTwoTowers = TwoTowersModel.TestCase
