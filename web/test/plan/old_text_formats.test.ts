/** Text files of ground stations: waypoints in all versions, fences, outlines and rally points. */

import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { NotAPlanFile } from '../../src/plan/formats/plan_file';
import { writeQgcPlan } from '../../src/plan/formats/qgc_plan';
import { writeWaypoints } from '../../src/plan/formats/waypoint_file';
import { degOf, spotOf, type Spot } from '../../src/plan/plan_types';
import { open, rows, KINDS, TAKEOFF, WAYPOINT, JUMP_TO_SECOND } from './opened_files';
import { drawnPlan, spot } from './plan_arbitraries';
import { examples } from '../examples';

describe('a waypoint file', () => {
  const row = '\t0\t3\t16\t2\t0\t0\t0\t47.3982\t8.5441\t40\t1';
  const HOME = '0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1';
  const JUMP = '\t0\t2\t177\t2\t3\t0\t0\t0\t0\t0\t1';

  it('has blanks or tabs, any ends of lines, a mark before it, comments and numbers with a comma', () => {
    const lines = ['QGC WPL 110', HOME, `1${row}`, `2${row}`, `3${JUMP}`];
    const { plan } = open(lines.join('\n'));
    expect(rows(plan, 'mission')).toEqual([WAYPOINT, WAYPOINT, JUMP_TO_SECOND]);
    for (const text of [
      lines.join('\r\n'),
      lines.join('\r'),
      `\uFEFF${lines.join('\n')}\n\n`,
      lines.join('\n').replaceAll('\t', '   '),
      lines.join('\n').replaceAll('\t', ','),
      lines.join('\n').replaceAll('.', ','),
      `QGC WPL 110\n# of today\n\n${lines.slice(1).join('\n  # another\n')}`,
    ]) {
      const again = open(text);
      expect(again.dropped).toEqual([]);
      expect(KINDS.map((kind) => rows(again.plan, kind))).toEqual(KINDS.map((kind) => rows(plan, kind)));
      expect(again.plan.home).toEqual(plan.home);
    }
  });

  it('with broken numbers is taken as it stands, and says so', () => {
    const { plan, dropped } = open(['QGC WPL 110', HOME, `1${row}`, `7${row}`, `7${JUMP}`].join('\n'));
    expect(rows(plan, 'mission')).toEqual([WAYPOINT, WAYPOINT, JUMP_TO_SECOND]);
    expect(dropped).toEqual(['Line 4 is numbered 7, not 2: the lines were taken as they stand, and jumps count them.']);
  });

  it('that begins at 1 has left home out, and its jumps count it nevertheless', () => {
    const { plan, dropped } = open(['QGC WPL 110', `1${row}`, `2${row}`, `3${JUMP}`].join('\n'));
    expect(rows(plan, 'mission')).toEqual([WAYPOINT, WAYPOINT, JUMP_TO_SECOND]);
    expect(plan.home).toBeNull();
    expect(dropped).toHaveLength(1);
  });

  it('has home in line 0 whatever its frame and command, and says so', () => {
    for (const line of [HOME.replace('\t0\t16', '\t3\t16'), HOME.replace('\t0\t16', '\t0\t0')]) {
      const { plan } = open(['QGC WPL 110', line, `1${row}`].join('\n'));
      expect(rows(plan, 'mission')).toEqual([WAYPOINT]);
      expect(plan.home?.spot).toEqual(spotOf(47.3977, 8.5456));
    }
    const other = HOME.replace('\t0\t16', '\t3\t16');
    expect(() => open(['QGC WPL 110', HOME].join('\n'))).toThrow('nothing to fly');
    expect(open(['QGC WPL 110', other, `1${row}`].join('\n')).dropped).toEqual([
      'Line 2 is home in such files, and was taken for it, though its frame is 3.',
    ]);
  });

  it('of version 120 has no home, and jumps count from its first line', () => {
    const { plan, dropped } = open(
      ['QGC WPL 120', `0${row}`, `1${row}`, `2${JUMP.replace('177\t2', '177\t1')}`].join('\n'),
    );
    expect(rows(plan, 'mission')).toEqual([WAYPOINT, WAYPOINT, JUMP_TO_SECOND]);
    expect(dropped).toEqual([]);
  });

  it('of version 100 has its fields in another order', () => {
    const lines = ['QGC WPL 100', '0 0 25 0 0 0 0 1 8.5456 47.3977 488 0 1', '1 3 24 0 0 15 0 0 8.5456 47.3977 25 0 1'];
    const { plan } = open(lines.join('\n'));
    expect(rows(plan, 'mission')).toEqual([TAKEOFF]);
    expect(plan.home).toEqual({ spot: spotOf(47.3977, 8.5456), altM: 488 });
    expect(() => open('QGC WPL 100\n0 0 77 0 0 0 0 1 8.5 47.3 488 0 1')).toThrow('action 77');
  });

  it('of MAVProxy has a fence or rally points without home, and nothing is missed', () => {
    const corner = (index: number, latDeg: number): string => `${index} 0 0 5001 3 0 0 0 ${latDeg} 8.${index} 0 1`;
    const { plan, dropped } = open(['QGC WPL 110', corner(0, 47.1), corner(1, 47.2), corner(2, 47.1)].join('\n'));
    expect(rows(plan, 'fence')).toHaveLength(3);
    expect(dropped).toEqual([]);
  });

  it('says where a jump goes to nothing', () => {
    const { dropped } = open(['QGC WPL 110', HOME, `1${row}`, `2${JUMP.replace('177\t2', '177\t9')}`].join('\n'));
    expect(dropped).toEqual(['The jump in item 2 goes to nothing: choose where to.']);
  });
});

describe('a text file of places', () => {
  const line = (one: Spot): string => `${degOf(one.latE7).toFixed(7)} ${degOf(one.lonE7).toFixed(7)}`;
  const spots = fc.uniqueArray(spot, {
    minLength: 4,
    maxLength: 12,
    selector: ({ latE7, lonE7 }) => `${latE7} ${lonE7}`,
  });
  const given = spots.filter((all) => all.every(({ latE7, lonE7 }) => latE7 !== 0 || lonE7 !== 0));

  it('is a fence: return point, border, and its first corner again or not', () => {
    fc.assert(
      fc.property(given, fc.boolean(), fc.constantFrom(' ', '\t', ', '), ([home, ...border], isClosed, between) => {
        const all = [home!, ...border, ...(isClosed ? [border[0]!] : [])];
        const text = `#saved by a ground station\r\n${all.map(line).join('\r\n').replaceAll(' ', between)}\r\n`;
        const { plan, dropped, areas, format } = open(text, 'fence.fen');
        expect(format).toBe('fence file');
        expect([dropped, areas]).toEqual([[], []]);
        expect(plan.fence.returnPoint?.spot).toEqual(home);
        expect(plan.fence.shapes).toMatchObject([{ shape: 'polygon', inclusion: true, corners: border }]);
      }),
    );
  });

  it('is an outline where the border ends where the file begins, or its name says so', () => {
    fc.assert(
      fc.property(given, (border) => {
        const closed = [...border, border[0]!].map(line).join('\n');
        for (const read of [open(closed, 'field.txt'), open(border.map(line).join('\n'), 'field.POLY')]) {
          expect(read.format).toBe('polygon file');
          expect(read.areas.map(({ corners }) => corners)).toEqual([border]);
          expect(read.plan.fence.shapes).toEqual([]);
        }
      }),
    );
  });

  it('has several outlines with a name each', () => {
    const one = ['47.1 8.1', '47.2 8.1', '47.2 8.2', '47.1 8.1'];
    const text = ['#saved', 'Name:North', 'Color:Color [Red]', ...one, 'Name:South', 'Color:Color [Blue]', ...one];
    expect(open(text.join('\n'), 'regions.poly').areas).toHaveLength(2);
  });

  it('has numbers of a computer set to German', () => {
    const { areas } = open('47,1 8,1\n47,2 8,1\n47,2 8,2\n47,1 8,1\n');
    expect(areas.map(({ corners }) => corners)).toEqual([[spotOf(47.1, 8.1), spotOf(47.2, 8.1), spotOf(47.2, 8.2)]]);
  });

  it('is rally points: heights above home unless the flags name another frame, and what is lost is said', () => {
    const { plan, dropped, format } = open(
      [
        '#saved by a ground station',
        'RALLY\t47.1\t8.1\t30.5\t0\t0\t0',
        'RALLY 47.2\t8.2\t40.000000\t15.000000\t90.000000\t3',
        'rally 47.3 8.3 540 0 0 4',
        'RALLY 47.4 8.4 60 0 0 28',
        'RALLY 47.5 8.5 60 0 0 20',
      ].join('\n'),
    );
    expect(format).toBe('rally file');
    expect(plan.rally.map(({ frame, heightM }) => [frame, heightM])).toEqual([
      [3, 30.5],
      [3, 40],
      [0, 540],
      [10, 60],
      [3, 60],
    ]);
    expect(dropped).toEqual([
      'Rally point 2 was taken without the height to break off at (15 m), the direction to land in (90), "only with the wind", "land at once".',
      'Rally point 5: its height above the origin was taken as one above home.',
    ]);
  });

  it.each([
    ['47.1 8.1\n47.2 8.1\n47.3 8.1', 'it needs three'],
    ['47.1 8.1\n47.2 8.1 5\n47.3 8.1', 'Line 2 has 3 fields'],
    ['147.1 8.1\n47.2 8.1\n47.3 8.1', 'Line 1: that is not a place on earth'],
    ['RALLY 47.1 8.1 30', 'Line 1 is not "RALLY" with six numbers'],
    ['RALLY 47.1 8.1 30 0 0 x', '"x" is not a number'],
  ])('that is damaged is refused in words: %j', (text, words) => {
    expect(() => open(text)).toThrow(NotAPlanFile);
    expect(() => open(text)).toThrow(words);
  });
});

it('what was opened from an old file is kept by the files that are written today', () => {
  fc.assert(
    fc.property(drawnPlan, (plan) => {
      fc.pre(plan.items.length > 0);
      // As in version 120: no home, jumps from 0.
      const lines = writeWaypoints(plan).text.split('\n').slice(2, -1);
      const old = lines.map((text, at) => {
        const fields = text.split('\t');
        if (fields[3] === '177') fields[4] = `${Number(fields[4]) - 1}`;
        return [`${at}`, ...fields.slice(1)].join('   ');
      });
      const read = open(['QGC WPL 120', ...old].join('\r\n'));
      expect(rows(read.plan, 'mission')).toEqual(rows(plan, 'mission'));
      for (const again of [writeQgcPlan(read.plan), writeWaypoints(read.plan)]) {
        expect(rows(open(again.text).plan, 'mission')).toEqual(rows(plan, 'mission'));
      }
    }),
  );
});

it('any text behind the beginning of such a file is read or refused, never worse', () => {
  const starts = fc.constantFrom('QGC WPL 100\n', 'QGC WPL 120\n', 'RALLY ', 'Name:a\n', '47.1 8.1\n', '#saved\n');
  const numbers = fc.array(fc.oneof(fc.double().map(String), fc.constantFrom('\n', ' ', '\t', ',', 'nan')), {
    maxLength: 40,
  });
  fc.assert(
    fc.property(
      starts,
      fc.oneof(
        fc.string(),
        numbers.map((all) => all.join(' ')),
      ),
      (start, rest) => {
        try {
          open(start + rest);
        } catch (error) {
          expect(error).toBeInstanceOf(NotAPlanFile);
        }
      },
    ),
    { numRuns: examples(100, 600) },
  );
});
