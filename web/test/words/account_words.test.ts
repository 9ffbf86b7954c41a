import { describe, expect, it } from 'vitest';

import type { Enrolment } from '../../src/link/admin_types';
import { auditCsvHref, auditQuery, type AuditFilters } from '../../src/link/audit';
import { browserWords } from '../../src/words/browser_words';
import { enrolmentWords } from '../../src/words/enrolment_words';
import { loanLimits } from '../../src/words/loan_words';

describe('a browser by what it says of itself', () => {
  const like = 'Mozilla/5.0 (%) AppleWebKit/537.36 (KHTML, like Gecko)';
  it.each([
    [`${like.replace('%', 'Windows NT 10.0; Win64; x64')} Chrome/140.0 Safari/537.36 Edg/140.0`, 'Edge on Windows'],
    [`${like.replace('%', 'X11; Linux x86_64')} Chrome/140.0 Safari/537.36`, 'Chromium or Chrome on Linux'],
    [`${like.replace('%', 'X11; Linux x86_64')} HeadlessChrome/140.0 Safari/537.36`, 'Chromium or Chrome on Linux'],
    [`${like.replace('%', 'Linux; Android 15')} Chrome/140.0 Mobile Safari/537.36`, 'Chromium or Chrome on Android'],
    [`${like.replace('%', 'Macintosh; Intel Mac OS X 10_15')} Version/18.0 Safari/605.1.15`, 'Safari on macOS'],
    [`${like.replace('%', 'iPad; CPU OS 18_0 like Mac OS X')} Version/18.0 Safari/604.1`, 'Safari on iOS'],
    ['Mozilla/5.0 (Windows NT 10.0; rv:140.0) Gecko/20100101 Firefox/140.0', 'Firefox on Windows'],
    ['python-httpx/0.28', 'python-httpx/0.28'],
    ['x'.repeat(60), 'x'.repeat(40)],
    ['', 'a program that does not say its name'],
  ])('%s', (userAgent, words) => {
    expect(browserWords(userAgent)).toBe(words);
  });
});

describe('the limits of a loan', () => {
  it.each([
    [{ may_arm: true, max_height_m: null, radius_m: null }, 'no limits'],
    [{ may_arm: false, max_height_m: null, radius_m: null }, 'may not arm'],
    [{ may_arm: false, max_height_m: 30, radius_m: 200 }, 'may not arm, up to 30 m high, up to 200 m away'],
  ])('%j', (limits, words) => {
    expect(loanLimits({ ...limits } as Parameters<typeof loanLimits>[0])).toBe(words);
  });
});

describe('an enrolment', () => {
  const nowMs = Date.parse('2026-03-04T05:00:00Z');
  const of = (state: Enrolment['state'], usedFrom: string | null = null): string =>
    enrolmentWords(
      {
        state,
        used_from: usedFrom,
        expires_at: '2026-03-04T05:10:00Z',
        drone: { id: 7, name: 'Kestrel' },
      } as Enrolment,
      nowMs,
    );

  it('names the drone and how long the token is good', () => {
    expect(of('waiting')).toBe('Waiting for Kestrel. The token ends in 10 min.');
  });

  it('says from where the key came', () => {
    expect(of('used', '192.0.2.7')).toBe('Kestrel has a key from 192.0.2.7. Waiting for its agent to link.');
    expect(of('seen', '192.0.2.7')).toBe('Kestrel is enrolled: its agent has linked from 192.0.2.7.');
    expect(of('seen')).toBe('Kestrel is enrolled: its agent has linked.');
  });

  it('says what to do when it came to nothing', () => {
    expect(of('expired')).toContain('Make another command');
    expect(of('cancelled')).toContain('cancelled');
  });
});

describe('the question for records', () => {
  const none: AuditFilters = { action: '', actor: '', drone_id: '', since: '', until: '' };

  it('has the filters that are set', () => {
    expect(auditQuery({ ...none, actor: 'Ann & Bob', drone_id: '7' })).toEqual({ actor: 'Ann & Bob', drone_id: 7 });
    expect(auditQuery(none)).toEqual({});
  });

  it('is the same for the download, without a page', () => {
    expect(auditCsvHref(none)).toBe('/api/v1/audit.csv');
    expect(auditCsvHref({ ...none, actor: 'Ann & Bob', drone_id: '7' })).toBe(
      '/api/v1/audit.csv?actor=Ann+%26+Bob&drone_id=7',
    );
  });
});
