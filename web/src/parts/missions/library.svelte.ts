/** Saves a plan to the tower's library, and handles a conflict with another user's version. */

import type { MissionRest, SavedMission } from '../../link/mission_rest';
import { RestError } from '../../link/rest';
import { Request } from '../../loading.svelte';
import { documentOf, planOfDocument } from '../../plan/plan_document';
import type { PlanWorkspace } from './plan_workspace.svelte';

const PRECONDITION_FAILED = 412;

export class Library {
  readonly request = new Request();
  /** Another user saved a new version of the plan on the screen. */
  hasConflict = $state(false);
  /** What an opened plan could not represent. */
  dropped = $state.raw<readonly string[]>([]);
  readonly #workspace: PlanWorkspace;
  readonly #rest: MissionRest;

  constructor(workspace: PlanWorkspace, rest: MissionRest) {
    this.#workspace = workspace;
    this.#rest = rest;
  }

  list(): Promise<readonly SavedMission[]> {
    return this.#rest.missions();
  }

  /** Replaces the version that it is based on. Returns true if it was saved. */
  save(): Promise<boolean> {
    const { library } = this.#workspace;
    return library ? this.#over(library.id, library.version) : Promise.resolve(false);
  }

  /** Overwrites any version saved meanwhile. */
  async saveAllTheSame(): Promise<boolean> {
    const { library } = this.#workspace;
    if (!library) return false;
    let version = library.version;
    const isRead = await this.request.run(async () => {
      version = (await this.#rest.mission(library.id)).version;
    });
    return isRead && this.#over(library.id, version);
  }

  saveAs(name: string, shared: boolean): Promise<boolean> {
    const document = documentOf(this.#workspace.plan);
    return this.request.run(async () => this.#saved(await this.#rest.addMission({ name, document, shared })));
  }

  open(id: number): Promise<boolean> {
    return this.request.run(async () => {
      const { document, name, version } = await this.#rest.mission(id);
      const { plan, dropped } = planOfDocument(document);
      this.#workspace.open(plan, name, { id, version }, true);
      this.hasConflict = false;
      this.dropped = dropped;
    });
  }

  share(one: SavedMission, shared: boolean): Promise<boolean> {
    return this.request.run(async () => {
      const { name, document, version } = await this.#rest.mission(one.id);
      const saved = await this.#rest.saveMission(one.id, version, { name, document, shared });
      // Records the new version as seen only if no other user saved in between.
      const { library } = this.#workspace;
      if (library?.id === one.id && library.version === version)
        this.#workspace.library = { id: one.id, version: saved.version };
    });
  }

  remove(one: SavedMission): Promise<boolean> {
    return this.request.run(async () => {
      await this.#rest.removeMission(one.id);
      if (this.#workspace.library?.id === one.id) this.#workspace.library = null;
    });
  }

  #over(id: number, version: number): Promise<boolean> {
    const { plan, name } = this.#workspace;
    return this.request.run(async () => {
      try {
        const { shared } = await this.#rest.mission(id);
        this.#saved(await this.#rest.saveMission(id, version, { name, document: documentOf(plan), shared }));
      } catch (error) {
        this.hasConflict = error instanceof RestError && error.status === PRECONDITION_FAILED;
        throw error;
      }
    });
  }

  #saved({ id, name, version }: SavedMission): void {
    this.#workspace.markSaved(name, { id, version });
    this.hasConflict = false;
  }
}
