/** Loads the page again. A user who controls a drone is told what that does to it, and decides. */

import { ask } from './confirmation.svelte';
import { t } from './languages/text';
import type { User } from './link/wire_types';
import { tower } from './tower.svelte';

interface Question {
  readonly title: string;
  /** What the page is loaded for, and that it can wait. */
  readonly reason: string;
  readonly confirmLabel: string;
}

/** False if the user decided against it; else the page is going. */
export async function reloadPage(user: User, { title, reason, confirmLabel }: Question): Promise<boolean> {
  const held = [...tower.vehicles.get().values()]
    .map(({ drone }) => drone.get())
    .filter((d) => d.holder?.id === user.id);
  if (held.length > 0) {
    const names = held.map(({ name }) => name).join(` ${t('and')} `);
    const text = t(
      'You have the controls of {names}. The page is gone while it loads. After 2 s without it {names} is put on hold. {reason}',
      { names, reason },
    );
    if (!(await ask({ title, text, confirmLabel, isDanger: true }))) return false;
  }
  window.location.reload();
  return true;
}
