"""Which messages an agent is sent: every one is assigned, and only those of its groups pass."""

import json
from typing import get_args

import pytest
from worlds.example_messages import examples

from wire.agent_update import AGENT_UPDATE, AgentUpdateWork
from wire.control_messages import (
    ControlChanged,
    HoldOrder,
    ResumeChallenge,
    Resumed,
    SafetySettings,
    SignInChallenge,
    StreamSettings,
    ToAgent,
    Welcome,
    decode_to_agent,
)
from wire.controllers import CONTROLLERS, ControllerWork
from wire.following import FOLLOW, FollowWork
from wire.negotiation import GROUPS, understands, version_of
from wire.parameter_metadata import PARAMETER_METADATA
from wire.signing_key import SIGNING, SigningWork
from wire.transactions import TRANSACTIONS, Transaction

OF_EVERY_AGENT = {
    SignInChallenge,
    Welcome,
    ResumeChallenge,
    Resumed,
    ControlChanged,
    HoldOrder,
    SafetySettings,
    StreamSettings,
}
"""What agents understood before there were groups. This set never grows: a new message needs a group."""

MESSAGES = [decode_to_agent(json.dumps(one)) for one in examples(ToAgent)]
OF_WORK = {FollowWork: FOLLOW, AgentUpdateWork: AGENT_UPDATE, ControllerWork: CONTROLLERS, SigningWork: SIGNING}
EVERY_GROUP = frozenset({*GROUPS.values(), *OF_WORK.values()})


def test_every_message_to_an_agent_is_of_every_agent_or_of_a_group() -> None:
    assert set(get_args(ToAgent)) == OF_EVERY_AGENT | GROUPS.keys()
    assert not OF_EVERY_AGENT & GROUPS.keys()


@pytest.mark.parametrize("missing", sorted(EVERY_GROUP))
def test_a_message_passes_only_with_its_group(missing: str) -> None:
    for message in MESSAGES:
        group = GROUPS.get(type(message))
        needed = {group, OF_WORK.get(type(message.work)) if isinstance(message, Transaction) else None}
        assert understands(EVERY_GROUP - {missing}, message) is (missing not in needed), message
        assert understands(EVERY_GROUP, message)


def test_an_agent_without_groups_gets_what_every_agent_understands() -> None:
    assert {type(one) for one in MESSAGES if understands((), one)} == OF_EVERY_AGENT
    assert {PARAMETER_METADATA, TRANSACTIONS} <= EVERY_GROUP


@pytest.mark.parametrize("version", ["0.2.0", "0.3.0.dev0", "1.0rc1", "1.2.3+local.7", "1.2.3~dev0"])
def test_versions(version: str) -> None:
    assert version_of(version) == version


@pytest.mark.parametrize("other", ["", "-1", "0.2.0\n", "0.2 0", "<b>", 'a"b', "1" * 41, "é"])
def test_what_is_no_version_is_not_shown(other: str) -> None:
    assert version_of(other) is None
