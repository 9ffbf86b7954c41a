import { expect, it } from 'vitest';

import type { MaintenanceTask } from '../../src/link/statistics';
import { hoursWords, incidentWords, taskWords } from '../../src/words/statistics_words';

const TASK: MaintenanceTask = {
  id: 1,
  drone_id: 1,
  drone: 'Kestrel',
  title: 'Propellers',
  interval_h: 50,
  done_at: '2026-05-01T00:00:00Z',
  done_by: '',
  flown_h: 12,
  left_h: 38,
  state: 'good',
  may_change: true,
};

it('says hours as people read them', () => {
  expect([0, 0.8, 0.999, 12.0833, null].map(hoursWords)).toEqual(['0 min', '48 min', '1 h 00 min', '12 h 05 min', '–']);
});

it('says what is left, and by how much it is over', () => {
  expect(taskWords(TASK)).toBe('38 h 00 min left');
  expect(taskWords({ ...TASK, left_h: -2.5, state: 'due' })).toBe('Overdue by 2 h 30 min');
  expect(taskWords({ ...TASK, left_h: 0, state: 'due' })).toBe('Due now');
});

it('counts what happened', () => {
  expect(incidentWords({ holds: 2, link_losses: 1, critical_alerts: 0 })).toBe('2 holds, 1 link loss');
  expect(incidentWords({ holds: 0, link_losses: 0, critical_alerts: 0 })).toBe('');
});
