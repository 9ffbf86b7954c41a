import { describe, expect, it } from 'vitest';

import type { Operation } from '../../src/link/operation_types';
import type { Drone, User } from '../../src/link/wire_types';
import { inTurn, type SquadAnswer, type SquadAction, type SquadRun } from '../../src/squad/squad_flight';
import { A_DRONE } from '../link/fakes';

const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const PETE = { id: 6, name: 'pete' };

const operation = (changes: Partial<Operation> = {}): Operation => ({
  id: 'x',
  drone_id: 1,
  work: 'plan_upload',
  kind: 'mission',
  state: 'done',
  phase: '',
  done: 0,
  total: 0,
  words: 'The mission is on board.',
  item: null,
  code: '',
  seen: null,
  logs: null,
  hash: null,
  refusals: [],
  refused: 0,
  by: null,
  began_at: '',
  ended_at: null,
  ...changes,
});

/** A tower that enforces the rule: an operator holds one drone at a time. */
class World {
  readonly user = OLGA;
  readonly drones = new Map<number, Drone>();
  readonly log: string[] = [];
  readonly answers = new Map<number, SquadAnswer[]>();
  nowMs = 0;
  failsRelease = false;

  constructor(...drones: Partial<Drone>[]) {
    for (const [at, changes] of drones.entries()) {
      this.drones.set(at + 1, { ...A_DRONE, id: at + 1, name: `drone-${at + 1}`, holder: null, ...changes } as Drone);
    }
  }

  drone(droneId: number): Drone | undefined {
    return this.drones.get(droneId);
  }

  acquire(droneId: number): Promise<void> {
    const held = [...this.drones.values()].find(({ holder }) => holder?.id === OLGA.id);
    if (held) return Promise.reject(new Error(`You have the controls of ${held.name} already.`));
    this.log.push(`acquire ${droneId}`);
    this.#put(droneId, { holder: OLGA });
    return Promise.resolve();
  }

  release(droneId: number): Promise<void> {
    if (this.failsRelease) return Promise.reject(new Error('the tower is out of reach'));
    this.log.push(`release ${droneId}`);
    this.#put(droneId, { holder: null });
    return Promise.resolve();
  }

  #put(droneId: number, changes: Partial<Drone>): void {
    this.drones.set(droneId, { ...this.drones.get(droneId)!, ...changes });
  }

  run(action: SquadAction, more: Partial<SquadRun> = {}): Promise<number> {
    return inTurn(this, {
      droneIds: [...this.drones.keys()],
      action,
      onanswer: (droneId, answer) => this.answers.set(droneId, [...(this.answers.get(droneId) ?? []), answer]),
      nowMs: () => this.nowMs,
      wait: (seconds) => {
        this.log.push(`wait ${seconds}`);
        this.nowMs += seconds * 1000;
        return Promise.resolve();
      },
      ...more,
    });
  }

  last(droneId: number): [string, string] {
    const { kind, why } = this.answers.get(droneId)!.at(-1)!;
    return [kind, why];
  }
}

describe('a job at several drones', () => {
  it('is done one after the other, and the controls are given back each time', async () => {
    const world = new World({}, {}, {});
    const action: SquadAction = (drone, report) => {
      world.log.push(`work ${drone.id}`);
      report(operation({ state: 'running', phase: 'writing', done: 3, total: 9 }));
      return Promise.resolve(operation());
    };
    expect(await world.run(action)).toBe(3);
    expect(world.log).toEqual([1, 2, 3].flatMap((id) => [`acquire ${id}`, `work ${id}`, `release ${id}`]));
    expect(world.answers.get(2)!.map(({ kind, why, done, total }) => [kind, why, done, total])).toEqual([
      ['waiting', '', 0, 0],
      ['working', 'takes control', 0, 0],
      ['working', 'writing', 3, 9],
      ['done', 'The mission is on board.', 1, 1],
    ]);
  });

  it('leaves the controls that one had before', async () => {
    const world = new World({ holder: OLGA });
    expect(await world.run(() => Promise.resolve(operation()))).toBe(1);
    expect(world.log).toEqual([]);
    expect(world.drone(1)!.holder).toEqual(OLGA);
  });

  it('tells of each why not, and goes on with the others', async () => {
    const world = new World({ online: false }, { holder: PETE }, { taken_from: PETE }, {}, {}, {});
    const action: SquadAction = (drone) => {
      if (drone.id === 4) return Promise.reject(new Error('the agent is too old'));
      return Promise.resolve(operation(drone.id === 5 ? { state: 'failed', words: 'Item 3 was refused.' } : {}));
    };
    expect(await world.run(action)).toBe(1);
    expect([1, 2, 3, 4, 5, 6].map((id) => world.last(id))).toEqual([
      ['refused', 'drone-1 is offline.'],
      ['refused', 'pete has the controls of drone-2.'],
      ['refused', 'The controls of drone-3 are between pete and an admin.'],
      ['refused', 'the agent is too old'],
      ['refused', 'Item 3 was refused.'],
      ['done', 'The mission is on board.'],
    ]);
    expect([...world.drones.values()].every(({ holder }) => holder === null || holder === PETE)).toBe(true);
  });

  it('is refused where one already flies another drone', async () => {
    const world = new World({}, { holder: OLGA, name: 'heron' });
    expect(await world.run(() => Promise.resolve(operation()), { droneIds: [1] })).toBe(0);
    expect(world.last(1)).toEqual(['refused', 'You have the controls of heron already.']);
  });

  it('says so when the controls could not be given back', async () => {
    const world = new World({});
    world.failsRelease = true;
    await world.run(() => Promise.resolve(operation()));
    expect(world.last(1)).toEqual([
      'done',
      'The mission is on board. You still have the controls of drone-1: the tower is out of reach',
    ]);
  });

  it('keeps the time between starts, counted from the beginning of each', async () => {
    const world = new World({}, {}, {});
    const action: SquadAction = () => {
      world.nowMs += 2000;
      return Promise.resolve(operation());
    };
    await world.run(action, { everyS: 5 });
    expect(world.log.filter((line) => line.startsWith('wait'))).toEqual(['wait 3', 'wait 3']);
  });

  it('begins no other when it is stopped, or when one of a row did not start', async () => {
    const stopped = new World({}, {});
    let isStopped = false;
    const action: SquadAction = () => {
      isStopped = true;
      return Promise.resolve(operation());
    };
    await stopped.run(action, { isStopped: () => isStopped });
    expect(stopped.last(1)[0]).toBe('done');
    expect(stopped.last(2)).toEqual(['not-reached', 'You stopped before its turn.']);
    const failing = new World({}, {});
    await failing.run(() => Promise.resolve(operation({ state: 'refused', words: 'Not armed.' })), {
      stopsAtFailure: true,
    });
    expect(failing.last(2)).toEqual(['not-reached', 'drone-1 was not done, so this was not begun.']);
    expect(failing.log).toEqual(['acquire 1', 'release 1']);
  });

  it('ends for one that left the squad', async () => {
    const world = new World();
    await world.run(() => Promise.resolve(operation()), { droneIds: [9] });
    expect(world.last(9)).toEqual(['refused', 'It is no longer in your squad.']);
  });
});
