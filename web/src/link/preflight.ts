/** The checklist before a flight: the lines that the tower fills in, own lines, and the pilot's signature. */

import { t } from '../languages/text';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import { preflightInWords } from './tower_words';

export type Preflight = Schemas['PreflightView'];
export type PreflightLine = Schemas['PreflightLineView'];
export type LineState = PreflightLine['state'];

const ORDER: readonly LineState[] = ['bad', 'caution', 'unknown', 'good'];

/** The worst state of its lines. */
export function worstState({ lines }: Pick<Preflight, 'lines'>): LineState {
  return ORDER.find((state) => lines.some((line) => line.state === state)) ?? 'good';
}

/** `2 not OK, 1 not known`; empty if every line is good. */
export function openWords({ lines }: Pick<Preflight, 'lines'>): string {
  const count = (...states: LineState[]): number => lines.filter(({ state }) => states.includes(state)).length;
  const [open, unknown] = [count('bad', 'caution'), count('unknown')];
  return [open > 0 ? t('{open} not OK', { open }) : '', unknown > 0 ? t('{unknown} not known', { unknown }) : '']
    .filter(Boolean)
    .join(', ');
}

/** Lines typed one below the other, as they are kept. */
export const linesIn = (text: string): string[] =>
  text
    .split('\n')
    .map((line) => line.trim().replace(/\s+/g, ' '))
    .filter(Boolean);

export class PreflightRest {
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  of(droneId: number): Promise<Preflight> {
    return this.#rest
      .call('GET', '/drones/{drone_id}/preflight', { path: { drone_id: droneId } })
      .then(preflightInWords);
  }

  /** For whoever has the controls. `checked`: the text of every own line. */
  sign(droneId: number, checked: readonly string[], weather: string): Promise<Preflight> {
    const request = { path: { drone_id: droneId }, body: { checked: [...checked], weather } };
    return this.#rest.call('POST', '/drones/{drone_id}/preflight/sign', request).then(preflightInWords);
  }

  /** The own lines of one drone. */
  keepOfDrone(droneId: number, lines: string[]): Promise<unknown> {
    const request = { path: { drone_id: droneId }, body: { lines } };
    return this.#rest.call('PUT', '/drones/{drone_id}/preflight/lines', request);
  }

  /** The own lines of a kind of drone; for admins. */
  keepOfKind(kind: string, lines: string[]): Promise<unknown> {
    return this.#rest.call('PUT', '/checklists/{kind}', { path: { kind }, body: { lines } });
  }
}
