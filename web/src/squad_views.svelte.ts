/** What the list of the Monitor shows, and the views of it that the user saved; the tower keeps those. */

import { KeptDocument } from './kept_document.svelte';
import { readViews, USUAL_LIST, type ListChoice } from './squad/monitor_views';

export const savedViews = new KeptDocument('monitor-views', readViews);

const list = $state<{ now: ListChoice; isChanged: boolean }>({ now: USUAL_LIST, isChanged: false });

export const listChoice = {
  get current(): ListChoice {
    return list.now;
  },
};

export function chooseList(changes: Partial<ListChoice>): void {
  list.now = { ...list.now, ...changes };
  list.isChanged = true;
}

/** After the sign-in: opens the Monitor with the user's first view, unless they have begun to change it. */
export async function recallViews(): Promise<void> {
  list.now = USUAL_LIST;
  list.isChanged = false;
  await savedViews.recall();
  const { views, first } = savedViews.current;
  const opening = views.find(({ name }) => name === first);
  if (opening && !list.isChanged) {
    const { view, search, filter, order } = opening;
    list.now = { view, search, filter, order };
  }
}
