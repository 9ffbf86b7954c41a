/** The keys of the planner: undo, tools, drawing, selection. Excludes keys for a field or a dialog. */

import { isTyping } from '../../is_typing';
import { back, finish, nudge, remove } from '../../plan/drawing';
import { TOOLS } from './map_tools';
import type { PlanWorkspace } from './plan_workspace.svelte';

const NUDGE_M = 1;
const NUDGE_FAR_M = 10;

export interface PlanKeysPage {
  /** The map with the plan; undefined until it is loaded. */
  map(): { ends(): boolean; showPlan(): void } | undefined;
  save(): void;
  upload(): void;
}

const isOnMap = (event: KeyboardEvent): boolean =>
  event.target instanceof HTMLElement && event.target.classList.contains('maplibregl-canvas');

/** To call in the capture phase: the map would handle arrow keys that belong to the plan. */
export function planKeys(workspace: PlanWorkspace, page: PlanKeysPage): (event: KeyboardEvent) => void {
  /** Arrow keys move the focused map; with Shift, the selection on it. */
  function shift(event: KeyboardEvent, north: number, east: number): boolean {
    if (!event.shiftKey || !isOnMap(event) || workspace.drawing.selected.size === 0) return false;
    const far = event.repeat ? NUDGE_FAR_M : NUDGE_M;
    workspace.take(nudge(workspace.drawing, north * far, east * far, workspace.plan));
    event.stopPropagation();
    return true;
  }

  /** Returns true if it handled the key. */
  const actions: Record<string, (event: KeyboardEvent) => boolean> = {
    escape: () => {
      workspace.drawing = back(workspace.drawing);
      if (workspace.drawing.tool === 'select') workspace.retaken = null;
      return true;
    },
    delete: () => {
      workspace.take(remove(workspace.drawing, workspace.plan));
      return true;
    },
    backspace: (event) => {
      if (!isOnMap(event) && event.target !== document.body) return false;
      workspace.take(remove(workspace.drawing, workspace.plan));
      return true;
    },
    enter: (event) => {
      if (workspace.drawing.draft.length === 0) return false;
      if (isOnMap(event)) {
        const hasEnded = page.map()?.ends() ?? false;
        if (hasEnded) event.stopPropagation();
        return hasEnded;
      }
      if (event.target !== document.body) return false;
      workspace.take({ drawing: finish(workspace.drawing), edits: [] });
      return true;
    },
    '0': () => {
      page.map()?.showPlan();
      return true;
    },
    u: () => {
      page.upload();
      return true;
    },
    arrowup: (event) => shift(event, 1, 0),
    arrowdown: (event) => shift(event, -1, 0),
    arrowleft: (event) => shift(event, 0, -1),
    arrowright: (event) => shift(event, 0, 1),
  };

  return (event) => {
    const isCtrl = event.ctrlKey || event.metaKey;
    const key = event.key.toLowerCase();
    if (document.querySelector('[role="dialog"], [role="menu"]')) return;
    const isInField = isTyping(event);
    if (isCtrl && key === 's') {
      event.preventDefault();
      if (!workspace.isEmpty) page.save();
      return;
    }
    // A field in use has its own undo.
    if (isCtrl && !isInField && (key === 'z' || key === 'y')) {
      event.preventDefault();
      if (key === 'y' || event.shiftKey) workspace.redo();
      else workspace.undo();
      return;
    }
    if (isInField || isCtrl || event.altKey) return;
    if (!actions[key]?.(event)) {
      const chosen = TOOLS.find((one) => one.key === key);
      if (!chosen || event.shiftKey) return;
      workspace.tool(chosen.tool);
      if (chosen.tool !== 'select') document.querySelector<HTMLElement>('.maplibregl-canvas')?.focus();
    }
    event.preventDefault();
  };
}
