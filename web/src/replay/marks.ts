/** What happened in a flight, in words and in order, from its index and from what the autopilot said. */

import { t } from '../languages/text';
import { causeWords, controlWords, stepWords } from '../link/event_words';
import { severityOf, type Severity } from '../link/journal';
import { modeName } from '../link/modes';
import type { ControlEvent } from '../link/wire_types';
import { detailWords, workName } from '../words/audit_words';
import type { FlightOverview } from './overview';

export const MARK_KINDS = ['controls', 'hold', 'command', 'alert', 'sticks', 'link', 'mode', 'text', 'flight'] as const;
export type MarkKind = (typeof MARK_KINDS)[number];

export interface Mark {
  readonly atMs: number;
  readonly kind: MarkKind;
  readonly severity: Severity;
  readonly text: string;
}

/** One line of the index (docs/flights.md). */
export type IndexEntry = Readonly<Record<string, unknown>>;

export interface Span {
  readonly fromMs: number;
  readonly toMs: number;
  readonly label: string;
}

const atMsOf = ({ at_us: at }: IndexEntry): number => (typeof at === 'number' ? at / 1000 : NaN);
const textOf = (value: unknown): string => (typeof value === 'string' ? value : '');
const nameOf = (who: unknown): string =>
  typeof who === 'object' && who !== null && 'name' in who ? textOf(who.name) : '';

/** In order of time. `drone`: its name. */
export function marksOf(index: readonly IndexEntry[], overview: FlightOverview | null, drone: string): Mark[] {
  const answers = new Map<unknown, IndexEntry>();
  for (const entry of index) {
    if (entry['kind'] === 'command' && entry['operation'] !== undefined) answers.set(entry['operation'], entry);
  }
  const begun = new Set<unknown>();
  const marks: Mark[] = [];
  for (const entry of index) {
    const operation = entry['kind'] === 'command' ? entry['operation'] : undefined;
    if (operation !== undefined && begun.has(operation)) continue;
    if (operation !== undefined) begun.add(operation);
    const mark = markOf(operation === undefined ? entry : { ...answers.get(operation), at_us: entry['at_us'] }, drone);
    if (mark && Number.isFinite(mark.atMs)) marks.push(mark);
  }
  for (const { atMs, severity, text } of overview?.texts ?? []) {
    marks.push({ atMs, kind: 'text', severity: severityOf(severity), text });
  }
  for (const { atMs, autopilot, customMode, vehicleType } of (overview?.modes ?? []).slice(1)) {
    marks.push({
      atMs,
      kind: 'mode',
      severity: 'info',
      text: t('Mode {modeName}', { modeName: modeName(autopilot, customMode, vehicleType) }),
    });
  }
  return marks.sort((one, other) => one.atMs - other.atMs);
}

/** Which command, with its figures; or what else was begun. */
function commandWords(entry: IndexEntry): string {
  const { command = entry['command'], ...figures } = (entry['about'] ?? {}) as Record<string, unknown>;
  const name = textOf(command) || workName(textOf(entry['work'])) || t('a command');
  return [name, detailWords(figures)].filter((words) => words !== '').join(', ');
}

function markOf(entry: IndexEntry, drone: string): Mark | null {
  const atMs = atMsOf(entry);
  const mark = (kind: MarkKind, severity: Severity, text: string): Mark => ({ atMs, kind, severity, text });
  switch (entry['kind']) {
    case 'armed':
      return mark(
        'flight',
        'info',
        t('{drone} armed; {nameOf} has the controls', { drone, nameOf: nameOf(entry['holder']) || t('nobody') }),
      );
    case 'disarmed':
      return mark('flight', 'info', t('{drone} disarmed', { drone }));
    case 'end':
      return textOf(entry['words'])
        ? mark('flight', 'warning', t('The recording ended: {textOf}', { textOf: textOf(entry['words']) }))
        : null;
    case 'control': {
      const event = entry as unknown as ControlEvent;
      const isHard = ['taken', 'revoked', 'expired'].includes(event.event);
      return mark('controls', isHard ? 'warning' : 'info', controlWords(event, drone));
    }
    case 'turn':
      return mark('controls', 'info', t('Now the frames of {nameOf} pass', { nameOf: nameOf(entry['user']) }));
    case 'hold': {
      const step = textOf(entry['step']);
      const detail = textOf(entry['detail']);
      const isBad = step === 'unconfirmed';
      const isOrder = step === 'ordered';
      const why = isOrder ? ` (${causeWords(textOf(entry['cause']), detail)})` : detail ? `: ${detail}` : '';
      return mark(
        'hold',
        isBad ? 'error' : isOrder ? 'warning' : 'info',
        t('Hold {step}{why}', { step: stepWords(step), why }),
      );
    }
    case 'command': {
      const who = nameOf(entry['by']) || t('The tower');
      const what = commandWords(entry);
      const answer = textOf(entry['answer']) || textOf(entry['state']);
      return mark('command', 'info', `${who}: ${what}${answer ? ` (${answer})` : ''}`);
    }
    case 'alert': {
      const state = textOf(entry['state']);
      const words = textOf(entry['words']) || textOf(entry['what']);
      const severity = state === 'closed' ? 'info' : textOf(entry['severity']) === 'critical' ? 'error' : 'warning';
      return mark('alert', severity, t('Alert{what}: {words}', { what: state ? ` ${state}` : '', words }));
    }
    case 'sticks':
      return mark('sticks', 'info', t('{nameOf} moves the sticks', { nameOf: nameOf(entry['by']) }));
    case 'sticks_rest':
      return mark('sticks', 'info', t('The sticks of {nameOf} rest', { nameOf: nameOf(entry['by']) }));
    case 'link_lost':
      return mark('link', 'error', t('{drone} is not heard any more', { drone }));
    case 'clock_set':
      return mark('link', 'info', t("The tower's clock was set: the times of the flight went on"));
    case 'link_back':
      return mark('link', 'info', t('{drone} is heard again', { drone }));
    case 'holder':
      return mark('controls', 'warning', HOLDER_WORDS[textOf(entry['what'])] ?? t('The holder was gone'));
    case 'notice':
      return mark('alert', severityOfNotice(textOf(entry['severity'])), textOf(entry['text']));
    case 'rehearsal':
      return mark('hold', 'info', t('Rehearsal: {textOf}', { textOf: textOf(entry['text']) }));
    default:
      return null;
  }
}

const HOLDER_WORDS: Readonly<Record<string, string>> = {
  HolderGone: t('The holder was not heard any more'),
  HolderExpired: t('The holder was gone for too long'),
};

const severityOfNotice = (severity: string): Severity =>
  severity === 'error' || severity === 'warning' ? severity : 'info';

/** Who had the controls, from when to when. Nobody: no span. */
export function holderSpans(index: readonly IndexEntry[], fromMs: number, toMs: number): Span[] {
  const spans: Span[] = [];
  let name = '';
  let sinceMs = fromMs;
  const change = (next: string, atMs: number): void => {
    if (next === name) return;
    if (name !== '') spans.push({ fromMs: sinceMs, toMs: atMs, label: name });
    name = next;
    sinceMs = atMs;
  };
  for (const entry of index) {
    if (entry['kind'] === 'armed' || entry['kind'] === 'control') change(nameOf(entry['holder']), atMsOf(entry));
  }
  change('', toMs);
  return spans;
}

/** When the drone was not heard. */
export function silentSpans(index: readonly IndexEntry[], toMs: number): Span[] {
  const spans: Span[] = [];
  let sinceMs: number | null = null;
  for (const entry of index) {
    if (entry['kind'] === 'link_lost') sinceMs ??= atMsOf(entry);
    else if (entry['kind'] === 'link_back' && sinceMs !== null) {
      spans.push({ fromMs: sinceMs, toMs: atMsOf(entry), label: t('Not heard') });
      sinceMs = null;
    }
  }
  if (sinceMs !== null) spans.push({ fromMs: sinceMs, toMs, label: t('Not heard') });
  return spans;
}

/** Whose sticks passed at this time; empty: nobody's. */
export function stickHandAt(index: readonly IndexEntry[], atMs: number): string {
  let hand = '';
  for (const entry of index) {
    if (atMsOf(entry) > atMs) break;
    if (entry['kind'] === 'sticks') hand = nameOf(entry['by']);
    else if (entry['kind'] === 'sticks_rest') hand = '';
  }
  return hand;
}

/** Who had the controls at this time; empty: nobody. */
export const holderAt = (spans: readonly Span[], atMs: number): string =>
  spans.findLast(({ fromMs, toMs }) => fromMs <= atMs && atMs < toMs)?.label ?? '';
