import { expect, it } from 'vitest';

import { ACTION_KINDS, detailWords, eventWords, isToldInWords } from '../../src/words/audit_words';

it('names what has a name, and leaves its id out', () => {
  const detail = { token_id: 4, token: 'Night script', user_id: 3, user: 'admin', scopes: 'watch', limits: { m: 60 } };
  expect(detailWords(detail)).toBe('token: Night script, user: admin, scopes: watch, limits: {"m":60}');
});

it('keeps an id that stands alone', () => {
  expect(detailWords({ flight_id: 9 })).toBe('flight id: 9');
});

it('says moments as everywhere, yes or no, and nothing of what has no value', () => {
  const detail = { user: 'alice', until: '2026-11-24T23:50:13.084084+00:00', may_arm: false, max_height_m: null };
  expect(detailWords(detail)).toBe('user: alice, until: 2026-11-24 23:50, may arm: no');
});

it('tells a take by names, with its reason, and without what is for programs', () => {
  const detail = {
    reason: 'traffic',
    result: 'done',
    epoch: 4,
    holder: 'root',
    taken_from: 'alice',
    assistant: null,
    view_taken: true,
    took_ms: 1476,
  };
  expect(eventWords('control.take', detail)).toEqual({
    sentence: 'took control from alice',
    more: 'reason: traffic, view taken: yes',
  });
});

it('leaves out the number of what is named', () => {
  const detail = { drone: 'Osprey', enrolment_id: 3 };
  expect(eventWords('enrolment.used', detail)).toEqual({ sentence: 'enrolled Osprey', more: '' });
});

it('says that something was refused, and why', () => {
  const detail = { reason: '', result: 'refused', code: 'holds-another', took_ms: 2 };
  expect(eventWords('control.acquire', detail)).toEqual({
    sentence: 'took control: refused (holds another)',
    more: '',
  });
});

it('tells a command with its result and its figures', () => {
  const detail = { command: 'goto', lat: 47.1, result: 'accepted', way: 'operation', operation: '7' };
  expect(eventWords('command.given', detail)).toEqual({ sentence: 'commanded goto: accepted', more: 'lat: 47.1' });
});

it('tells longer work at its beginning and its end', () => {
  const began = { operation: '7', work: 'plan_upload', kind: 'mission', hash: 'ab' };
  expect(eventWords('operation.began', began)).toEqual({ sentence: 'began: plan to the drone', more: 'kind: mission' });
  const ended = { operation: '7', work: 'plan_upload', state: 'done', words: '41 items, read back' };
  expect(eventWords('operation.ended', ended).sentence).toBe('ended: plan to the drone: 41 items, read back');
});

it('makes words of an action that it does not know', () => {
  expect(eventWords('kite.flown_high', { kite: 'red' })).toEqual({ sentence: 'kite flown high', more: 'kite: red' });
  expect(isToldInWords('kite.flown_high')).toBe(false);
});

it('has each kind once', () => {
  const kinds = ACTION_KINDS.map(([kind]) => kind);
  expect(new Set(kinds).size).toBe(kinds.length);
});
