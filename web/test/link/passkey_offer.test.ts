import { describe, expect, it } from 'vitest';

import { PasskeyOffer, RENEW_MS } from '../../src/link/passkey_offer';
import { PasskeyError, type PasskeyCredential } from '../../src/link/passkeys';

const CREDENTIAL: PasskeyCredential = {
  id: 'AQ',
  rawId: 'AQ',
  type: 'public-key',
  response: { authenticatorData: '', clientDataJSON: '', signature: '' },
};

/** A browser whose user has not picked anything yet, and a clock that the test advances. */
class Scene {
  nowMs = 0;
  questions: { answer: (credential: PasskeyCredential) => void; fail: (error: Error) => void; signal: AbortSignal }[] =
    [];
  asked = 0;
  picked = 0;
  #timers: { atMs: number; work: () => void }[] = [];

  readonly offer = new PasskeyOffer({
    options: () => {
      this.asked += 1;
      return Promise.resolve({ challenge: String(this.asked) });
    },
    ask: (_options, { signal }) =>
      new Promise((answer, fail) => {
        this.questions.push({ answer, fail, signal: signal! });
        signal!.addEventListener('abort', () => fail(new PasskeyError('', true)));
      }),
    nowMs: () => this.nowMs,
    later: (work, ms) => {
      const timer = { atMs: this.nowMs + ms, work };
      this.#timers.push(timer);
      return () => {
        this.#timers = this.#timers.filter((one) => one !== timer);
      };
    },
    onpicked: () => {
      this.picked += 1;
      return Promise.resolve();
    },
  });

  async pass(ms: number): Promise<void> {
    this.nowMs += ms;
    for (const { atMs, work } of [...this.#timers]) if (atMs <= this.nowMs) work();
    await settled();
  }

  get timers(): number {
    return this.#timers.length;
  }
}

const settled = async (): Promise<void> => {
  for (let turn = 0; turn < 20; turn++) await Promise.resolve();
};

describe('passkeys where the name is typed', () => {
  it('are asked for again before the challenge is too old', async () => {
    const scene = new Scene();
    void scene.offer.run();
    await settled();
    expect(scene.asked).toBe(1);
    await scene.pass(RENEW_MS - 1);
    expect(scene.asked).toBe(1);
    await scene.pass(1);
    expect(scene.asked).toBe(2);
    expect(scene.questions[0]!.signal.aborted).toBe(true);
    expect(scene.questions[1]!.signal.aborted).toBe(false);
    expect(scene.timers).toBe(1);
  });

  it('sign in when one is picked, and wait for the next one', async () => {
    const scene = new Scene();
    void scene.offer.run();
    await settled();
    scene.questions[0]!.answer(CREDENTIAL);
    await settled();
    expect(scene.picked).toBe(1);
    expect(scene.questions).toHaveLength(2);
  });

  it('are taken back, and then nothing is asked any more', async () => {
    const scene = new Scene();
    const done = scene.offer.run();
    await settled();
    scene.offer.stop();
    await done;
    expect(scene.questions[0]!.signal.aborted).toBe(true);
    await scene.pass(RENEW_MS);
    expect([scene.asked, scene.timers]).toEqual([1, 0]);
  });

  it('are given up where the browser gives up at once', async () => {
    const scene = new Scene();
    const done = scene.offer.run();
    await settled();
    scene.questions[0]!.fail(new PasskeyError('no'));
    await done;
    expect(scene.asked).toBe(1);
  });

  it('are asked for again where the person has closed the list', async () => {
    const scene = new Scene();
    void scene.offer.run();
    await settled();
    await scene.pass(60_000);
    scene.questions[0]!.fail(new PasskeyError('cancelled'));
    await settled();
    expect(scene.asked).toBe(2);
  });

  it('begin once, however often they are begun', async () => {
    const scene = new Scene();
    const first = scene.offer.run();
    void scene.offer.run();
    await first;
    await settled();
    expect(scene.questions.filter(({ signal }) => !signal.aborted)).toHaveLength(1);
  });
});
