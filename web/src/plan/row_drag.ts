/** Rows of a list that are dragged to another place: where they would go, from the middles of the rows that are there. */

/** The number of the row that they would stand before; `middles.length`: after the last. */
export function rowBefore(middles: readonly number[], y: number): number {
  const at = middles.findIndex((middle) => y < middle);
  return at < 0 ? middles.length : at;
}

/** Those that are moved stand together, and may not stand before one of themselves: the next that stays is meant. */
export function anchorFor<Id>(order: readonly Id[], moved: ReadonlySet<Id>, before: number): Id | null {
  return order.slice(before).find((id) => !moved.has(id)) ?? null;
}

/** One place up or down, for keys. `undefined`: it is at that end already. */
export function anchorForStep<Id>(order: readonly Id[], moved: ReadonlySet<Id>, isUp: boolean): Id | null | undefined {
  const places = order.flatMap((id, at) => (moved.has(id) ? [at] : []));
  const [first, last] = [places[0], places.at(-1)];
  if (first === undefined || last === undefined) return undefined;
  if (isUp) {
    const above = order.slice(0, first).findLast((id) => !moved.has(id));
    if (above !== undefined) return above;
    // Those that stand apart come together at the top.
    return last - first + 1 > places.length ? (order.find((id) => !moved.has(id)) ?? undefined) : undefined;
  }
  const below = order.slice(last + 1).filter((id) => !moved.has(id));
  if (below.length === 0) return last - first + 1 > places.length ? null : undefined;
  return below[1] ?? null;
}
