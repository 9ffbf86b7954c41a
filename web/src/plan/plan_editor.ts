/** A plan being edited: its current state, with undo and redo. */

import type { Edit } from './edits';
import { EMPTY_PLAN, type Plan } from './plan_types';

/** Plans share unchanged parts: a step costs a list of items at most; 200 lists of 700 are about a megabyte. */
export const MAX_STEPS = 200;

interface Step {
  readonly words: string;
  readonly gesture: string | undefined;
  /** The plan on the other side of the step. */
  readonly plan: Plan;
}

export class PlanEditor {
  #plan: Plan;
  #saved: Plan;
  #past: Step[] = [];
  #future: Step[] = [];
  readonly #changed: () => void;

  /** `changed` is called after each change, with the new plan in place. `isSaved` false: not saved yet. */
  constructor(plan: Plan = EMPTY_PLAN, changed: () => void = () => undefined, isSaved = true) {
    this.#plan = plan;
    this.#saved = isSaved ? plan : { ...plan, items: [...plan.items] };
    this.#changed = changed;
  }

  get plan(): Plan {
    return this.#plan;
  }

  /** The text of the next undo. */
  get undoWords(): string | null {
    return this.#past.at(-1)?.words ?? null;
  }

  get redoWords(): string | null {
    return this.#future.at(-1)?.words ?? null;
  }

  /** The plan has changed since `markSaved`. */
  get hasUnsaved(): boolean {
    const parts = ['home', 'items', 'fence', 'rally', 'defaults'] as const;
    return parts.some((part) => this.#plan[part] !== this.#saved[part]);
  }

  markSaved(): void {
    this.#saved = this.#plan;
  }

  /** Returns false if the edit changed nothing. */
  apply(edit: Edit): boolean {
    const after = edit.apply(this.#plan);
    if (after === this.#plan) return false;
    const last = this.#past.at(-1);
    const goesOn = edit.gesture !== undefined && last?.gesture === edit.gesture && this.#future.length === 0;
    if (!goesOn) {
      this.#past.push({ words: edit.words, gesture: edit.gesture, plan: this.#plan });
      if (this.#past.length > MAX_STEPS) this.#past.shift();
    }
    this.#future = [];
    this.#plan = after;
    this.#changed();
    return true;
  }

  undo(): boolean {
    return this.#cross(this.#past, this.#future);
  }

  redo(): boolean {
    return this.#cross(this.#future, this.#past);
  }

  #cross(from: Step[], to: Step[]): boolean {
    const step = from.pop();
    if (!step) return false;
    // Without its gesture: an edit after an undo is a separate step.
    to.push({ words: step.words, gesture: undefined, plan: this.#plan });
    // Ids are never reused, not even after an undo.
    const nextId = Math.max(step.plan.nextId, this.#plan.nextId);
    this.#plan = step.plan.nextId === nextId ? step.plan : { ...step.plan, nextId };
    this.#changed();
    return true;
  }
}
