import { describe, expect, it } from 'vitest';

import type { Operation } from '../../src/link/operation_types';
import type { Drone, User } from '../../src/link/wire_types';
import type { FollowPlace } from '../../src/squad/follow_place';
import { formUp, THERE_WITHIN_MS, type FormationAnswer, type FormationTower } from '../../src/squad/formation_flight';
import { A_DRONE } from '../link/fakes';

const ADA: User = { id: 5, name: 'ada', role: 'admin' };
const PLACE: FollowPlace = { northM: -15, eastM: 0, upM: 2 };

const RUNNING = { work: 'follow', state: 'running', phase: 'following Merlin: 15 m away', total: 600, words: '' };

/** `waits[n]`: what happens during the nth wait. */
class World implements FormationTower {
  readonly user = ADA;
  readonly log: string[] = [];
  readonly answers = new Map<number, FormationAnswer[]>();
  readonly offM = new Map<number, number | null>();
  readonly heard = new Map<string, (operation: Operation) => void>();
  readonly waits: (() => void)[] = [];
  failsAt = 0;
  isStopped = false;
  now = 0;

  constructor(readonly drones: readonly Drone[]) {}

  drone(droneId: number): Drone | undefined {
    return this.drones.find(({ id }) => id === droneId);
  }
  acquire(droneId: number): Promise<void> {
    this.log.push(`acquire ${droneId}`);
    return Promise.resolve();
  }
  follow(droneId: number): Promise<Operation> {
    if (droneId === this.failsAt) return Promise.reject(new Error('Merlin is not in the air'));
    this.log.push(`follow ${droneId}`);
    return Promise.resolve(this.operation(droneId, { total: 0, phase: 'GUIDED' }));
  }
  operation(droneId: number, changes: Partial<Operation> = {}): Operation {
    return { ...RUNNING, id: `op-${droneId}`, drone_id: droneId, ...changes } as Operation;
  }
  watch(id: string, heard: (operation: Operation) => void): void {
    this.heard.set(id, heard);
  }
  offPlaceM(droneId: number): number | null {
    return this.offM.get(droneId) ?? null;
  }
  wait(): Promise<void> {
    this.now += 1000;
    this.waits.shift()?.();
    return Promise.resolve();
  }
  nowMs(): number {
    return this.now;
  }
  run(): Promise<void> {
    return formUp(this, {
      ways: this.drones.map(({ id }) => ({ droneId: id, place: PLACE })),
      isStopped: () => this.isStopped,
      onanswer: (droneId, answer) => this.answers.set(droneId, [...(this.answers.get(droneId) ?? []), answer]),
    });
  }
  states(droneId: number): string[] {
    return this.answers.get(droneId)!.map(({ state }) => state);
  }
  last(droneId: number): [string, string] {
    const { state, why } = this.answers.get(droneId)!.at(-1)!;
    return [state, why];
  }
}

const squad = (...changes: Partial<Drone>[]): Drone[] =>
  changes.map((one, at) => ({ ...A_DRONE, id: at + 1, name: `drone-${at + 1}`, holder: null, ...one }) as Drone);

describe('a formation', () => {
  it('forms one after the other: the next sets off when the one before is there, and the controls are kept', async () => {
    const world = new World(squad({}, {}));
    world.waits.push(
      () => world.heard.get('op-1')!(world.operation(1)),
      () => {
        expect(world.log).toEqual(['acquire 1', 'follow 1']);
        world.offM.set(1, 1.2);
        world.offM.set(2, 0.4);
      },
      () => world.heard.get('op-2')!(world.operation(2)),
    );
    await world.run();
    expect(world.log).toEqual(['acquire 1', 'follow 1', 'acquire 2', 'follow 2']);
    expect(world.states(1)).toEqual(['waiting', 'going', 'going', 'going', 'following']);
    expect(world.last(2)).toEqual(['following', 'following Merlin: 15 m away']);
  });

  it('is not there before its agent says that it follows, wherever it is', async () => {
    const world = new World(squad({ holder: ADA }));
    world.offM.set(1, 0.1);
    world.waits.push(
      () => expect(world.states(1)).not.toContain('following'),
      () => world.heard.get('op-1')!(world.operation(1)),
    );
    await world.run();
    expect(world.log).toEqual(['follow 1']); // it was held before
    expect(world.last(1)[0]).toBe('following');
  });

  it('sends nobody after one that could not, with the reason of each', async () => {
    const world = new World(squad({}, {}, {}));
    world.failsAt = 1;
    await world.run();
    expect(world.last(1)).toEqual(['refused', 'Merlin is not in the air']);
    expect(world.last(2)).toEqual(['not-reached', 'drone-1 does not follow, so this one was not sent.']);
    expect(world.log).toEqual(['acquire 1']);
  });

  it('sends nobody while one is not in its place', async () => {
    const world = new World(squad({}, {}));
    world.waits.push(() => world.heard.get('op-1')!(world.operation(1)));
    world.offM.set(1, 30);
    await world.run();
    expect(world.now).toBeGreaterThan(THERE_WITHIN_MS);
    expect(world.last(1)[0]).toBe('going');
    expect(world.last(2)).toEqual(['not-reached', 'drone-1 is not in its place, so this one was not sent.']);
  });

  it('tells why one follows no more, during and after', async () => {
    const world = new World(squad({}, {}));
    const words = 'drone-1: It no longer follows Merlin: Merlin is not in the air. It holds in BRAKE.';
    world.waits.push(() => world.heard.get('op-1')!(world.operation(1, { state: 'failed', words })));
    await world.run();
    expect(world.last(1)).toEqual(['ended', words]);
    expect(world.last(2)[0]).toBe('not-reached');
  });

  it('sends nobody once it was stopped, not even between the controls and the command', async () => {
    const world = new World(squad({}, {}));
    world.acquire = (droneId) => {
      world.log.push(`acquire ${droneId}`);
      world.isStopped = true;
      return Promise.resolve();
    };
    await world.run();
    expect(world.log).toEqual(['acquire 1']);
    expect([world.last(1)[0], world.last(2)]).toEqual(['not-reached', ['not-reached', 'You stopped before its turn.']]);
  });
});
