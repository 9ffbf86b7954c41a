/**
 * The plans on board, on the map of a drone's own page: drawn as on the Missions page, but not editable. Loaded after
 * the page: a drone can be flown without it.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { onboardScene, isSameHome, laidOut, type OnboardState, type Laid } from './onboard_scene';
import { PlanOverlay } from './plan_overlay';
import { onThemeChange } from './theme';

export class OnboardLayer {
  readonly #overlay: PlanOverlay;
  readonly #stopTheme: () => void;
  #board: OnboardState | null = null;
  #laid: Laid | null = null;

  constructor(map: MapLibreMap) {
    this.#overlay = new PlanOverlay(map);
    this.#stopTheme = onThemeChange(() => this.#overlay.renewTheme());
  }

  /** Recomputes the path only if the plan or home has changed. Raises RangeError for invalid items. */
  show(board: OnboardState): void {
    const before = this.#board;
    this.#board = board;
    if (!this.#laid || before?.rows !== board.rows || !isSameHome(before.home, board.home)) {
      this.#laid = laidOut(board.rows, board.home);
    } else if (before.current === board.current && before.reached === board.reached) return;
    this.#overlay.scene = onboardScene(this.#laid, board.current, board.reached);
  }

  remove(): void {
    this.#stopTheme();
    this.#overlay.remove();
  }
}
