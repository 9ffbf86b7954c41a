import { expect, it } from 'vitest';

import { isGood, outcomeWords } from '../../src/link/outcome';
import { outcomeOfCommand } from '../../src/link/drone_commands';
import type { Operation } from '../../src/link/operation_types';
import { Operations } from '../../src/link/operations';
import { Rest } from '../../src/link/rest';

const OVER = { id: '1', drone_id: 7, work: 'command', state: 'done', words: 'Kestrel accepted, now pausing.' };

/** The outcome of a pause at a tower that gives this answer, and the requests that it received. */
async function paused(status: number, body: object) {
  const asked: unknown[] = [];
  const rest = new Rest((path, init) => {
    asked.push([path, init.method, JSON.parse(init.body as string)]);
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
  const outcome = await outcomeOfCommand(new Operations(rest), 7, { command: 'pause' });
  return { asked, outcome };
}

it.each([
  [{ ...OVER }, true],
  [{ ...OVER, state: 'failed', words: 'Kestrel, pausing: denied.' } as Partial<Operation>, false],
  [{ ...OVER, state: 'timed_out', words: 'Kestrel did not answer.' } as Partial<Operation>, false],
])('tells how it ended in the words of the tower: %j', async (operation, isDone) => {
  const { asked, outcome } = await paused(200, operation);
  expect(asked).toEqual([['/api/v1/drones/7/commands', 'POST', { command: 'pause' }]]);
  expect(isGood(outcome)).toBe(isDone);
  expect(outcomeWords('Kestrel', outcome)).toBe(operation.words);
});

it('tells why the tower did not begin it', async () => {
  const { outcome } = await paused(409, { type: 'urn:not-in-control', title: 'No', detail: 'bob has the controls.' });
  expect(isGood(outcome)).toBe(false);
  expect(outcomeWords('Kestrel', outcome)).toBe('bob has the controls.');
});

it.each([
  [{ state: 'timed_out' }, 'no-answer'],
  [{ seen: false }, 'unconfirmed'],
  [{ seen: true }, undefined],
  [{ state: 'failed', seen: false }, undefined],
])('tells what nobody knows: %j', async (fields, doubt) => {
  const { outcome } = await paused(200, { ...OVER, ...fields });
  expect(outcome.kind === 'reported' ? outcome.doubt : 'not told').toBe(doubt);
});

it.each([
  [
    200,
    { ...OVER, state: 'failed', item: 2, words: 'Kestrel, a photograph every 12 m: denied.' },
    'state-not-restored',
  ],
  [200, { ...OVER, state: 'failed', item: null }, undefined],
  [200, { ...OVER, item: 2 }, undefined],
  [409, { type: '/problems/state-not-restored', title: 'No', detail: 'Servo 9.' }, 'state-not-restored'],
])('names the problem that a pilot may overrule: %i %j', async (status, body, problem) => {
  const { outcome } = await paused(status, body);
  expect(outcome.kind === 'reported' ? outcome.problem : 'not told').toBe(problem);
});
