import { beforeEach, describe, expect, it } from 'vitest';

import { newestOf, Operations } from '../../src/link/operations';
import type { Operation } from '../../src/link/operation_types';
import { Rest } from '../../src/link/rest';
import { settled } from './fakes';

const PLAN = '/drones/{drone_id}/{kind}';
const MISSION = { path: { drone_id: 1, kind: 'mission' }, body: { items: [] } } as const;

const operation = (changes: Partial<Operation> = {}): Operation => ({
  id: '41',
  drone_id: 1,
  work: 'plan_upload',
  kind: 'mission',
  state: 'running',
  phase: 'uploading',
  done: 0,
  total: 12,
  words: '',
  item: null,
  code: '',
  seen: null,
  logs: null,
  hash: null,
  refusals: [],
  refused: 0,
  by: { id: 5, name: 'olga' },
  began_at: '2026-11-22T02:00:00Z',
  ended_at: null,
  ...changes,
});
const DONE = operation({ state: 'done', done: 12, words: 'The mission is on board.' });

let asked: { path: string; init: RequestInit }[];
let answers: Record<string, () => Response | Promise<Response>>;
let operations: Operations;
const answer = (status: number, body: unknown) => (): Response => new Response(JSON.stringify(body), { status });

beforeEach(() => {
  asked = [];
  answers = {};
  const rest = new Rest((path, init) => {
    asked.push({ path, init });
    const say = answers[`${init.method} ${path}`] ?? answer(404, { title: 'Not found' });
    return Promise.resolve(say());
  });
  operations = new Operations(rest);
});

const seen = (id = '41'): Operation | undefined => operations.all.get().get(id);

describe('an operation that we begin', () => {
  it('is asked for without waiting for its end, and followed over the live channel', async () => {
    answers['PUT /api/v1/drones/1/mission'] = answer(202, operation());
    const ended = operations.run('PUT', PLAN, MISSION);
    await settled();
    expect((asked[0]!.init.headers as Record<string, string>)['prefer']).toBe('respond-async');
    operations.put(operation({ done: 5 }));
    expect(seen()!.done).toBe(5);
    operations.put(DONE);
    expect(await ended).toEqual(DONE);
  });

  it('is not set back by an answer that comes after the live channel', async () => {
    answers['PUT /api/v1/drones/1/mission'] = () => {
      operations.put(operation({ done: 9 }));
      return answer(202, operation())();
    };
    expect((await operations.start('PUT', PLAN, MISSION)).done).toBe(9);
    answers['PUT /api/v1/drones/1/mission'] = () => {
      operations.put(DONE);
      return answer(202, operation())();
    };
    expect(await operations.run('PUT', PLAN, MISSION)).toEqual(DONE);
  });

  it('that is refused by the tower never began', async () => {
    answers['PUT /api/v1/drones/1/mission'] = answer(409, { type: 'urn:x:not-in-control', detail: 'Not yours.' });
    await expect(operations.run('PUT', PLAN, MISSION)).rejects.toThrow('Not yours.');
    expect(operations.all.get().size).toBe(0);
  });
});

describe('an operation', () => {
  it('that has ended stays as it ended', () => {
    expect(operations.put(DONE)).toBe(true);
    expect(operations.put(operation({ done: 3 }))).toBe(false);
    expect(seen()).toEqual(DONE);
  });

  it('that nobody heard the end of is put right when the agent tells it later', () => {
    operations.put(operation({ state: 'timed_out' }));
    expect(operations.put(operation())).toBe(false);
    expect(operations.put(DONE)).toBe(true);
    expect(seen()).toEqual(DONE);
  });

  it('that ended while the connection was gone is asked for', async () => {
    operations.put(operation());
    const ended = operations.ended('41');
    answers['GET /api/v1/operations/41'] = answer(200, DONE);
    await operations.reread();
    expect(await ended).toEqual(DONE);
  });

  it('that the tower has forgotten is told to be unknown, not to be done', async () => {
    operations.put(operation());
    await operations.reread();
    expect(seen()!.state).toBe('failed');
    expect(seen()!.words).toContain('no longer knows');
  });

  it('goes on when it cannot be asked for', async () => {
    operations.put(operation());
    answers['GET /api/v1/operations/41'] = () => Promise.reject(new TypeError('offline'));
    await operations.reread();
    expect(seen()!.state).toBe('running');
  });

  it('is waited for by nobody after a sign-out', async () => {
    operations.put(operation());
    const ended = operations.ended('41');
    operations.clear();
    expect((await ended).state).toBe('failed');
    expect(operations.all.get().size).toBe(0);
  });
});

it('keeps what runs when it forgets what is old', () => {
  operations.put(operation({ id: 'running' }));
  for (let one = 0; one < 500; one += 1) operations.put(operation({ id: `old ${one}`, state: 'done' }));
  expect(operations.all.get().size).toBe(300);
  expect(seen('running')).toBeDefined();
  expect(seen('old 499')).toBeDefined();
});

it('finds the newest of some kinds at a drone', () => {
  operations.put(operation({ id: 'one' }));
  operations.put(operation({ id: 'other drone', drone_id: 2 }));
  operations.put(operation({ id: 'fence', kind: 'fence' }));
  operations.put(operation({ id: 'command', work: 'command', kind: null }));
  const all = operations.all.get();
  expect(newestOf(all, 1, ['plan_upload', 'plan_verify'])?.id).toBe('fence');
  expect(newestOf(all, 1, ['plan_upload'], 'mission')?.id).toBe('one');
  expect(newestOf(all, 3, ['plan_upload'])).toBeNull();
});
