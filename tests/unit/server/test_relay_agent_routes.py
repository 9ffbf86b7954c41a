"""Where the tower sends to an agent: the newest address, uplinks while they send, the WebSocket."""

from server.link.core.agent_routes import MAX_UPLINKS, OVER_CHANNEL, UPLINK_SILENT_S, AgentRoutes

WIFI, CELL, MOVED = ("192.0.2.1", 1), ("198.51.100.2", 2), ("203.0.113.3", 3)


def test_nowhere_before_anything_came() -> None:
    assert AgentRoutes().targets == ()


def test_one_uplink_is_followed() -> None:
    routes = AgentRoutes()
    routes.follow(WIFI)
    assert routes.targets == (WIFI,)
    routes.follow(MOVED)
    assert (routes.targets, routes.count) == ((MOVED,), 1)
    assert not routes.may_be_copy(MOVED)


def test_two_uplinks_are_both_used_each_once_until_one_is_silent() -> None:
    routes = AgentRoutes()
    routes.follow(WIFI)
    routes.uplink(0, WIFI, 1.0)
    routes.uplink(1, CELL, 1.1)
    assert (set(routes.targets), routes.count) == ({WIFI, CELL}, 2)
    assert routes.may_be_copy(WIFI) and routes.may_be_copy(CELL) and not routes.may_be_copy(MOVED)
    routes.follow(CELL)
    routes.uplink(1, CELL, 1.0 + UPLINK_SILENT_S)
    routes.forget_silent(1.01 + UPLINK_SILENT_S)
    assert (routes.targets, routes.count) == ((CELL,), 1)


def test_an_uplink_that_moves_is_followed_and_its_old_address_forgotten() -> None:
    routes = AgentRoutes()
    routes.follow(WIFI)
    routes.uplink(0, WIFI, 1.0)
    routes.uplink(1, CELL, 1.0)
    routes.follow(MOVED)
    assert set(routes.targets) == {MOVED, WIFI, CELL}
    routes.uplink(0, MOVED, 1.2)
    assert set(routes.targets) == {MOVED, CELL}


def test_over_the_websocket_there_is_one_way() -> None:
    routes = AgentRoutes()
    routes.uplink(0, WIFI, 1.0)
    routes.uplink(1, CELL, 1.0)
    routes.follow(OVER_CHANNEL)
    assert routes.targets == (OVER_CHANNEL,)
    assert routes.may_be_copy(OVER_CHANNEL) and routes.may_be_copy(MOVED)
    routes.follow(WIFI)
    assert set(routes.targets) == {WIFI, CELL}


def test_an_agent_has_a_bounded_number_of_uplinks_whatever_it_says() -> None:
    routes = AgentRoutes()
    routes.follow(WIFI)
    for number in range(200):
        routes.uplink(number, ("192.0.2.9", number), 1.0)
    assert len(routes.targets) == 1 + MAX_UPLINKS
