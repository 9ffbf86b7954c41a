/** The facts about an autopilot's parameters, loaded on demand. */

import { currentLanguage } from '../languages/text';
import { factsOf, inLabels, NO_FACTS, type Facts, type Labels, type Metadata } from './facts';

import type { Language } from '../languages/languages';
import type { SetupGroups } from '../setup/setup_groups';
import type { FAMILIES } from '../link/generated/autopilots.gen';

/** A family of profiles (wire/autopilots/), or another autopilot. */
export type Autopilot = keyof typeof FAMILIES | 'other';

const LABELS: Readonly<Record<Exclude<Language, 'en'>, () => Promise<{ default: Labels }>>> = {
  pt: () => import('../languages/pt/parameters/portuguese_labels.json'),
};

/** Titles in the chosen language. In English where they cannot be loaded: the values count more. */
async function loadLabels(): Promise<Labels> {
  const language = currentLanguage();
  if (language === 'en') return {};
  return LABELS[language]().then(
    ({ default: labels }) => labels,
    () => ({}),
  );
}

export async function loadFacts(autopilot: Autopilot): Promise<Facts> {
  switch (autopilot) {
    case 'ardupilot': {
      const [{ ARDUCOPTER_WORDS }, { default: metadata }, labels] = await Promise.all([
        import('./facts/arducopter_words'),
        import('./facts/arducopter_metadata.json'),
        loadLabels(),
      ]);
      return factsOf(ARDUCOPTER_WORDS, metadata as unknown as Metadata, labels);
    }
    case 'px4': {
      const [{ PX4_WORDS }, { default: metadata }, labels] = await Promise.all([
        import('./facts/px4_words'),
        import('./facts/px4_metadata.json'),
        loadLabels(),
      ]);
      return factsOf(PX4_WORDS, metadata as unknown as Metadata, labels);
    }
    case 'msp': // it has no parameters
    case 'other':
      return NO_FACTS;
  }
}

/** The parameters that the set-up of this autopilot consists of; null: not known. */
export async function loadSetup(autopilot: Autopilot): Promise<SetupGroups | null> {
  switch (autopilot) {
    case 'ardupilot':
      return titled((await import('./facts/arducopter_setup')).ARDUCOPTER_SETUP, await loadLabels());
    case 'px4':
      return titled((await import('./facts/px4_setup')).PX4_SETUP, await loadLabels());
    case 'msp': // it has no parameters
    case 'other':
      return null;
  }
}

const titled = (setup: SetupGroups, labels: Labels): SetupGroups => {
  const pages = Object.entries(setup).map(([page, groups]) => [
    page,
    groups.map(([title, names]) => [inLabels(title, labels), names]),
  ]);
  return Object.fromEntries(pages) as SetupGroups;
};
