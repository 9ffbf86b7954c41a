/** Drags rows of a list with a pointer: the drop position, and the drop. The caller chooses which rows move. */

import type { PartId } from '../../plan/plan_types';
import { rowBefore } from '../../plan/row_drag';

/** Smaller movements count as a click. */
const DRAG_FROM_PX = 5;
/** The list scrolls within this distance of its top or bottom edge. */
const EDGE_PX = 24;
const SCROLL_STEP_PX = 12;

interface DragTarget {
  /** The list with the rows: elements with `data-row`. */
  list: () => HTMLElement | undefined;
  drop: (moved: ReadonlySet<PartId>, dropAt: number) => void;
}

export class RowDrag {
  readonly #target: DragTarget;
  /** The row before which the dragged rows would drop; null: no drag. */
  dropAt = $state<number | null>(null);

  constructor(target: DragTarget) {
    this.#target = target;
  }

  begin(event: PointerEvent, moved: ReadonlySet<PartId>): void {
    const list = this.#target.list();
    if (event.button !== 0 || !list) return;
    const handle = event.currentTarget as HTMLElement;
    let isDragging = false;
    const startY = event.clientY;
    const move = ({ clientY, pointerId }: PointerEvent): void => {
      if (!isDragging && Math.abs(clientY - startY) < DRAG_FROM_PX) return;
      if (!isDragging) handle.setPointerCapture(pointerId);
      isDragging = true;
      const rows = [...list.querySelectorAll<HTMLElement>('[data-row]')];
      const middles = rows.map((row) => {
        const { top, height } = row.getBoundingClientRect();
        return top + height / 2;
      });
      this.dropAt = rowBefore(middles, clientY);
      const box = list.getBoundingClientRect();
      if (clientY < box.top + EDGE_PX) list.scrollTop -= SCROLL_STEP_PX;
      else if (clientY > box.bottom - EDGE_PX) list.scrollTop += SCROLL_STEP_PX;
    };
    const end = (isDropped: boolean): void => {
      handle.removeEventListener('pointermove', move);
      handle.removeEventListener('pointerup', up);
      handle.removeEventListener('pointercancel', cancel);
      if (isDragging && isDropped && this.dropAt !== null) {
        this.#target.drop(moved, this.dropAt);
        // The click that follows ends the drag and selects nothing.
        const swallow = (click: Event): void => click.stopImmediatePropagation();
        handle.addEventListener('click', swallow, { capture: true, once: true });
        setTimeout(() => handle.removeEventListener('click', swallow, true));
      }
      this.dropAt = null;
    };
    const up = (): void => end(true);
    const cancel = (): void => end(false);
    handle.addEventListener('pointermove', move);
    handle.addEventListener('pointerup', up);
    handle.addEventListener('pointercancel', cancel);
  }
}
