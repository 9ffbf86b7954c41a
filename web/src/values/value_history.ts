/** The last two minutes of values, for sparklines. Pure; `nowMs` passed in. */

const STEP_MS = 1_000;
const MAX_POINTS = 120;

export class ValueHistory {
  readonly #points = new Map<string, { readonly atMs: number; readonly value: number }[]>();

  /** Keeps one point a second. */
  push(id: string, value: number | null, nowMs: number): void {
    if (value === null) return;
    const points = this.#points.get(id) ?? [];
    const last = points.at(-1);
    if (last && nowMs - last.atMs < STEP_MS) return;
    points.push({ atMs: nowMs, value });
    if (points.length > MAX_POINTS) points.shift();
    this.#points.set(id, points);
  }

  /** Points of a polyline in a box of this size, oldest first; empty with fewer than two. */
  line(id: string, width: number, height: number): string {
    const values = (this.#points.get(id) ?? []).map(({ value }) => value);
    if (values.length < 2) return '';
    const [least, most] = [Math.min(...values), Math.max(...values)];
    const span = most - least || 1;
    return values
      .map((value, at) => {
        const x = (at / (values.length - 1)) * width;
        return `${x.toFixed(1)},${(height - ((value - least) / span) * height).toFixed(1)}`;
      })
      .join(' ');
  }
}
