/** Occupied screen areas, indexed by a coarse grid because lookups are frequent. Pure. */

export interface Box {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

const SQUARE_PX = 64;
const ROW = 1 << 12;

const overlap = (a: Box, b: Box): boolean =>
  a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

function* squares({ left, top, right, bottom }: Box): Generator<number> {
  const [firstX, lastX] = [Math.floor(left / SQUARE_PX), Math.floor(right / SQUARE_PX)];
  const [firstY, lastY] = [Math.floor(top / SQUARE_PX), Math.floor(bottom / SQUARE_PX)];
  for (let y = firstY; y <= lastY; y++) for (let x = firstX; x <= lastX; x++) yield y * ROW + x;
}

export class Obstacles {
  readonly #squares = new Map<number, { readonly box: Box; readonly owner: number | null }[]>();

  /** `owner`: the drone that the box belongs to, if it does not obstruct that drone's own label. */
  add(box: Box, owner: number | null = null): void {
    for (const square of squares(box)) {
      const there = this.#squares.get(square);
      if (there) there.push({ box, owner });
      else this.#squares.set(square, [{ box, owner }]);
    }
  }

  isFree(box: Box, owner: number | null = null): boolean {
    for (const square of squares(box)) {
      for (const one of this.#squares.get(square) ?? []) {
        if ((owner === null || one.owner !== owner) && overlap(one.box, box)) return false;
      }
    }
    return true;
  }
}
