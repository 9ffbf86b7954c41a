import { describe, expect, it } from 'vitest';

import { bytesOf, keysOf, whyNoPush } from '../../src/push/this_browser';

describe('this browser', () => {
  const navigator = { serviceWorker: {} } as Navigator;
  const able = { isSecureContext: true, navigator, PushManager: class {}, Notification: class {} };

  it('can, with https and all parts', () => {
    expect(whyNoPush(able)).toBe('');
  });

  it('says what is missing', () => {
    expect(whyNoPush({ ...able, isSecureContext: false })).toContain('https');
    expect(whyNoPush({ isSecureContext: true, navigator, Notification: class {} })).toContain('home screen');
    expect(whyNoPush({ isSecureContext: true, navigator, PushManager: class {} })).toContain('cannot show');
    expect(whyNoPush({ ...able, navigator: {} as Navigator })).toContain('cannot show');
  });
});

describe('a subscription', () => {
  const of = (json: PushSubscriptionJSON) => ({ toJSON: () => json }) as PushSubscription;

  it('is told to the tower with its keys', () => {
    const keys = { p256dh: 'BA', auth: 'AA' };
    expect(keysOf(of({ endpoint: 'https://push/1', keys }))).toEqual({ endpoint: 'https://push/1', ...keys });
  });

  it('without keys is refused', () => {
    expect(() => keysOf(of({ endpoint: 'https://push/1' }))).toThrow('without keys');
    expect(() => keysOf(of({ endpoint: 'https://push/1', keys: { p256dh: 'BA' } }))).toThrow('without keys');
  });

  it('is made with the bytes of the key', () => {
    expect([...bytesOf('_-8')]).toEqual([255, 239]);
  });
});
