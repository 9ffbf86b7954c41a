/**
 * Lines of numbers in the text files of ground stations: fields separated by tabs, blanks or commas, `#` before
 * comments.
 */

import { t } from '../../languages/text';
import { NotAPlanFile } from './plan_file';

export interface TextLine {
  /** Counted from 1, as in editors. */
  readonly number: number;
  readonly fields: readonly string[];
}

const DECIMAL_COMMA = /^[-+]?\d+,\d+$/;

/** A comma separates fields; if blanks do that, it is the decimal comma of a computer set to German or French. */
function fieldsOf(line: string): string[] {
  const fields = line.trim().split(/\s+/);
  if (fields.length === 1 || fields.some((one) => one.split(',').length > 2 || one.endsWith(','))) {
    return line.trim().split(/[\s,]+/);
  }
  return fields.map((one) => (DECIMAL_COMMA.test(one) ? one.replace(',', '.') : one));
}

/** Without comments and empty lines. */
export function linesOf(text: string): TextLine[] {
  return text.split(/\r\n|\r|\n/).flatMap((line, at): TextLine[] => {
    if (line.trim() === '' || line.trimStart().startsWith('#')) return [];
    return [{ number: at + 1, fields: fieldsOf(line) }];
  });
}

/** `null` means "not given" (NaN). Throws NotAPlanFile with the line number. */
export function numberOf(text: string, line: number): number | null {
  if (text.toLowerCase() === 'nan') return null;
  const value = text === '' ? NaN : Number(text);
  if (Number.isNaN(value))
    throw new NotAPlanFile(t('Line {line}: "{text}" is not a number.', { line, text: text.slice(0, 20) }));
  return value;
}

/** Throws NotAPlanFile; some programs write integers as `16.000000`. */
export function wholeOf(text: string, line: number, what: string, most: number): number {
  const value = numberOf(text, line);
  if (value !== null && Number.isInteger(value) && value >= 0 && value <= most) return value;
  throw new NotAPlanFile(t('Line {line}: {what} is not a whole number from 0 to {most}.', { line, what, most }));
}
