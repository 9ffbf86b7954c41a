import { expect, it, vi } from 'vitest';

import type { Drone } from '../src/link/wire_types';
import { takeControl } from '../src/take_control';
import { A_DRONE } from './link/fakes';

const towers = vi.hoisted(() => ({ answer: (): Promise<boolean> => Promise.resolve(true), asked: [] as Drone[] }));
vi.mock('../src/control_actions', () => ({
  acquire: (drone: Drone) => {
    towers.asked.push(drone);
    return towers.answer();
  },
}));

it('asks for the controls, and a problem of before is gone', async () => {
  const told: string[] = [];
  await takeControl(A_DRONE, (problem) => told.push(problem));
  expect(towers.asked).toEqual([A_DRONE]);
  expect(told).toEqual(['']);
});

it('tells why it was refused', async () => {
  towers.answer = () => Promise.reject(new Error('bob has the controls.'));
  const told: string[] = [];
  await takeControl(A_DRONE, (problem) => told.push(problem));
  expect(told).toEqual(['', 'bob has the controls.']);
});
