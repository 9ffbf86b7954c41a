import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { compared, isOwnValue } from '../../src/parameters/differences';
import {
  missionPlannerFile,
  NotAParameterFile,
  qgroundcontrolFile,
  readParameterFile,
} from '../../src/parameters/files';
import { NO_FACTS } from '../../src/parameters/facts';
import { isSame, readValue, tableOf, valueText, type Parameter } from '../../src/parameters/kinds';
import { groupList, groupsOf, isFound, linesOf, searchText } from '../../src/parameters/listing';
import { changes, EMPTY_TRAY, put, takenOut } from '../../src/parameters/tray';

const FLOAT = 9;
const INT8 = 2;
const INT32 = 6;
const one = (name: string, value: number, kind = FLOAT): Parameter => ({
  name,
  value: kind === FLOAT ? Math.fround(value) : value,
  kind,
});

describe('a value', () => {
  it.each([
    ['0.135', FLOAT, Math.fround(0.135), ''],
    [' -3 ', INT8, -3, ''],
    ['−3', INT8, -3, ''],
    ['0x1F', INT32, 31, ''],
    ['1e3', INT32, 1000, ''],
    ['', FLOAT, null, 'A number is missing.'],
    ['0,5', FLOAT, null, 'Write the decimals after a point.'],
    ['ten', FLOAT, null, 'This is not a number.'],
    ['1.5', INT8, null, 'Whole numbers only.'],
    ['200', INT8, null, 'Enter -128 to 127.'],
    ['1e39', FLOAT, null, 'This number is too large.'],
  ])('is read from %j of kind %i', (text, kind, value, fault) => {
    expect(readValue(text, kind)).toEqual({ value, fault });
  });

  it('is written as the shortest text that means it', () => {
    expect(valueText(Math.fround(0.135), FLOAT)).toBe('0.135');
    expect(valueText(110000, FLOAT)).toBe('110000');
    expect(valueText(-7, INT8)).toBe('-7');
  });

  it('comes back from its text', () => {
    fc.assert(
      fc.property(fc.float({ noNaN: true, noDefaultInfinity: true }), (value) => {
        expect(isSame(readValue(valueText(value, FLOAT), FLOAT).value!, value, FLOAT)).toBe(true);
      }),
    );
  });
});

const HERE = [
  one('RC1_MIN', 1000, 4),
  one('RC2_MIN', 1000, 4),
  one('RTL_ALT', 1500, INT32),
  one('SIMPLE', 0, INT8),
  one('WPNAV_SPEED', 1000),
  one('RTL_SPEED', 0, 4),
];

describe('the list', () => {
  it('has a group for each prefix, one for those of several numbers, and one for the rest', () => {
    const groups = groupsOf(HERE);
    expect(groupList(groups)).toEqual([
      { name: 'RC', count: 2 },
      { name: 'RTL', count: 2 },
      { name: 'Others', count: 2 },
    ]);
    const lines = linesOf(HERE, groups);
    expect(lines.map(({ key }) => key)).toEqual([
      'group RC',
      'RC1_MIN',
      'RC2_MIN',
      'group RTL',
      'RTL_ALT',
      'RTL_SPEED',
      'group Others',
      'SIMPLE',
      'WPNAV_SPEED',
    ]);
  });

  it('is searched by all the words, in the name with or without its strokes', () => {
    const text = searchText('WPNAV_SPEED_UP', NO_FACTS);
    expect(isFound(text, 'wpnav up')).toBe(true);
    expect(isFound(text, 'NAV_SPEED')).toBe(true);
    expect(isFound(text, 'wpnav down')).toBe(false);
    expect(isFound(text, '')).toBe(true);
  });
});

describe('files', () => {
  it.each([
    ['Mission Planner', missionPlannerFile],
    ['QGroundControl', qgroundcontrolFile],
  ] as const)('of %s hold every value', (format, write) => {
    const read = readParameterFile(write(HERE, 'Kestrel\n# no', '2026-11-22'));
    expect(read.format).toBe(format);
    expect(read.dropped).toEqual([]);
    expect(new Map(HERE.map(({ name, value }) => [name, value]))).toEqual(read.values);
  });

  it('are read with spaces, tabs, remarks and a mark at the beginning, and say what was dropped', () => {
    const read = readParameterFile(
      '\uFEFF#NOTE: from somewhere\r\nRTL_ALT\t2000\r\nWPNAV_SPEED 500 # slow\r\nRTL_ALT,2500\r\nwhat is this line\r\n',
    );
    expect([...read.values]).toEqual([
      ['RTL_ALT', 2500],
      ['WPNAV_SPEED', 500],
    ]);
    expect(read.dropped).toEqual([
      'Lines without a name and a number: line 5.',
      'Listed more than once (the last one counts): RTL_ALT.',
    ]);
  });

  it('of QGroundControl give the autopilot its own, and not the gimbal its name', () => {
    const read = readParameterFile('1\t1\tRTL_ALT\t2000\t6\n1\t154\tMNT_RC\t1\t6\n');
    expect([...read.values]).toEqual([['RTL_ALT', 2000]]);
    expect(read.dropped).toEqual(['1 of other components.']);
  });

  it.each([
    ['RTL_ALT,0x1F', 31],
    ['RTL_ALT 0X00ff', 255],
    ['1\t1\tRTL_ALT\t0x10\t6', 16],
    ['RTL_ALT\t2000,5', 2000.5],
    ['RTL_ALT 2000,5', 2000.5],
    ['1\t1\tRTL_ALT\t-0,25\t9', -0.25],
    ['RTL_ALT , 2000', 2000],
    ['RTL_ALT, 2000', 2000],
    ['RTL_ALT,2000 @READONLY', 2000],
    ['RTL_ALT 2000 @READONLY # by the maker', 2000],
    ['param set RTL_ALT 2000', 2000],
    ['param set-default -s RTL_ALT 0x7', 7],
  ])('have values as people and programs write them: %j', (line, value) => {
    const read = readParameterFile(`${line}\n`);
    expect([...read.values]).toEqual([['RTL_ALT', value]]);
    expect(read.dropped).toEqual([]);
  });

  it.each(['RTL_ALT,2000,5', 'RTL_ALT 0x', 'RTL_ALT 0x1G', 'RTL_ALT -0x1', 'RTL_ALT 0x123456789'])(
    'have no value that could be another: %j',
    (line) => expect(() => readParameterFile(line)).toThrow(NotAParameterFile),
  );

  it('of a start script give what it sets, and say what depends and what is left', () => {
    const read = readParameterFile(
      [
        '#!/bin/sh',
        '# @name Generic Quadcopter',
        '. ${R}etc/init.d/rc.mc_defaults',
        'param set-default CA_ROTOR_COUNT 4',
        'param set-default MC_ROLLRATE_P 0.14 # soft',
        'if param compare SYS_HITL 1',
        'then',
        '  param set-default EKF2_EN 0',
        'fi',
        'param set MAV_TYPE 2',
        'set MIXER quad_x',
      ].join('\n'),
    );
    expect(read.format).toBe('script');
    expect([...read.values]).toEqual([
      ['CA_ROTOR_COUNT', 4],
      ['MC_ROLLRATE_P', 0.14],
      ['MAV_TYPE', 2],
    ]);
    expect(read.dropped).toEqual(['1 that the script sets under a condition only.', '5 other lines of the script.']);
    expect(() => readParameterFile('if true\nthen\nparam set A 1\nfi')).toThrow('under conditions only');
  });

  it.each([
    '',
    '{"fileType": "Plan"}',
    'QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t52\t4\t0\t1\n',
    'a,1\nsome\nother\ntext here today\n',
    '1\t154\tMNT_RC\t1\t6\n',
  ])('that are none are refused: %j', (text) => {
    expect(() => readParameterFile(text)).toThrow(NotAParameterFile);
  });
});

describe('a comparison', () => {
  it('tells what differs, what the drone does not have, and what is of one machine only', () => {
    const found = compared(tableOf(HERE), [
      ['RTL_ALT', 3000],
      ['WPNAV_SPEED', 1000],
      ['RC1_MIN', 980],
      ['Q_ENABLE', 1],
    ]);
    expect(found.differences).toEqual([
      { name: 'RC1_MIN', kind: 4, here: 1000, there: 980, isOwn: true },
      { name: 'RTL_ALT', kind: INT32, here: 1500, there: 3000, isOwn: false },
    ]);
    expect(found).toMatchObject({ same: 1, unknownHere: ['Q_ENABLE'], onlyHere: 3 });
  });

  it('holds numbers for the same that are the same for the drone', () => {
    expect(compared(tableOf([one('ATC_RAT_RLL_P', 0.135)]), [['ATC_RAT_RLL_P', 0.135]]).same).toBe(1);
  });

  it.each([
    'COMPASS_OFS_X',
    'COMPASS_DEV_ID2',
    'INS_ACCOFFS_X',
    'INS_GYR2OFFS_Z',
    'INS_ACC_ID',
    'INS4_ACCSCAL_X',
    'STAT_BOOTCNT',
    'SYSID_THISMAV',
    'RC12_TRIM',
    'AHRS_TRIM_X',
    'CAL_MAG0_ID',
    'BARO1_DEVID',
  ])('takes %s for the machine itself', (name) => expect(isOwnValue(name)).toBe(true));
  it.each(['COMPASS_USE', 'INS_GYRO_FILTER', 'RC7_OPTION', 'ATC_RAT_RLL_P', 'BATT_CAPACITY', 'SERVO1_FUNCTION'])(
    'takes %s for a setting',
    (name) => expect(isOwnValue(name)).toBe(false),
  );
});

describe('the tray', () => {
  it('keeps what differs, forgets what was taken back, and what the drone has by now', () => {
    const table = tableOf(HERE);
    let tray = put(EMPTY_TRAY, table, 'RTL_ALT', 2000);
    tray = put(tray, table, 'WPNAV_SPEED', 500);
    tray = put(tray, table, 'NOT_THERE', 1);
    expect(changes(tray, table)).toEqual([
      { name: 'RTL_ALT', kind: INT32, before: 1500, after: 2000 },
      { name: 'WPNAV_SPEED', kind: FLOAT, before: 1000, after: 500 },
    ]);
    expect([...put(tray, table, 'RTL_ALT', 1500).keys()]).toEqual(['WPNAV_SPEED']);
    expect([...takenOut(tray, 'WPNAV_SPEED').keys()]).toEqual(['RTL_ALT']);
    const later = tableOf(HERE.map((each) => (each.name === 'RTL_ALT' ? one('RTL_ALT', 2000, INT32) : each)));
    expect(changes(tray, later).map(({ name }) => name)).toEqual(['WPNAV_SPEED']);
  });
});
