/** A field on a chart: which component's, of which message, and where the numbers come from. */

import { definitionOf, messageName } from './definitions';
import { isNumeric, type Series } from './field_series';
import type { FrameKind } from './frame_log';
import { shownUnit } from './units';

export interface ChartField {
  readonly sysid: number;
  readonly compid: number;
  readonly msgid: number;
  readonly field: string;
  /** In an array; 0 for a single value. */
  readonly index: number;
}

/** Where a chart gets its numbers: a recorded flight, or the last minutes. */
export interface SeriesSource {
  readonly kinds: readonly FrameKind[];
  series(request: {
    kind: number;
    field: string;
    index: number;
    fromMs: number;
    toMs: number;
    maxPoints: number;
  }): Promise<Series> | Series;
}

export const fieldKey = ({ sysid, compid, msgid, field, index }: ChartField): string =>
  `${sysid}/${compid}/${msgid}/${field}/${index}`;

export const kindOf = (kinds: readonly FrameKind[], { sysid, compid, msgid }: ChartField): number =>
  kinds.findIndex((one) => one.sysid === sysid && one.compid === compid && one.msgid === msgid);

/** `GLOBAL_POSITION_INT relative_alt`. */
export function fieldLabel({ msgid, field, index }: ChartField): string {
  const found = definitionOf(msgid)?.fields.find(({ name }) => name === field);
  return `${messageName(msgid)} ${field}${found && found.length > 0 ? `[${index}]` : ''}`;
}

export function fieldUnit({ msgid, field }: ChartField): { readonly unit: string; readonly factor: number } {
  const found = definitionOf(msgid)?.fields.find(({ name }) => name === field);
  return found ? shownUnit(found) : { unit: '', factor: 1 };
}

/** The numbers of one kind of message, in wire order. */
export function fieldsOf({ sysid, compid, msgid }: FrameKind): ChartField[] {
  return (definitionOf(msgid)?.fields ?? [])
    .filter(isNumeric)
    .flatMap(({ name, length }) =>
      Array.from({ length: Math.max(1, length) }, (_, index) => ({ sysid, compid, msgid, field: name, index })),
    );
}

const AUTOPILOT = 1;
const USUAL: readonly (readonly [number, string])[] = [
  [33, 'relative_alt'],
  [74, 'groundspeed'],
];

/** What a chart shows before anybody chooses: height and speed. */
export function usualFields(kinds: readonly FrameKind[]): ChartField[] {
  return USUAL.flatMap(([msgid, field]) => {
    const kind = kinds.find((one) => one.msgid === msgid && one.compid === AUTOPILOT);
    return kind ? [{ sysid: kind.sysid, compid: kind.compid, msgid, field, index: 0 }] : [];
  });
}
