import { describe, expect, it } from 'vitest';

import { Rest, RestError } from '../../src/link/rest';

function answering(status: number, body: string | null): { rest: Rest; calls: [string, RequestInit][] } {
  const calls: [string, RequestInit][] = [];
  const rest = new Rest((path, init) => {
    calls.push([path, init]);
    return Promise.resolve(new Response(body, { status }));
  });
  return { rest, calls };
}

const failure = async (promise: Promise<unknown>): Promise<RestError> => {
  const error: unknown = await promise.then(
    () => null,
    (reason: unknown) => reason,
  );
  expect(error).toBeInstanceOf(RestError);
  return error as RestError;
};

describe('the REST client', () => {
  it('signs in with a JSON body', async () => {
    const user = { id: 1, name: 'olga', role: 'operator' };
    const { rest, calls } = answering(200, JSON.stringify(user));
    expect(await rest.signIn('olga', 'secret')).toEqual(user);
    const [path, init] = calls[0]!;
    expect(path).toBe('/api/v1/session');
    expect(init).toMatchObject({
      method: 'POST',
      body: '{"name":"olga","password":"secret"}',
      credentials: 'same-origin',
    });
  });

  it('sends a reason only where there is one', async () => {
    const { rest, calls } = answering(200, '{"sentences": []}');
    await rest.control(4, 'take', { reason: 'storm', watch: false });
    await rest.control(4, 'acquire');
    await rest.control(4, 'stay');
    await rest.acknowledgeLossCheck(4, 'Heron');
    expect(calls.map(([path, { body }]) => [path, body])).toEqual([
      ['/api/v1/drones/4/control/take', '{"reason":"storm","watch":false}'],
      ['/api/v1/drones/4/control/acquire', '{}'],
      ['/api/v1/drones/4/control/stay', '{}'],
      ['/api/v1/drones/4/loss-check/acknowledge', '{"drone":"Heron"}'],
    ]);
  });

  it('fills in what an older tower leaves out of a drone', async () => {
    const { rest } = answering(200, '{"id":4,"name":"Heron","tomorrow":1}');
    expect(await rest.control(4, 'acquire')).toMatchObject({
      id: 4,
      may_watch: true,
      offered: false,
      lost_action_s: 30,
    });
  });

  it('says which field of a request was at fault', async () => {
    const errors = [{ in: 'body', field: 'lost_hold_s', message: 'too small' }, null, { field: 3 }];
    const error = await failure(
      answering(422, JSON.stringify({ title: 'no', errors })).rest.call('PATCH', '/drones/{drone_id}/settings', {
        path: { drone_id: 1 },
        body: {},
      }),
    );
    expect(error.errors).toEqual([{ field: 'lost_hold_s', message: 'too small' }]);
  });

  it('asks for a rehearsal in flight only in so many words', async () => {
    const { rest, calls } = answering(202, '{}');
    await rest.rehearse(4, 'tower', false);
    await rest.rehearse(4, 'operator', true);
    expect(calls.map(([path, { body }]) => [path, body])).toEqual([
      ['/api/v1/drones/4/rehearsal', '{"what":"tower"}'],
      ['/api/v1/drones/4/rehearsal', '{"what":"operator","in_flight":true}'],
    ]);
  });

  it('takes an empty answer for signing out', async () => {
    const { rest } = answering(204, null);
    expect(await rest.signOut()).toBeUndefined();
  });

  it('turns a problem document into an error with its words', async () => {
    const document = { type: 'about:blank', title: 'Held', status: 409, detail: 'olga has the controls.' };
    const error = await failure(answering(409, JSON.stringify(document)).rest.control(1, 'acquire'));
    expect(error).toMatchObject({ status: 409, title: 'Held', detail: 'olga has the controls.' });
    expect(error.message).toBe('olga has the controls.');
  });

  it.each(['<html>Bad gateway</html>', '[]', 'null', '{"detail": 5}'])('has words of its own for %s', async (body) => {
    const error = await failure(answering(502, body).rest.me());
    expect(error.status).toBe(502);
    expect(error.message).toContain('502');
  });

  it('says so when the tower cannot be reached', async () => {
    const rest = new Rest(() => Promise.reject(new TypeError('Failed to fetch')));
    expect(await failure(rest.me())).toMatchObject({ status: 0, title: 'No connection' });
  });

  it('does not take a page for an answer', async () => {
    expect(await failure(answering(200, '<html>').rest.me())).toMatchObject({ title: 'Unexpected answer' });
  });
});

describe('a request of the document', () => {
  it('has its parameters where they belong, and leaves out what is not given', async () => {
    const { rest, calls } = answering(200, '[]');
    await rest.call('GET', '/audit', { query: { actor: 'Ann & Bob', drone_id: 4, before: null } });
    await rest.call('PUT', '/me/preferences/{name}', { path: { name: 'a/b?' }, body: {} });
    await rest.call('GET', '/drones/{drone_id}/parameters', {
      path: { drone_id: 4 },
      header: { 'if-none-match': '"x"' },
    });
    expect(calls.map(([path]) => path)).toEqual([
      '/api/v1/audit?actor=Ann+%26+Bob&drone_id=4',
      '/api/v1/me/preferences/a%2Fb%3F',
      '/api/v1/drones/4/parameters',
    ]);
    expect(calls[2]![1].headers).toMatchObject({ 'if-none-match': '"x"' });
  });

  it('has an id of its page and its own, which the tower accepts', async () => {
    const { rest, calls } = answering(200, '[]');
    const other = answering(200, '[]');
    await rest.call('GET', '/audit');
    await rest.call('GET', '/audit');
    await other.rest.call('GET', '/audit');
    const ids = [...calls, ...other.calls].map(
      ([, { headers }]) => (headers as Record<string, string>)['X-Request-Id']!,
    );
    for (const id of ids) expect(id).toMatch(/^[A-Za-z0-9][A-Za-z0-9._-]{7,63}$/);
    const [first, second, another] = ids.map((id) => id.split('.')[0]);
    expect(new Set(ids).size).toBe(3);
    expect(first).toBe(second);
    expect(another).not.toBe(first);
  });

  it('is held against the document by the compiler', async () => {
    const { rest, calls } = answering(200, '{}');
    // @ts-expect-error: no such path
    await rest.call('GET', '/nowhere');
    // @ts-expect-error: the body is missing
    await rest.call('POST', '/session');
    // @ts-expect-error: a member that the tower does not know
    await rest.call('POST', '/session', { body: { name: 'a', password: 'b', kode: '1' } });
    // @ts-expect-error: a path parameter is missing
    await rest.call('GET', '/drones/{drone_id}');
    // @ts-expect-error: it takes no body
    await rest.call('GET', '/teams', { body: {} });
    expect(calls).toHaveLength(5);
  });
});

describe('a request that needs a proof of who sits there', () => {
  const TOKEN = { body: { name: 'x', scopes: ['watch'] } } as const;
  const NEEDED = JSON.stringify({ type: '/problems/proof-needed', title: 'Confirm that it is you', status: 403 });

  function provable(answers: readonly [number, string][]): { rest: Rest; bodies: unknown[] } {
    const bodies: unknown[] = [];
    const rest = new Rest((_, init) => {
      const [status, body] = answers[bodies.length]!;
      bodies.push(init.body);
      return Promise.resolve(new Response(body, { status }));
    });
    return { rest, bodies };
  }

  it('is sent once more when the proof was given', async () => {
    const { rest, bodies } = provable([
      [403, NEEDED],
      [200, '{"id":4}'],
    ]);
    let asked = 0;
    rest.onProofNeeded = () => Promise.resolve(++asked > 0);
    expect(await rest.call('POST', '/tokens', TOKEN)).toEqual({ id: 4 });
    const body = JSON.stringify(TOKEN.body);
    expect([asked, bodies]).toEqual([1, [body, body]]);
  });

  it('fails when it was not given, and asks once only', async () => {
    const refused = provable([[403, NEEDED]]);
    refused.rest.onProofNeeded = () => Promise.resolve(false);
    expect((await failure(refused.rest.call('POST', '/tokens', TOKEN))).slug).toBe('proof-needed');
    const again = provable([
      [403, NEEDED],
      [403, NEEDED],
    ]);
    again.rest.onProofNeeded = () => Promise.resolve(true);
    expect((await failure(again.rest.call('POST', '/tokens', TOKEN))).slug).toBe('proof-needed');
    expect(again.bodies).toHaveLength(2);
  });

  it('asks for nothing where another thing is wrong', async () => {
    const { rest } = provable([[403, '{"type":"/problems/in-person-only"}']]);
    rest.onProofNeeded = () => Promise.reject(new Error('asked'));
    expect((await failure(rest.call('POST', '/tokens', TOKEN))).slug).toBe('in-person-only');
  });
});
