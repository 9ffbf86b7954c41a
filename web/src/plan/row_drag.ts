/** Dragging rows of a list to another place: computes the target from the middles of the rows. */

/** The index of the row that they would precede; `middles.length`: after the last. */
export function rowBefore(middles: readonly number[], y: number): number {
  const at = middles.findIndex((middle) => y < middle);
  return at < 0 ? middles.length : at;
}

/** Moved rows end up together, and cannot precede one of themselves: uses the next row that stays. */
export function anchorFor<Id>(order: readonly Id[], moved: ReadonlySet<Id>, before: number): Id | null {
  return order.slice(before).find((id) => !moved.has(id)) ?? null;
}

/** One place up or down, for keys. `undefined`: already at that end. */
export function anchorForStep<Id>(order: readonly Id[], moved: ReadonlySet<Id>, isUp: boolean): Id | null | undefined {
  const places = order.flatMap((id, at) => (moved.has(id) ? [at] : []));
  const [first, last] = [places[0], places.at(-1)];
  if (first === undefined || last === undefined) return undefined;
  if (isUp) {
    const above = order.slice(0, first).findLast((id) => !moved.has(id));
    if (above !== undefined) return above;
    // Separate rows come together at the top.
    return last - first + 1 > places.length ? (order.find((id) => !moved.has(id)) ?? undefined) : undefined;
  }
  const below = order.slice(last + 1).filter((id) => !moved.has(id));
  if (below.length === 0) return last - first + 1 > places.length ? null : undefined;
  return below[1] ?? null;
}
