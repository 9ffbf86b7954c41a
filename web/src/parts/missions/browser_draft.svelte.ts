/** A draft in this browser, saved shortly after each change and restored when the page opens. */

import { onMount } from 'svelte';

import { keepPlan, keptPlan } from '../../plan/plan_keeping';
import type { PlanWorkspace } from './plan_workspace.svelte';

const SAVE_AFTER_MS = 400;

/** Created while a component initialises: saves once more when the component is destroyed. */
export class BrowserDraft {
  readonly #workspace: PlanWorkspace;
  readonly #userId: number;
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** The browser refuses to store. */
  isLost = $state(false);

  constructor(workspace: PlanWorkspace, userId: number) {
    this.#workspace = workspace;
    this.#userId = userId;
    const kept = keptPlan(localStorage, userId);
    if (kept) workspace.restore(kept);
    $effect(() => {
      void [workspace.plan, workspace.name, workspace.library, workspace.isUnsaved, workspace.patterns];
      clearTimeout(this.#timer);
      this.#timer = setTimeout(this.save, SAVE_AFTER_MS);
    });
    onMount(() => this.save);
  }

  readonly save = (): void => {
    clearTimeout(this.#timer);
    this.isLost = !keepPlan(localStorage, this.#userId, this.#workspace.kept());
  };

  readonly onbeforeunload = (event: BeforeUnloadEvent): void => {
    this.save();
    if (this.#workspace.isUnsaved && !this.#workspace.isEmpty) event.preventDefault();
  };
}
