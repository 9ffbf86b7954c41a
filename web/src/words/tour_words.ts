/** The four steps of the tour, each beside what it speaks of. */

export interface TourStep {
  /** A selector of the part that it speaks of. */
  readonly part: string;
  readonly title: string;
  readonly words: string;
}

export const TOUR: readonly TourStep[] = [
  {
    part: '[aria-label="Squad"]',
    title: 'Your squad',
    words: 'Every drone that you may see, in this list and on the map. A name opens its card, "Open" its page.',
  },
  {
    part: '[data-testid="flight-bar"]',
    title: 'The flight bar and Hold',
    words:
      'On every page it names the drone that you control. Its Hold button, or the key H, stops that drone at once, whatever is open.',
  },
  {
    part: '[data-testid="bar-alerts"]',
    title: 'Alerts',
    words: 'What is lost, low or held is counted here. It stands out in the list and on the map too.',
  },
  {
    part: '[data-testid="open-search"]',
    title: 'Search and help',
    words: 'Ctrl K finds drones, pages and commands. The question mark beside it, or the key ?, explains the page.',
  },
];
