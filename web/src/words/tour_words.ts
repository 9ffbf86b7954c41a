/** The four steps of the tour, each beside what it speaks of. */

import { t } from '../languages/text';

export interface TourStep {
  /** A selector of the part that it speaks of. */
  readonly part: string;
  readonly title: string;
  readonly words: string;
}

export const TOUR: readonly TourStep[] = [
  {
    part: '[data-testid="squad"]',
    title: t('Your squad'),
    words: t('Every drone that you may see, in this list and on the map. A name opens its card, "Open" its page.'),
  },
  {
    part: '[data-testid="flight-bar"]',
    title: t('The flight bar and Hold'),
    words: t(
      'On every page it names the drone that you control. Its Hold button, or the key H, stops that drone at once, whatever is open.',
    ),
  },
  {
    part: '[data-testid="bar-alerts"]',
    title: t('Alerts'),
    words: t('What is lost, low or held is counted here. It stands out in the list and on the map too.'),
  },
  {
    part: '[data-testid="open-search"]',
    title: t('Search and help'),
    words: t('Ctrl K finds drones, pages and commands. The question mark beside it, or the key ?, explains the page.'),
  },
];
