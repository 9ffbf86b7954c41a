/** The facts about an autopilot's parameters, fetched when somebody looks at some. */

import { NO_FACTS, readFacts, type Facts, type Numbers } from './facts';

export type Autopilot = 'arducopter' | 'px4' | 'other';

export async function loadFacts(autopilot: Autopilot): Promise<Facts> {
  switch (autopilot) {
    case 'arducopter': {
      const [{ ARDUCOPTER }, { default: numbers }] = await Promise.all([
        import('./facts/arducopter'),
        import('./facts/arducopter_numbers.json'),
      ]);
      return {
        words: readFacts(ARDUCOPTER),
        numbers: new Map(Object.entries(numbers) as unknown as [string, Numbers][]),
      };
    }
    case 'px4': {
      const { PX4 } = await import('./facts/px4');
      return { words: readFacts(PX4), numbers: new Map() };
    }
    case 'other':
      return NO_FACTS;
  }
}
