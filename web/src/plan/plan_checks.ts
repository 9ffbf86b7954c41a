/**
 * Checks before a plan is sent to a drone, each in words that name the item. An error would be refused by the drone or
 * fly it into danger; a warning may be intended.
 */

import { plural, t } from '../languages/text';
import { FAMILIES } from '../link/generated/autopilots.gen';
import { CMD, commandWords, isKnownTo, isOpenTo, specOf, type AutopilotKind } from './catalogue';
import { FenceCheck, type Breach } from './fence_crossings';
import type { Firmware } from './firmware';
import { itemFaults, rallyFaults, shapeFaults } from './field_checks';
import { flownPath, heightAboveHomeM, type FlownPath, type GroundAt } from './flown_path';
import { distanceM } from './ground';
import { groundFindings, type GroundLimits } from './over_ground';
import { MAX_ITEMS, type PartId, type Plan, type PlanKind } from './plan_types';
import { itemsOf } from './wire_items';

export interface Finding {
  readonly severity: 'error' | 'warning';
  readonly kind: PlanKind;
  /** The item, shape or point concerned; null: the whole plan. */
  readonly part: PartId | null;
  readonly words: string;
}

/** How many findings a tab shows: errors alone if there are any. */
export function checksBadge(findings: readonly Finding[]): {
  badge: number;
  tone: 'danger' | 'warning';
  counts: string;
} {
  const errors = findings.filter(({ severity }) => severity === 'error').length;
  const badge = errors || findings.length;
  const counts =
    errors > 0
      ? plural(badge, { one: 'error', other: 'errors' })
      : plural(badge, { one: 'warning', other: 'warnings' });
  return { badge, tone: errors > 0 ? 'danger' : 'warning', counts };
}

export interface CheckLimits {
  readonly autopilot: AutopilotKind;
  readonly firmware?: Firmware;
  /** Above home; null: no limit. */
  readonly highestM: number | null;
  readonly farthestM: number | null;
  /** Where the tower has elevation. */
  readonly ground?: GroundLimits & { readonly at: GroundAt };
}

/** Waypoints closer than this are one: a copter counts a waypoint as reached from 2 m away. */
const SAME_PLACE_M = 0.5;

const BREACH_WORDS: Record<Breach, string> = {
  forbidden: t('goes where the fence forbids it'),
  outside: t('leaves the fence'),
  'outside-one': t('leaves one of the areas of the fence, which is a breach where all of them count'),
};

const metres = (value: number): string => `${Math.round(value)} m`;

export function planChecks(plan: Plan, limits: CheckLimits, path: FlownPath = flownPath(plan)): Finding[] {
  const findings: Finding[] = [];
  const { items } = plan;
  const named = (seq: number): string =>
    t('Item {seq} ({command})', { seq: seq + 1, command: commandWords(items[seq]!.command) });
  const addFinding = (severity: Finding['severity'], seq: number | null, words: string): void => {
    const text = seq === null ? words : `${named(seq)} ${words}`;
    findings.push({ severity, kind: 'mission', part: seq === null ? null : items[seq]!.id, words: text });
  };

  for (const kind of ['mission', 'fence', 'rally'] as const) {
    const count = itemsOf(plan, kind).length;
    const [autopilot, room] = [FAMILIES[limits.autopilot].label, FAMILIES[limits.autopilot].room[kind]];
    if (count > MAX_ITEMS) {
      const words = t('The {kind} has {count} items; a drone takes {maxItems} at most.', {
        kind,
        count,
        maxItems: MAX_ITEMS,
      });
      findings.push({ severity: 'error', kind, part: null, words });
    } else if (count > room) {
      const words = t(
        'The {kind} has {count} items; {autopilot} has room for {room} on the usual boards. An autopilot with less space refuses all of them.',
        { kind, count, autopilot, room },
      );
      findings.push({ severity: 'warning', kind, part: null, words });
    }
  }
  for (const [seq, item] of items.entries()) {
    for (const fault of itemFaults(item, items.length))
      addFinding('error', seq, t('is not right. {fault}', { fault: fault.words }));
    const spec = specOf(item.command);
    if (!spec) addFinding('warning', seq, t('is not known here: nothing of it is checked.'));
    else if (!isKnownTo(spec, limits.autopilot)) {
      addFinding(
        'error',
        seq,
        t('is not a part of missions of {families}.', { families: FAMILIES[limits.autopilot].label }),
      );
    } else if (limits.firmware?.lacks.has(item.command)) {
      const words = `${FAMILIES[limits.autopilot].label} ${limits.firmware.words}`;
      addFinding('error', seq, t('is not a part of missions of {words}; later releases have it.', { words }));
    }
    for (const one of spec?.params ?? []) {
      if (item.params[one.at] !== null || !one.mayBeOpen || isOpenTo(item.command, one, limits.autopilot)) continue;
      const name = one.name.split(',')[0]!;
      addFinding(
        'error',
        seq,
        t('is not right. {name}: {families} needs a number.', { name, families: FAMILIES[limits.autopilot].label }),
      );
    }
  }
  checkCourse(plan, path, addFinding);
  checkPlaces(plan, limits, path, addFinding);
  if (limits.ground) findings.push(...groundFindings(plan, path, limits.ground.at, limits.ground));
  findings.push(...fenceFindings(plan, path, named));
  for (const [at, point] of plan.rally.entries()) {
    for (const fault of rallyFaults(point)) {
      findings.push({
        severity: 'error',
        kind: 'rally',
        part: point.id,
        words: t('Rally point {at} is not right. {fault}', { at: at + 1, fault }),
      });
    }
  }
  return findings;
}

type AddFinding = (severity: Finding['severity'], seq: number | null, words: string) => void;

const isTakeOff = (command: number): boolean => command === CMD.TAKEOFF || command === CMD.VTOL_TAKEOFF;
const isEnd = (command: number): boolean => command === CMD.RETURN || command === CMD.LAND || command === CMD.VTOL_LAND;

/** Checks take-off, jumps, unreachable items, and the ending. */
function checkCourse(plan: Plan, path: FlownPath, addFinding: AddFinding): void {
  const { items } = plan;
  if (items.length === 0) return;
  const seqOf = new Map(items.map((item, seq) => [item.id, seq]));
  const first = items.findIndex((item) => specOf(item.command)?.flies);
  const takeOff = items.findIndex((item) => isTakeOff(item.command));
  if (takeOff < 0)
    addFinding('warning', null, t('There is no take-off: the drone must be in the air when the mission begins.'));
  else if (takeOff > first)
    addFinding('warning', takeOff, t('comes after item {first}, which flies somewhere already.', { first: first + 1 }));
  for (const [seq, item] of items.entries()) {
    const target = item.command === CMD.JUMP && item.jumpTo !== null ? seqOf.get(item.jumpTo) : undefined;
    if (target === undefined) continue;
    const [from, to] = [Math.min(seq, target), Math.max(seq, target)];
    const flies = items.slice(from, to + 1).some((one) => specOf(one.command)?.flies);
    if (target === seq) addFinding('error', seq, t('jumps to itself.'));
    else if (target < seq && !flies)
      addFinding('error', seq, t('goes round to item {target} without flying anywhere.', { target: target + 1 }));
    else if (target < seq && (item.params[1] ?? 0) < 0) {
      addFinding(
        'warning',
        seq,
        t('goes back to item {target} for ever: nothing after it is flown.', { target: target + 1 }),
      );
    }
  }
  const { steps, ending, last } = path.order;
  if (ending === 'too-long' && last !== null)
    addFinding('error', last, t('is in a round of jumps that does not end in any flight.'));
  const reached = new Set(steps);
  const dead = items.findIndex((item, seq) => !reached.has(seq) && item.command !== CMD.JUMP);
  if (dead >= 0 && ending !== 'too-long') addFinding('warning', dead, t('is never reached.'));
  const end = last === null ? undefined : items[last];
  if (ending === 'ends' && end && !isEnd(end.command)) {
    addFinding('warning', last, t('is the last: the drone stays there, in the air, until somebody commands it.'));
  }
}

/** Checks heights, distances and repeated places. */
function checkPlaces(plan: Plan, limits: CheckLimits, path: FlownPath, addFinding: AddFinding): void {
  const { items, home } = plan;
  if (!home && items.length > 0) {
    addFinding(
      'warning',
      null,
      t('There is no planned home: distances from it and heights above sea level are not checked.'),
    );
  }
  const isFound = new Set<number>();
  for (const leg of path.legs) {
    const item = items[leg.seq]!;
    if (isFound.has(leg.seq) || item.command === CMD.RETURN) continue;
    isFound.add(leg.seq);
    const away = home ? distanceM(home.spot, leg.to) : 0;
    if (limits.farthestM !== null && away > limits.farthestM) {
      addFinding(
        'error',
        leg.seq,
        t('is {away} from home; {farthest} is the most.', { away: metres(away), farthest: metres(limits.farthestM) }),
      );
    }
    const height = heightAboveHomeM(plan, item, limits.ground?.at);
    if (height === null) continue;
    if (limits.highestM !== null && height > limits.highestM) {
      addFinding(
        'error',
        leg.seq,
        t('is {height} above home; {highest} is the most.', {
          height: metres(height),
          highest: metres(limits.highestM),
        }),
      );
    }
    const mayBeLow = isEnd(item.command);
    if (!mayBeLow && height <= 0)
      addFinding(
        'warning',
        leg.seq,
        t('is {height} above home: on the ground or below it.', { height: metres(height) }),
      );
  }
  let before: number | null = null;
  for (const [seq, item] of items.entries()) {
    if (item.command !== CMD.WAYPOINT && item.command !== CMD.SPLINE_WAYPOINT) {
      if (specOf(item.command)?.flies) before = null;
      continue;
    }
    const other = before === null ? undefined : items[before];
    if (other && other.frame === item.frame && Math.abs(other.z - item.z) < SAME_PLACE_M) {
      const apart = distanceM({ latE7: other.x, lonE7: other.y }, { latE7: item.x, lonE7: item.y });
      if (apart < SAME_PLACE_M)
        addFinding('warning', seq, t('is at the same place as item {before}.', { before: before! + 1 }));
    }
    before = seq;
  }
}

function fenceFindings(plan: Plan, path: FlownPath, named: (seq: number) => string): Finding[] {
  const { shapes } = plan.fence;
  const findings: Finding[] = [];
  for (const [at, shape] of shapes.entries()) {
    for (const fault of shapeFaults(shape)) {
      const words = t('Part {at} of the fence is not right. {fault}', { at: at + 1, fault });
      findings.push({ severity: 'error', kind: 'fence', part: shape.id, words });
    }
  }
  const isWhole = findings.length === 0;
  const middle = plan.home?.spot ?? path.legs[0]?.to;
  if (shapes.length === 0 || !isWhole || !middle) return findings;
  const check = new FenceCheck(shapes, middle);
  const severityOf = (breach: Breach): Finding['severity'] => (breach === 'outside-one' ? 'warning' : 'error');
  const atHome = plan.home && check.at(plan.home.spot);
  if (atHome) {
    const words =
      atHome === 'outside-one'
        ? t('The planned home is outside of one of the areas of the fence, which is a breach where all of them count.')
        : t('The planned home is not where the fence lets a drone be.');
    findings.push({ severity: severityOf(atHome), kind: 'fence', part: null, words });
  }
  const worst = new Map<number, Breach>();
  for (const leg of path.legs) {
    const breach = check.on(leg);
    if (breach && !(worst.has(leg.seq) && breach === 'outside-one')) worst.set(leg.seq, breach);
  }
  for (const [seq, breach] of worst) {
    const words = t('The way to {named} {breach}.', {
      named: named(seq).replace(/^./, (first) => first.toLowerCase()),
      breach: BREACH_WORDS[breach],
    });
    findings.push({ severity: severityOf(breach), kind: 'mission', part: plan.items[seq]!.id, words });
  }
  for (const [at, point] of plan.rally.entries()) {
    const breach = check.at(point.spot);
    if (!breach) continue;
    const words = t('Rally point {at} is not where the fence lets a drone be.', { at: at + 1 });
    findings.push({ severity: severityOf(breach), kind: 'rally', part: point.id, words });
  }
  return findings;
}
