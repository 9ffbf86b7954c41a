import { describe, expect, it } from 'vitest';

import type { AlertChannel } from '../../src/link/admin_types';
import { channelName, channelState } from '../../src/words/channel_words';

const MAIL: AlertChannel = {
  id: 1,
  kind: 'mail',
  target: 'anna@example.org',
  browser: '',
  severity: 'warning',
  drones: 'all',
  is_confirmed: true,
  created_at: '2026-01-01T00:00:00Z',
  sent_at: null,
  problem: '',
  waiting: 0,
};

describe('alert channels', () => {
  it('are named by address or host', () => {
    expect(channelName(MAIL)).toBe('anna@example.org');
    expect(channelName({ kind: 'webhook', target: 'https://example.org:8443/hooks/secret', browser: '' })).toBe(
      'the webhook at example.org:8443',
    );
    expect(channelName({ kind: 'webhook', target: 'no address', browser: '' })).toBe('the webhook at no address');
  });

  it('name a browser, and never its secret address', () => {
    const target = 'https://push.example.org/secret';
    expect(channelName({ kind: 'push', target, browser: 'Firefox on Linux' })).toBe('Firefox on Linux');
    expect(channelName({ kind: 'push', target, browser: '' })).toBe('a browser (push.example.org)');
  });

  it('say how they are', () => {
    expect(channelState(MAIL)).toBe('not used yet');
    expect(channelState({ ...MAIL, sent_at: '2026-01-01T00:00:00Z' })).toBe('works');
    expect(channelState({ ...MAIL, is_confirmed: false })).toBe('waits for its code');
    expect(channelState({ ...MAIL, waiting: 2, problem: 'the server answers 500' })).toBe(
      'last attempt: the server answers 500; 2 on the way',
    );
  });
});
