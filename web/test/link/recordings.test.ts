import { beforeEach, describe, expect, it } from 'vitest';

import { mayDeleteRecordings, mayRecord } from '../../src/link/drone_view';
import {
  Recordings,
  recordingHref,
  TRY_AGAIN_MS,
  withRecording,
  type Recording,
  type RecordingState,
} from '../../src/link/recordings';
import { Rest } from '../../src/link/rest';
import { A_DRONE, FakeClock, settled } from './fakes';

const recording = (id: number, state: RecordingState = 'ready', more: Partial<Recording> = {}): Recording => ({
  id,
  drone_id: 1,
  by: { id: 5, name: 'alice' },
  state,
  words: '',
  quality: 'medium',
  codec: 'h264',
  began_at: '2026-11-22T09:00:00Z',
  first_picture_at: null,
  ended_at: null,
  flights: [],
  size_bytes: 100,
  duration_s: null,
  pictures: 0,
  width: null,
  height: null,
  ...more,
});

interface Asked {
  readonly what: string;
  readonly answer: (status: number, body?: unknown) => Promise<void>;
}

let clock: FakeClock;
let asked: Asked[];
let recordings: Recordings;

beforeEach(() => {
  clock = new FakeClock();
  asked = [];
  const rest = new Rest(
    (path, init) =>
      new Promise((resolve) => {
        asked.push({
          what: `${init.method ?? ''} ${path}`,
          answer: async (status, body) => {
            resolve(new Response(status === 204 ? null : JSON.stringify(body), { status }));
            await settled();
          },
        });
      }),
  );
  recordings = new Recordings(clock, rest);
});

const states = (): string[] | null =>
  recordings
    .of(1)
    .get()
    .list?.map(({ id, state }) => `${id} ${state}`) ?? null;
const next = (): Asked => asked.shift()!;
const said = (event: string, one: Recording): void =>
  recordings.take({ type: 'recording', drone_id: one.drone_id, event, recording: one });

describe('the recordings of a drone that is looked at', () => {
  it('are read once for all who look, and then kept by what the tower says', async () => {
    const end = recordings.watch(1);
    recordings.watch(1);
    expect(states()).toBeNull();
    expect(asked.map(({ what }) => what)).toEqual(['GET /api/v1/drones/1/recordings']);
    await next().answer(200, [recording(2), recording(1)]);
    expect(states()).toEqual(['2 ready', '1 ready']);
    said('begun', recording(3, 'recording'));
    said('begun', recording(9, 'recording', { drone_id: 4 }));
    expect(states()).toEqual(['3 recording', '2 ready', '1 ready']);
    said('ended', recording(3, 'finishing'));
    said('removed', recording(1));
    said('ready', recording(3));
    expect(states()).toEqual(['3 ready', '2 ready']);
    end();
    expect(asked).toEqual([]);
  });

  it('are read again after a lost connection, while somebody looks', async () => {
    const end = recordings.watch(1);
    await next().answer(200, [recording(1, 'recording')]);
    recordings.reread();
    await next().answer(200, [recording(1)]);
    expect(states()).toEqual(['1 ready']);
    end();
    recordings.reread();
    expect(asked).toEqual([]);
  });

  it('are read once more when something was told while the list was on its way', async () => {
    recordings.watch(1);
    said('begun', recording(1, 'recording'));
    await next().answer(200, []);
    await next().answer(200, [recording(1, 'recording')]);
    expect(states()).toEqual(['1 recording']);
    expect(asked).toEqual([]);
  });

  it('are tried again after a failure, and what was known stays in sight', async () => {
    const end = recordings.watch(1);
    await next().answer(200, [recording(1)]);
    recordings.reread();
    await next().answer(503, { title: 'Busy', detail: 'the tower is busy' });
    expect(recordings.of(1).get()).toMatchObject({ problem: 'the tower is busy', list: [{ id: 1 }] });
    await clock.pass(TRY_AGAIN_MS);
    await next().answer(200, [recording(2), recording(1)]);
    expect(recordings.of(1).get().problem).toBe('');
    recordings.reread();
    await next().answer(503, {});
    end();
    expect(clock.waiting).toBe(0);
  });

  it('are not shown to the next user, also where they were still on their way', async () => {
    recordings.watch(1);
    recordings.clear();
    await next().answer(200, [recording(1)]);
    expect(states()).toBeNull();
  });
});

describe('recording', () => {
  beforeEach(async () => {
    recordings.watch(1);
    await next().answer(200, []);
  });

  it('begins, ends and is deleted, and is seen at once', async () => {
    const begun = recordings.begin(1);
    expect(asked[0]!.what).toBe('POST /api/v1/drones/1/recordings');
    await next().answer(201, recording(1, 'recording'));
    await begun;
    expect(states()).toEqual(['1 recording']);
    const ended = recordings.stop(recording(1, 'recording'));
    expect(asked[0]!.what).toBe('POST /api/v1/drones/1/recordings/1/stop');
    await next().answer(200, recording(1, 'finishing'));
    await ended;
    expect(states()).toEqual(['1 finishing']);
    const removed = recordings.remove(recording(1));
    expect(asked[0]!.what).toBe('DELETE /api/v1/drones/1/recordings/1');
    await next().answer(204);
    await removed;
    expect(states()).toEqual([]);
  });

  it('says why it was refused and changes nothing', async () => {
    const begun = recordings.begin(1);
    await next().answer(409, { type: '/problems/no-video', title: 'There is no video', detail: 'hawk has no camera' });
    await expect(begun).rejects.toThrow('hawk has no camera');
    expect(states()).toEqual([]);
  });

  it('is not put back by an answer that was overtaken', () => {
    const list = [recording(1, 'ready')];
    expect(withRecording(list, recording(1, 'finishing'))).toEqual(list);
    expect(withRecording([recording(1, 'failed')], recording(1, 'finishing'))[0]!.state).toBe('finishing');
  });
});

it('is for the holder and for admins, and deleting for owners and admins', () => {
  const drone = { ...A_DRONE, holder: { id: 5, name: 'alice' }, owners: [{ id: 6, name: 'bob' }] };
  const users = [5, 6, 7].map((id) => ({ id, role: 'operator' as const }));
  expect(users.map((user) => mayRecord(drone, user))).toEqual([true, false, false]);
  expect(users.map((user) => mayDeleteRecordings(drone, user))).toEqual([false, true, false]);
  const admin = { id: 8, role: 'admin' as const };
  expect([mayRecord(drone, admin), mayDeleteRecordings(drone, admin)]).toEqual([true, true]);
});

it('is downloaded from the tower', () => {
  expect(recordingHref(recording(7))).toBe('/api/v1/drones/1/recordings/7/file');
});
