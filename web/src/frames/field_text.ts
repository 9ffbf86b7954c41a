/** The fields of one frame as people read them. */

import { SIZE_OF, type Field } from '../link/field_types';
import { definitionOf } from './definitions';
import { fieldReader } from './field_series';
import { shownUnit } from './units';

export interface FieldText {
  readonly name: string;
  readonly text: string;
  readonly isNumeric: boolean;
}

const utf8 = new TextDecoder();
const MAX_SHOWN = 16;

/** In wire order; empty for a message that the dialect does not have. */
export function fieldTexts(msgid: number, frame: Uint8Array): FieldText[] {
  return (definitionOf(msgid)?.fields ?? []).map((field) => ({
    name: field.name,
    text: field.type === 'c8' ? text(field, frame) : numbers(field, frame),
    isNumeric: field.type !== 'c8',
  }));
}

function text(field: Field, frame: Uint8Array): string {
  const letters = Math.max(1, field.length) * SIZE_OF.c8;
  const bytes = Array.from({ length: letters }, (_, index) => fieldReader(field, index)(frame, 0));
  const end = bytes.indexOf(0);
  return utf8.decode(Uint8Array.from(end < 0 ? bytes : bytes.slice(0, end)));
}

function numbers(field: Field, frame: Uint8Array): string {
  const { unit, factor } = shownUnit(field);
  const count = Math.max(1, field.length);
  const shown = Array.from({ length: Math.min(count, MAX_SHOWN) }, (_, index) =>
    numberText(fieldReader(field, index)(frame, 0) * factor, factor !== 1),
  );
  return `${shown.join(', ')}${count > MAX_SHOWN ? ', …' : ''}${unit ? ` ${unit}` : ''}`;
}

function numberText(value: number, isScaled: boolean): string {
  if (Number.isInteger(value)) return String(value);
  return Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-4)
    ? value.toExponential(3)
    : String(Number(value.toFixed(isScaled ? 7 : 4)));
}
