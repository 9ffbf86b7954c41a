import { beforeEach, describe, expect, it, vi } from 'vitest';

import { ControllerActions } from '../src/controller_actions';
import {
  FIRST_LIMITS,
  isControllerName,
  limitsFault,
  readSettings,
  startOf,
  type ControllerLimits,
} from '../src/link/controllers';
import { Findings, MAX_FINDINGS, newestFirst, type Finding } from '../src/link/findings';
import type { Operation } from '../src/link/operation_types';
import type { Rest } from '../src/link/rest';
import {
  confidenceWords,
  findingTitle,
  letterOf,
  rangeWords,
  startWords,
  timeLeft,
} from '../src/words/controller_words';
import { A_DRONE } from './link/fakes';

const asked = vi.hoisted(() => ({ questions: [] as { title: string; text: string }[], answer: true }));
vi.mock('../src/confirmation.svelte', () => ({
  ask: (question: { title: string; text: string }) => {
    asked.questions.push(question);
    return Promise.resolve(asked.answer ? {} : null);
  },
}));

const finding = (number: number, letter = 'K'): Finding => ({
  number,
  at: new Date(Date.UTC(2026, 0, 1, 12, 0, number)).toISOString(),
  letter,
  confidence: 0.914,
  lat_deg: 47,
  lon_deg: 8,
  thumbnail: '',
});
const operation = (done: number, total: number): Operation => ({ id: '7', done, total }) as unknown as Operation;

describe('limits', () => {
  it('of the first choice are good, and what the tower would take without any', () => {
    expect(limitsFault(FIRST_LIMITS)).toBe('');
    expect(startOf('scripted', FIRST_LIMITS, {})).toEqual({
      controller: 'scripted',
      max_speed_m_s: 5,
      min_height_m: 2,
      max_height_m: 30,
      max_distance_m: 100,
      may_take_off: false,
      for_s: 300,
      settings: {},
    });
  });

  it.each<[Partial<ControllerLimits>, RegExp]>([
    [{ maxSpeedMS: 0.4 }, /out of range/],
    [{ maxSpeedMS: 15.1 }, /out of range/],
    [{ minHeightM: 0.5 }, /out of range/],
    [{ maxHeightM: 501 }, /out of range/],
    [{ maxDistanceM: Number.NaN }, /out of range/],
    [{ minutes: 11 }, /out of range/],
    [{ minHeightM: 30 }, /below the greatest/],
  ])('are refused: %j', (changed, fault) => {
    expect(limitsFault({ ...FIRST_LIMITS, ...changed })).toMatch(fault);
  });

  it('at a bound that a unit has rounded stay within what the tower takes', () => {
    const most = { ...FIRST_LIMITS, maxHeightM: 500.0000001 };
    expect(limitsFault(most)).toBe('');
    expect(startOf('x', most, {}).max_height_m).toBe(500);
  });

  it.each([
    ['scripted', true],
    ['a-b_2', true],
    ['', false],
    ['Scripted', false],
    ['/opt/x.py', false],
  ])('name %j: %s', (name, isOne) => {
    expect(isControllerName(name)).toBe(isOne);
  });
});

describe('settings', () => {
  it('are one a line, numbers as numbers', () => {
    expect(readSettings('letter=K\n search_height_m = 12.5 \n\npoints=47.1,8.2;47.2,8.3\nnote=a=b\nempty=')).toEqual({
      settings: { letter: 'K', search_height_m: 12.5, points: '47.1,8.2;47.2,8.3', note: 'a=b', empty: '' },
      fault: '',
    });
    expect(readSettings('')).toEqual({ settings: {}, fault: '' });
  });

  it.each([
    ['letter', /name=value/],
    ['=K', /name=value/],
    ['Letter=K', /name=value/],
    ['a=1\na=2', /twice/],
    [`a=${'x'.repeat(401)}`, /too long/],
    [Array.from({ length: 33 }, (_, at) => `s${at}=1`).join('\n'), /too many/],
  ])('are refused: %j', (text, fault) => {
    expect(readSettings(text)).toEqual({ settings: null, fault: expect.stringMatching(fault) as string });
  });
});

describe('the start', () => {
  let begun: unknown[];
  let actions: ControllerActions;
  beforeEach(() => {
    begun = [];
    asked.questions = [];
    asked.answer = true;
    const operations = {
      start: (...request: unknown[]) => {
        begun.push(request);
        return Promise.resolve(operation(0, 0));
      },
      cancel: (id: string) => {
        begun.push(id);
        return Promise.resolve();
      },
    };
    actions = new ControllerActions(operations);
  });
  const start = startOf('challenge', { ...FIRST_LIMITS, mayTakeOff: true }, { letter: 'K' });

  it('asks by the name of the drone, and requests what was chosen', async () => {
    await actions.start(A_DRONE, start, 'metric');
    expect(asked.questions[0]?.title).toBe('Let challenge fly Heron?');
    expect(begun).toEqual([['POST', '/drones/{drone_id}/controller', { path: { drone_id: 1 }, body: start }]]);
  });

  it('requests nothing without consent', async () => {
    asked.answer = false;
    expect(await actions.start(A_DRONE, start, 'metric')).toBeNull();
    expect(begun).toEqual([]);
  });

  it('stops without a question', async () => {
    await actions.stop(operation(1, 60));
    expect(begun).toEqual(['7']);
    expect(asked.questions).toEqual([]);
  });
});

describe('words', () => {
  it('say what will happen, what bounds it, and what ends it', () => {
    const words = startWords('Heron', startOf('scripted', { ...FIRST_LIMITS, mayTakeOff: true }, {}), 'metric');
    for (const part of [
      'scripted flies Heron',
      '05:00',
      'arm the motors',
      '5.0 m/s',
      '2.0 m to 30.0 m',
      '100 m',
      'an admin who takes control',
    ])
      expect(words).toContain(part);
    expect(startWords('Heron', startOf('scripted', FIRST_LIMITS, {}), 'metric')).toContain(
      'neither arms nor takes off',
    );
  });

  it('are in the units of the user', () => {
    expect(rangeWords([1, 500], 'imperial', 'height')).toBe('From 3 ft to 1640 ft.');
    expect(rangeWords([5 / 60, 10], 'metric', undefined)).toBe('From 00:05 to 10:00.');
  });

  it('tell the time that is left once the agent reports it', () => {
    expect(timeLeft(operation(0, 0))).toBe('');
    expect(timeLeft(operation(15, 300))).toBe('04:45 left');
    expect(timeLeft(operation(310, 300))).toBe('00:00 left');
  });

  it('name what was found', () => {
    expect([findingTitle(finding(1)), letterOf(finding(1)), confidenceWords(finding(1))]).toEqual([
      'Target K',
      'K',
      'confidence 91 %',
    ]);
    expect([findingTitle(finding(1, '')), letterOf(finding(1, ''))]).toEqual(['Target without a letter', '?']);
  });
});

describe('findings', () => {
  it('are newest first, once each, and bounded', () => {
    const list = newestFirst([finding(2), finding(1)], [finding(3), finding(2)]);
    expect(list.map(({ number }) => number)).toEqual([3, 2, 1]);
    const many = Array.from({ length: 30 }, (_, at) => finding(at));
    expect(newestFirst([], many)).toHaveLength(MAX_FINDINGS);
    expect(newestFirst([], many)[0]?.number).toBe(29);
  });

  it('of the live channel and of the read are joined, for each drone alone, until the user signs out', async () => {
    const rest = { call: () => Promise.resolve([finding(1)]) } as unknown as Pick<Rest, 'call'>;
    const findings = new Findings(rest);
    findings.take({ type: 'finding', drone_id: 4, finding: finding(2) });
    findings.take({ type: 'finding', drone_id: 5, finding: finding(9) });
    await findings.read(4);
    expect(
      findings.all
        .get()
        .get(4)
        ?.map(({ number }) => number),
    ).toEqual([2, 1]);
    expect(
      findings.all
        .get()
        .get(5)
        ?.map(({ number }) => number),
    ).toEqual([9]);
    findings.forget();
    expect(findings.all.get().size).toBe(0);
  });
});
