/** The facts about an autopilot's parameters, loaded on demand. */

import { factsOf, NO_FACTS, type Facts, type Metadata } from './facts';

import type { SetupGroups } from '../setup/setup_groups';
import type { FAMILIES } from '../link/generated/autopilots.gen';

/** A family of profiles (wire/autopilots/), or another autopilot. */
export type Autopilot = keyof typeof FAMILIES | 'other';

export async function loadFacts(autopilot: Autopilot): Promise<Facts> {
  switch (autopilot) {
    case 'ardupilot': {
      const [{ ARDUCOPTER_WORDS }, { default: metadata }] = await Promise.all([
        import('./facts/arducopter_words'),
        import('./facts/arducopter_metadata.json'),
      ]);
      return factsOf(ARDUCOPTER_WORDS, metadata as unknown as Metadata);
    }
    case 'px4': {
      const [{ PX4_WORDS }, { default: metadata }] = await Promise.all([
        import('./facts/px4_words'),
        import('./facts/px4_metadata.json'),
      ]);
      return factsOf(PX4_WORDS, metadata as unknown as Metadata);
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
      return (await import('./facts/arducopter_setup')).ARDUCOPTER_SETUP;
    case 'px4':
      return (await import('./facts/px4_setup')).PX4_SETUP;
    case 'msp': // it has no parameters
    case 'other':
      return null;
  }
}
