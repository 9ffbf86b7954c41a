/** The plan in progress with its drawing and selection: the shared state of the Missions page. */

import { say } from '../../design/toasts';
import { t } from '../../languages/text';
import { USUAL_FAMILY } from '../../link/generated/autopilots.gen';
import type { AutopilotKind } from '../../plan/catalogue';
import { specOf } from '../../plan/catalogue';
import {
  addItem,
  chooseTool,
  NOTHING_DRAWN,
  placeForNew,
  pruned,
  seedsFor,
  select,
  settled,
  type Drawing,
  type Step,
  type Tool,
} from '../../plan/drawing';
import { insertItems, removeItems, together, type Edit } from '../../plan/edits';
import { estimate, USUAL_FIGURES, type FlightFigures } from '../../plan/estimates';
import { FenceCheck } from '../../plan/fence_crossings';
import { ANY_FIRMWARE, type Firmware } from '../../plan/firmware';
import { shapeFaults } from '../../plan/field_checks';
import { flownPath, type GroundAt } from '../../plan/flown_path';
import { bearingDeg } from '../../plan/ground';
import type { GroundLimits } from '../../plan/over_ground';
import { cleanOutline } from '../../plan/outline';
import { planChecks, type CheckLimits, type Finding } from '../../plan/plan_checks';
import { PlanEditor } from '../../plan/plan_editor';
import type { KeptPattern, KeptPlan } from '../../plan/plan_keeping';
import { EMPTY_PLAN, type PartId, type Plan } from '../../plan/plan_types';
import {
  longestSideDeg,
  patternPreview,
  USUAL_SETTINGS,
  type Pattern,
  type PatternSettings,
} from '../../plan/survey/patterns';

/** A survey whose items are in the plan: it can be edited again as long as they are unchanged. */
interface PlacedPattern extends Omit<KeptPattern, 'from' | 'count'> {
  readonly ids: readonly PartId[];
}

export interface LibraryPlace {
  readonly id: number;
  readonly version: number;
}

export const isPattern = (tool: Tool): tool is Pattern => tool === 'survey' || tool === 'corridor' || tool === 'orbit';

export class PlanWorkspace {
  plan = $state.raw<Plan>(EMPTY_PLAN);
  drawing = $state.raw<Drawing>(NOTHING_DRAWN);
  settings = $state.raw<PatternSettings>(USUAL_SETTINGS);
  figures = $state.raw<FlightFigures>(USUAL_FIGURES);
  limits = $state.raw<Pick<CheckLimits, 'highestM' | 'farthestM'>>({ highestM: 120, farthestM: null });
  groundLimits = $state.raw<GroundLimits>({ clearanceM: 10, returnHeightM: null });
  /** Null: this tower has no elevation. */
  ground = $state.raw<GroundAt | null>(null);
  autopilot = $state<AutopilotKind>(USUAL_FAMILY);
  firmware = $state.raw<Firmware>(ANY_FIRMWARE);
  name = $state('');
  library = $state.raw<LibraryPlace | null>(null);
  undoWords = $state<string | null>(null);
  redoWords = $state<string | null>(null);
  isUnsaved = $state(false);
  patterns = $state.raw<readonly PlacedPattern[]>([]);
  /** The survey being edited again. */
  retaken = $state.raw<PlacedPattern | null>(null);
  /** Increases when the map should show the whole plan. */
  shows = $state(0);
  #editor = new PlanEditor(EMPTY_PLAN, () => this.#changed());

  readonly path = $derived(flownPath(this.plan, this.ground ?? undefined));
  /** Metres above the ground at home; null: not known. */
  readonly groundOverHome = $derived.by((): GroundAt | null => {
    const { ground } = this;
    const homeM = this.plan.home && ground?.(this.plan.home.spot);
    if (!ground || typeof homeM !== 'number') return null;
    return (spot) => {
      const under = ground(spot);
      return typeof under === 'number' ? under - homeM : under;
    };
  });
  readonly estimate = $derived(estimate(this.plan, this.figures, this.path));
  /** As the tower judged the plan a moment ago: what is gone since is left out. */
  zones = $state.raw<readonly Finding[]>([]);
  /** Why zones are not checked; empty if they are, or if there are none. */
  zonesUnchecked = $state('');
  readonly #parts = $derived(new Set([...this.plan.items, ...this.plan.rally].map(({ id }) => id)));
  readonly findings = $derived([
    ...planChecks(
      this.plan,
      {
        ...this.limits,
        autopilot: this.autopilot,
        firmware: this.firmware,
        ...(this.ground ? { ground: { ...this.groundLimits, at: this.ground } } : {}),
      },
      this.path,
    ),
    ...this.zones.filter(({ part }) => part !== null && this.#parts.has(part)),
  ]);
  readonly errors = $derived(this.findings.filter(({ severity }) => severity === 'error'));
  readonly faulty = $derived(new Set(this.errors.flatMap(({ part }) => (part === null ? [] : [part]))));
  readonly preview = $derived.by(() => {
    const { tool, draft, radiusM } = this.drawing;
    if (!isPattern(tool) || draft.length === 0) return null;
    if (tool === 'survey' && draft.length < 3) return null;
    if (tool === 'corridor' && draft.length < 2) return null;
    const land = this.ground && { home: this.plan.home?.spot ?? null, ground: this.ground };
    return patternPreview(tool, draft, radiusM, this.settings, this.plan.defaults.frame, this.autopilot, land);
  });
  /** The legs that cross the fence, by the item that they lead to. */
  readonly forbidden = $derived.by((): ReadonlySet<number> => {
    const { shapes } = this.plan.fence;
    const middle = this.plan.home?.spot ?? this.path.legs[0]?.to;
    if (shapes.length === 0 || !middle || shapes.some((shape) => shapeFaults(shape).length > 0)) return new Set();
    const check = new FenceCheck(shapes, middle);
    const bad = this.path.legs.filter((leg) => ['outside', 'forbidden'].includes(check.on(leg) ?? ''));
    return new Set(bad.map(({ seq }) => seq));
  });
  readonly isEmpty = $derived(
    this.plan.items.length === 0 && this.plan.fence.shapes.length === 0 && this.plan.rally.length === 0,
  );

  #changed(): void {
    this.plan = this.#editor.plan;
    this.undoWords = this.#editor.undoWords;
    this.redoWords = this.#editor.redoWords;
    this.isUnsaved = this.#editor.hasUnsaved;
    this.drawing = pruned(this.drawing, this.plan);
  }

  apply(edit: Edit): void {
    this.#editor.apply(edit);
  }

  /** Applies a step of the drawing machine: its edits, and then its next state. */
  take({ drawing, edits }: Step): void {
    for (const edit of edits) this.#editor.apply(edit);
    const whole = settled(drawing, this.plan);
    for (const edit of whole.edits) this.#editor.apply(edit);
    if (whole.edits.length > 0 && cleanOutline(drawing.draft).doubled > 0) say(t('A corner drawn twice counts once.'));
    const wasWhole = this.drawing.isWhole;
    this.drawing = pruned(whole.drawing, this.plan);
    if (!wasWhole && this.drawing.isWhole && this.drawing.tool === 'survey' && !this.retaken) {
      this.settings = { ...this.settings, angleDeg: longestSideDeg(this.drawing.draft, bearingDeg) };
    }
  }

  undo(): void {
    this.#editor.undo();
  }

  redo(): void {
    this.#editor.redo();
  }

  markSaved(name: string, library: LibraryPlace | null): void {
    this.#editor.markSaved();
    this.name = name;
    this.library = library;
    this.isUnsaved = false;
  }

  /** The initial plan, while it is untouched: no undo step, and a drawing in progress continues. */
  beginWith(plan: Plan): void {
    this.#editor = new PlanEditor(plan, () => this.#changed());
    this.#changed();
  }

  /** Replaces the plan by another, with its own history. */
  open(plan: Plan, name: string, library: LibraryPlace | null, isSaved: boolean): void {
    this.#editor = new PlanEditor(plan, () => this.#changed(), isSaved);
    this.drawing = NOTHING_DRAWN;
    this.patterns = [];
    this.retaken = null;
    this.name = name;
    this.library = library;
    this.#changed();
    this.shows += 1;
  }

  select(ids: Iterable<PartId>): void {
    this.drawing = select(this.drawing, ids);
  }

  tool(tool: Tool, command?: number): void {
    this.retaken = null;
    this.drawing = chooseTool(this.drawing, tool, command);
    const { heightM } = this.plan.defaults;
    if (isPattern(tool)) this.settings = { ...this.settings, heightM };
  }

  /** From the list of commands: at once if it needs no place, otherwise with the next click on the map. */
  add(command: number): void {
    if (specOf(command)?.place === 'needed') this.tool('item', command);
    else this.take(addItem(chooseTool(this.drawing, 'select'), this.plan, command, null));
  }

  /** Inserts the survey's items into the plan, replacing those of the one being edited again. */
  place(): void {
    const { tool, draft, radiusM } = this.drawing;
    const { preview, retaken, plan } = this;
    if (!isPattern(tool) || !preview || preview.fault || preview.items.length === 0) return;
    const at = retaken
      ? plan.items.findIndex(({ id }) => id === retaken.ids[0])
      : placeForNew(plan, this.drawing.selected);
    const first = preview.items[0]!;
    const before = plan.items.length === 0 ? seedsFor(plan, 0, first.command, null).slice(0, -1) : [];
    const from = plan.nextId + before.length;
    const ids = preview.items.map((_, index) => from + index);
    const insert = insertItems(Math.max(0, at), [...before, ...preview.items]);
    const words = retaken ? t('Change a {tool}', { tool }) : t('Add a {tool}', { tool });
    this.#editor.apply(together(words, retaken ? [insert, removeItems(retaken.ids)] : [insert]));
    const placed = { pattern: tool, drawn: draft, radiusM, settings: this.settings, ids };
    this.patterns = [...this.patterns.filter((one) => one !== retaken), placed];
    this.retaken = null;
    this.drawing = select(chooseTool(this.drawing, 'select'), ids);
  }

  /** The survey that these items came from, if all are still consecutive. */
  patternOf(ids: ReadonlySet<PartId>): PlacedPattern | null {
    const found = this.patterns.find((one) => one.ids.some((id) => ids.has(id)));
    if (!found) return null;
    const from = this.plan.items.findIndex(({ id }) => id === found.ids[0]);
    return from >= 0 && found.ids.every((id, at) => this.plan.items[from + at]?.id === id) ? found : null;
  }

  retake(placed: PlacedPattern): void {
    const { pattern, drawn, radiusM, settings } = placed;
    this.drawing = { ...chooseTool(this.drawing, pattern), draft: drawn, radiusM, isWhole: true };
    this.settings = { ...USUAL_SETTINGS, ...settings };
    this.retaken = placed;
  }

  kept(): KeptPlan {
    const { plan, name, library } = this;
    const patterns = this.patterns.flatMap(({ ids, ...rest }): KeptPattern[] => {
      const from = plan.items.findIndex(({ id }) => id === ids[0]);
      return from < 0 ? [] : [{ ...rest, from, count: ids.length }];
    });
    return { plan, name, library, isSaved: !this.isUnsaved, patterns };
  }

  restore({ plan, name, library, isSaved, patterns }: KeptPlan): void {
    this.open(plan, name, library, isSaved);
    this.patterns = patterns.flatMap(({ from, count, ...rest }): PlacedPattern[] => {
      const ids = this.plan.items.slice(from, from + count).map(({ id }) => id);
      return ids.length === count ? [{ ...rest, ids }] : [];
    });
  }
}
