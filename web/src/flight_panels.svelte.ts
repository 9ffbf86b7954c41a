/**
 * Which panels of the flight screen are open. Wide screens have room for all: each is open until its user closes it.
 * On narrow ones a panel covers much of the map: all are closed, and opening one closes the other.
 */

import { MediaQuery } from 'svelte/reactivity';

import { t } from './languages/text';
import { prefer, preferences, type PanelName } from './preferences.svelte';

export const PANEL_WORDS: Readonly<Record<PanelName, string>> = {
  values: t('Values'),
  link: t('Link'),
  messages: t('Messages'),
  commands: t('Commands'),
  checks: t('Checks'),
};

/** As in the stylesheets of pages/Control.svelte and parts/FlightPanel.svelte. */
const wide = new MediaQuery('(min-width: 1100px) and (min-height: 501px)');

export function isPanelOpen(name: PanelName): boolean {
  return wide.current ? !preferences.closedPanels.includes(name) : preferences.narrowPanel === name;
}

export function setPanel(name: PanelName, isOpen: boolean): void {
  if (isOpen === isPanelOpen(name)) return;
  if (!wide.current) prefer({ narrowPanel: isOpen ? name : null });
  else {
    const others = preferences.closedPanels.filter((one) => one !== name);
    prefer({ closedPanels: isOpen ? others : [...others, name] });
  }
}
