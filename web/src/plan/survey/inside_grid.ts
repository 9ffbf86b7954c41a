/**
 * The lines of a survey in an order that stays inside a concave area: the area falls into parts in which each line is
 * whole; each part is flown to and fro, and the way to the next one goes round the bays.
 */

import { t } from '../../languages/text';
import { distanceM } from '../ground';
import { MAX_ITEMS, type Spot, type WireItem } from '../plan_types';
import { heldToOutline, SurveyFault } from './area';
import { Inside } from './inside';
import { gridLines, pictureItems, waypointAt, type GridSettings, type Line } from './survey_grid';

/** More corners than this would hold up the page. */
const MAX_CORNERS = 40;

/** A part of a line, in the direction of the line. */
type Piece = readonly [Spot, Spot];
type Cell = readonly Piece[];

/** The pieces of all lines in one direction, by line. */
function piecesOf(lines: readonly Line[]): Piece[][] {
  return lines.map(({ pieces }, at) =>
    at % 2 === 0 ? [...pieces] : pieces.toReversed().map(([from, to]): Piece => [to, from]),
  );
}

/** Pieces of neighbouring lines that lie beside each other and beside no third one are in one cell. */
function cellsOf(rows: readonly (readonly Piece[])[], inside: Inside): Cell[] {
  const cells: Piece[][] = [];
  let open: (Piece[] | undefined)[] = [];
  for (const [at, row] of rows.entries()) {
    const before = rows[at - 1] ?? [];
    const isBeside = (one: Piece, other: Piece): boolean => overlap(one, other);
    open = row.map((piece) => {
      const beside = [...before.keys()].filter((one) => isBeside(before[one]!, piece));
      const [only] = beside;
      const isAlone = beside.length === 1 && row.filter((other) => isBeside(before[only!]!, other)).length === 1;
      const cell = isAlone ? open[only!] : undefined;
      const last = cell?.at(-1);
      // A bay may reach between two lines without meeting either.
      const isNext = last && [0, 1].some((end) => inside.outside(last[end]!, piece[end]!).length === 0);
      if (cell && isNext) {
        cell.push(piece);
        return cell;
      }
      const begun = [piece];
      cells.push(begun);
      return begun;
    });
  }
  return cells;
}

/** By their distances along the line from a place far behind both. */
function overlap(one: Piece, other: Piece): boolean {
  const [from, to] = one;
  const lengthM = distanceM(from, to);
  const along = (spot: Spot): number => {
    const [a, b] = [distanceM(from, spot), distanceM(to, spot)];
    return lengthM === 0 ? 0 : (a * a - b * b + lengthM * lengthM) / (2 * lengthM);
  };
  return Math.max(0, along(other[0])) < Math.min(lengthM, along(other[1]));
}

/** To and fro, from one of the four corners of a cell. */
function flownFrom(cell: Cell, corner: number): Piece[] {
  const rows = corner & 2 ? cell.toReversed() : cell;
  return rows.map(([from, to], at): Piece => ((at + corner) % 2 === 0 ? [from, to] : [to, from]));
}

/** Items of a survey that leaves its area nowhere: no turn-in beyond it, and ways between its parts inside it. */
export function insideItems(drawn: readonly Spot[], settings: GridSettings): WireItem[] {
  const area = heldToOutline(drawn);
  if (area.length > MAX_CORNERS) {
    throw new SurveyFault(
      t('An area with more than {most} corners is not flown on its inside: draw it with fewer.', { most: MAX_CORNERS }),
    );
  }
  const inside = new Inside(area);
  const lines = gridLines(area, { ...settings, turnaroundM: 0, entry: settings.entry & 2 ? 2 : 0 });
  const rows = piecesOf(lines);
  if (rows.flat().length > MAX_ITEMS) {
    throw new SurveyFault(t('That is more than a drone takes: lines farther apart, or a smaller area.'));
  }
  const waiting = new Set(cellsOf(rows, inside));
  const { begin, end } = pictureItems(settings.triggerM);
  const items: WireItem[] = [];
  let here: Spot | null = null;
  const fly = (cell: Cell, corner: number): void => {
    for (const [from, to] of flownFrom(cell, corner)) {
      const turns = here ? (inside.turns(here, from) ?? []) : [];
      items.push(...[...turns, from].map((spot) => waypointAt(spot, settings)), ...begin);
      items.push(waypointAt(to, settings), ...end);
      here = to;
    }
    waiting.delete(cell);
  };
  const [first] = waiting;
  if (first) fly(first, settings.entry & 1);
  while (waiting.size > 0) {
    const starts = [...waiting].flatMap((cell) =>
      [0, 1, 2, 3].map((corner) => {
        const [[from]] = flownFrom(cell, corner) as [Piece];
        return { cell, corner, from, apartM: distanceM(here!, from) };
      }),
    );
    starts.sort((one, other) => one.apartM - other.apartM);
    let [best, leastM] = [starts[0]!, Infinity];
    for (const start of starts) {
      // No way is shorter than the straight one.
      if (start.apartM >= leastM) break;
      const lengthM = lengthOf([here!, ...(inside.turns(here!, start.from) ?? []), start.from]);
      if (lengthM < leastM) [best, leastM] = [start, lengthM];
    }
    const { cell, corner } = best;
    fly(cell, corner);
  }
  return items;
}

const lengthOf = (way: readonly Spot[]): number =>
  way.slice(1).reduce((sum, spot, at) => sum + distanceM(way[at]!, spot), 0);

/** The parts of a way that leave the area, and their length. */
export function outsideOf(
  area: readonly Spot[],
  way: readonly Spot[],
): { readonly parts: readonly (readonly [Spot, Spot])[]; readonly lengthM: number } {
  const inside = new Inside(area);
  const parts = way.slice(1).flatMap((spot, at) => inside.outside(way[at]!, spot));
  return { parts, lengthM: parts.reduce((sum, [from, to]) => sum + distanceM(from, to), 0) };
}
