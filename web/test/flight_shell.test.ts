import { beforeEach, describe, expect, it, vi } from 'vitest';

import { barSubject } from '../src/flight_shell.svelte';
import { Vehicle } from '../src/link/vehicle';
import type { UserRef } from '../src/link/wire_types';
import { A_DRONE, FakeClock } from './link/fakes';

vi.mock('../src/tower.svelte', () => ({ tower: {} }));

const ME: UserRef = { id: 7, name: 'alice' };
const UPLINK = {
  command: () => Promise.resolve({ kind: 'reported', isDone: true, words: '' } as const),
  send: () => true,
  sendFresh: () => 'sent' as const,
  alerts: () => [],
};

let vehicles: Map<number, Vehicle>;

function put(id: number, holder: UserRef | null): void {
  vehicles.set(id, new Vehicle({ ...A_DRONE, id, holder }, new FakeClock(), UPLINK, () => undefined));
}

const own = (lookedAtId: number | null, lastId: number | null): number | undefined =>
  barSubject(vehicles, ME, lookedAtId, lastId).own?.drone.get().id;

beforeEach(() => {
  vehicles = new Map();
  put(2, null);
  put(5, ME);
});

describe('the drone that Hold, Return and Land are for', () => {
  it('never changes by itself: not when one is given another drone', () => {
    expect(own(null, null)).toBe(5);
    put(2, ME);
    expect(own(null, 5)).toBe(5);
  });

  it('is the one looked at, if it is one of mine', () => {
    put(2, ME);
    expect(own(2, 5)).toBe(2);
    put(2, null);
    expect(own(2, 5)).toBe(5);
    expect(barSubject(vehicles, ME, 2, 5).other).toBe(vehicles.get(2));
  });

  it('is another one of mine once its controls are gone, and none without any', () => {
    put(2, ME);
    put(5, null);
    expect(own(null, 5)).toBe(2);
    put(2, null);
    expect(own(null, 2)).toBeUndefined();
  });
});
