/**
 * What a drone has on board, on the map of the page that flies it: drawn as the Missions page draws a plan, and nothing of
 * it can be taken hold of. Comes by itself, after the page: a drone can be flown without it.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { boardScene, isSameHome, laidOut, type Board, type Laid } from './board_scene';
import { PlanOverlay } from './plan_overlay';
import { onThemeChange } from './theme';

export class BoardLayer {
  readonly #overlay: PlanOverlay;
  readonly #stopTheme: () => void;
  #board: Board | null = null;
  #laid: Laid | null = null;

  constructor(map: MapLibreMap) {
    this.#overlay = new PlanOverlay(map);
    this.#stopTheme = onThemeChange(() => this.#overlay.renewTheme());
  }

  /** Lays the way out again only where the plan or home is another. Raises RangeError for items that are none. */
  show(board: Board): void {
    const before = this.#board;
    this.#board = board;
    if (!this.#laid || before?.rows !== board.rows || !isSameHome(before.home, board.home)) {
      this.#laid = laidOut(board.rows, board.home);
    } else if (before.current === board.current && before.reached === board.reached) return;
    this.#overlay.scene = boardScene(this.#laid, board.current, board.reached);
  }

  remove(): void {
    this.#stopTheme();
    this.#overlay.remove();
  }
}
