import { beforeEach, describe, expect, it } from 'vitest';

import { Commands, outcomeWords, type Outcome } from '../../src/link/commands';
import { MAV_CMD, MAV_RESULT } from '../../src/link/generated/mavlink.gen';
import { decode } from '../../src/link/mavlink';
import { armCommand, goToCommand, takeOffCommand, type Command } from '../../src/link/messages';
import { FakeClock, fromAutopilot, settled } from './fakes';

let clock: FakeClock;
let sent: [Command, number][];
let connected: boolean;
let commands: Commands;

beforeEach(() => {
  clock = new FakeClock();
  sent = [];
  connected = true;
  commands = new Commands(clock, (command, repeat) => {
    if (connected) sent.push([command, repeat]);
    return connected;
  });
});

function ack(command: number, result: number): void {
  commands.receive(decode(fromAutopilot('COMMAND_ACK', { command, result }))!);
}

function watch(promise: Promise<Outcome>): { outcome: Outcome | null } {
  const seen: { outcome: Outcome | null } = { outcome: null };
  void promise.then((outcome) => (seen.outcome = outcome));
  return seen;
}

const ARM = MAV_CMD.COMPONENT_ARM_DISARM;

describe('a command', () => {
  it('is done when the autopilot accepts it', async () => {
    const seen = watch(commands.run(armCommand()));
    ack(MAV_CMD.NAV_TAKEOFF, MAV_RESULT.ACCEPTED);
    await settled();
    expect(seen.outcome).toBeNull();
    ack(ARM, MAV_RESULT.ACCEPTED);
    await settled();
    expect(seen.outcome).toEqual({ kind: 'accepted' });
    expect(clock.waiting).toBe(0);
  });

  it('is repeated once, with the repeat counted, then given up', async () => {
    const seen = watch(commands.run(armCommand()));
    await clock.pass(2_999);
    expect(sent.map(([, repeat]) => repeat)).toEqual([0]);
    await clock.pass(1);
    expect(sent.map(([, repeat]) => repeat)).toEqual([0, 1]);
    await clock.pass(2_999);
    expect(seen.outcome).toBeNull();
    await clock.pass(1);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
    expect(sent).toHaveLength(2);
  });

  it('to take off is never repeated', async () => {
    const seen = watch(commands.run(takeOffCommand(10)));
    await clock.pass(3_000);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
    expect(sent).toHaveLength(1);
  });

  it('in progress may take longer, and is not repeated', async () => {
    const seen = watch(commands.run(armCommand()));
    await clock.pass(1_000);
    ack(ARM, MAV_RESULT.IN_PROGRESS);
    await clock.pass(15_000);
    expect(seen.outcome).toBeNull();
    expect(sent).toHaveLength(1);
    ack(ARM, MAV_RESULT.ACCEPTED);
    await settled();
    expect(seen.outcome).toEqual({ kind: 'accepted' });
  });

  it('in progress for ever ends all the same', async () => {
    const seen = watch(commands.run(armCommand()));
    ack(ARM, MAV_RESULT.IN_PROGRESS);
    await clock.pass(20_000);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
  });

  it('is not sent, and not kept, without a connection', async () => {
    connected = false;
    expect(await commands.run(armCommand())).toMatchObject({ kind: 'failed' });
    connected = true;
    await clock.pass(30_000);
    expect(sent).toEqual([]);
  });

  it('does not run twice at once: the answers could not be told apart', async () => {
    const seen = watch(commands.run(armCommand()));
    expect(await commands.run(armCommand())).toMatchObject({ kind: 'failed' });
    expect(sent).toHaveLength(1);
    ack(ARM, MAV_RESULT.FAILED);
    await settled();
    expect(seen.outcome).toEqual({ kind: 'refused', result: MAV_RESULT.FAILED });
  });

  it('is aborted with the reason', async () => {
    const seen = [watch(commands.run(armCommand())), watch(commands.run(takeOffCommand(5)))];
    commands.abort('the controls were taken');
    await settled();
    for (const { outcome } of seen) expect(outcome).toEqual({ kind: 'failed', why: 'the controls were taken' });
    expect(clock.waiting).toBe(0);
  });
});

describe('words', () => {
  const kinds: Outcome[] = [
    { kind: 'accepted' },
    { kind: 'no-answer' },
    { kind: 'unconfirmed', detail: 'its heartbeat disagrees' },
    { kind: 'failed', why: 'offline' },
    ...[1, 2, 3, 4, 6, 7, 8, 9, 10, 99].map((result): Outcome => ({ kind: 'refused', result })),
  ];
  it.each(kinds)('of $kind $result name the drone', (outcome) => {
    expect(outcomeWords('Heron', outcome)).toMatch(/^Heron/);
  });
  it('differ for each result', () => {
    expect(new Set(kinds.map((outcome) => outcomeWords('Heron', outcome))).size).toBe(kinds.length);
  });
});

describe('go-to', () => {
  it('is a COMMAND_INT reposition above home that changes the mode', () => {
    const { form, fields } = goToCommand({ latDeg: 47.1234567, lonDeg: -8.7654321, altRelM: 12.5 });
    expect(form).toBe('COMMAND_INT');
    expect(fields).toMatchObject({ command: 192, frame: 3, param2: 1, x: 471234567, y: -87654321, z: 12.5 });
  });
});
