import { describe, expect, it } from 'vitest';

import { type AlertNote, noteOf, optionsOf, pageToFocus } from '../../service_worker/alert_note';

const NOTE: AlertNote = {
  title: 'hawk: Lost in the air',
  body: 'Critical: hawk is lost in the air.',
  severity: 'critical',
  happening: 'opened',
  tag: 'alert-77',
  path: '#/drone/5',
};

describe('a note that was pushed', () => {
  it('is read as the tower wrote it', () => {
    expect(noteOf(JSON.stringify(NOTE))).toEqual(NOTE);
  });

  it.each(['', 'no JSON', 'null', '[]', '"text"', '{"title": "x"}', JSON.stringify({ ...NOTE, tag: 5 })])(
    'says so when it cannot be read: %s',
    (text) => {
      expect(noteOf(text)).toMatchObject({ title: 'Control Tower', path: '#/' });
    },
  );

  it.each(['https://elsewhere.example.org/', '//elsewhere.example.org', 'javascript:alert(1)', '/api/v1/me'])(
    'leads to no other address: %s',
    (path) => {
      expect(noteOf(JSON.stringify({ ...NOTE, path })).path).toBe('#/');
    },
  );
});

describe('the notification', () => {
  it('of a critical alert stays until somebody sees it', () => {
    expect(optionsOf(NOTE, 'icon')).toMatchObject({ tag: 'alert-77', requireInteraction: true, silent: false });
    expect(optionsOf({ ...NOTE, severity: 'warning' }, 'icon').requireInteraction).toBe(false);
  });

  it('of the end replaces it without a noise', () => {
    const end = optionsOf({ ...NOTE, happening: 'closed' }, 'icon');
    expect(end).toMatchObject({ tag: 'alert-77', requireInteraction: false, silent: true, renotify: false });
  });

  it('of what nobody answered makes a noise again', () => {
    expect(optionsOf(NOTE, 'icon').renotify).toBe(false);
    expect(optionsOf({ ...NOTE, happening: 'unanswered' }, 'icon').renotify).toBe(true);
  });
});

describe('a click', () => {
  const scope = 'https://tower.example.org/console/';
  const page = (path: string, focused = false, visibilityState = 'hidden') => ({
    url: new URL(path, scope).href,
    focused,
    visibilityState,
  });

  it('brings the console to the front that was seen last', () => {
    const [hidden, shown, first] = [page('#/a'), page('#/b', false, 'visible'), page('#/c', true, 'visible')];
    expect(pageToFocus([hidden, shown, first], scope)).toBe(first);
    expect(pageToFocus([hidden, shown], scope)).toBe(shown);
    expect(pageToFocus([hidden], scope)).toBe(hidden);
  });

  it('leaves other pages of the server alone', () => {
    expect(pageToFocus([page('/elsewhere')], scope)).toBeNull();
    expect(pageToFocus([], scope)).toBeNull();
  });
});
