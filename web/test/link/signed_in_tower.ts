/** A tower with two drones, signed in over a fake socket, for tests. */

import { Rest } from '../../src/link/rest';
import { Tower } from '../../src/link/tower';
import type { Vehicle } from '../../src/link/vehicle';
import { A_DRONE, FakeClock, FakeSocket } from './fakes';

export const OLGA = { id: 5, name: 'olga', role: 'operator' };
export const HERON = A_DRONE;
export const SWIFT = { ...A_DRONE, id: 2, name: 'Swift' };

export interface SignedIn {
  readonly clock: FakeClock;
  readonly tower: Tower;
  /** All opened sockets, the newest last. */
  readonly sockets: FakeSocket[];
  /** Status and body of each REST path; all others are not found. */
  readonly answers: Record<string, [number, unknown]>;
  readonly socket: () => FakeSocket;
  readonly texts: () => string[];
  readonly vehicle: (id: number) => Vehicle;
}

export async function signedInTower(): Promise<SignedIn> {
  const clock = new FakeClock();
  const sockets: FakeSocket[] = [];
  const answers: Record<string, [number, unknown]> = { '/api/v1/session': [200, OLGA], '/api/v1/me': [200, OLGA] };
  const rest = new Rest((path) => {
    const [status, body] = answers[path] ?? [404, { title: 'Not found', detail: 'There is no such thing.' }];
    return Promise.resolve(new Response(status === 204 ? null : JSON.stringify(body), { status }));
  });
  const openSocket = (): FakeSocket => {
    const made = new FakeSocket();
    sockets.push(made);
    return made;
  };
  const tower = new Tower({ clock, rest, openSocket });
  const socket = (): FakeSocket => sockets.at(-1)!;
  await tower.signIn('olga', 'secret');
  socket().says({ type: 'welcome', user: OLGA, drones: [SWIFT, HERON], server_time: '' });
  return {
    clock,
    tower,
    sockets,
    answers,
    socket,
    texts: () => tower.journal.entries.get().map(({ text }) => text),
    vehicle: (id) => tower.vehicles.get().get(id)!,
  };
}
