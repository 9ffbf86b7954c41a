/** Opens a plan file from its bytes: packed files, shapefiles and tables with readers that load when needed. */

import { t } from '../../languages/text';
import { MAX_LENGTH, notNothing, openPlanFile } from './open_plan_file';
import { NotAPlanFile, type ReadFile, type ReadSettings } from './plan_file';
import { looksLikeTable } from './table_head';
import type { ParseXml } from './xml';

const SHAPES = [0, 0, 0x27, 0x0a];
const PACKED = [0x50, 0x4b, 3, 4];
const begins = (bytes: Uint8Array, signs: readonly number[]): boolean => signs.every((one, at) => bytes[at] === one);

/** Throws only NotAPlanFile, with a message for people, whatever the file. */
export async function openPlanBytes(bytes: Uint8Array, settings: ReadSettings, parseXml: ParseXml): Promise<ReadFile> {
  if (bytes.length > MAX_LENGTH) throw new NotAPlanFile(t('This file is too large to be a plan.'));
  if (begins(bytes, PACKED)) {
    const { readPacked } = await import('./packed_file');
    return notNothing(readPacked(bytes, settings, (text) => openPlanFile(text, settings, parseXml)));
  }
  const { fileName = '' } = settings;
  if (begins(bytes, SHAPES)) {
    const { readLayersOf } = await import('./packed_file');
    return notNothing(readLayersOf([{ name: fileName.replace(/\.shp$/i, ''), shp: bytes, prj: null }], settings));
  }
  const text = textOf(bytes);
  if (!looksLikeTable(text, fileName)) return openPlanFile(text, settings, parseXml);
  const { readCsv } = await import('./csv_plan');
  return notNothing(readCsv(text, settings));
}

/** Spreadsheets write UTF-16 too, and the old code page of Windows. */
function textOf(bytes: Uint8Array): string {
  if (begins(bytes, [0xff, 0xfe])) return new TextDecoder('utf-16le').decode(bytes);
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('windows-1252').decode(bytes);
  }
}
