/**
 * A plan in the planner: mission, fence and rally points, immutable values that edits replace. Places are integers of
 * 1e-7 degrees and heights are float32, as on the wire: the drone flies exactly what is drawn. Independent of any
 * framework, map or connection.
 */

export type PlanKind = 'mission' | 'fence' | 'rally';

/** Identifies an item, a shape or a point across moves, insertions and removals; never reused in a plan. */
export type PartId = number;

/** In 1e-7 degrees. */
export interface Spot {
  readonly latE7: number;
  readonly lonE7: number;
}

/** `null` means "not given": a NaN on the wire. */
export type Param = number | null;
export type Params = readonly [Param, Param, Param, Param];

/** The fields of a MISSION_ITEM_INT. `x` and `y` are 1e-7 degrees if the frame is global, raw numbers otherwise. */
export interface WireItem {
  readonly command: number;
  readonly frame: number;
  readonly params: Params;
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly autocontinue: number;
}

export interface PlanItem extends WireItem {
  readonly id: PartId;
  /** For a jump: its target item, which it follows. `null`: parameter 1 is a number that names no item here. */
  readonly jumpTo: PartId | null;
}

export interface FencePolygon {
  readonly id: PartId;
  /** True: an inclusion area; false: an exclusion area. */
  readonly inclusion: boolean;
  /** Inclusion polygons of one group belong together (MAVLink: parameter 2). */
  readonly group: number;
  readonly frame: number;
  readonly corners: readonly Spot[];
}

export interface FenceCircle {
  readonly id: PartId;
  readonly inclusion: boolean;
  readonly group: number;
  readonly frame: number;
  readonly centre: Spot;
  readonly radiusM: number;
}

export type FenceShape = ({ readonly shape: 'polygon' } & FencePolygon) | ({ readonly shape: 'circle' } & FenceCircle);

export interface FenceReturn {
  readonly frame: number;
  readonly spot: Spot;
  readonly heightM: number;
}

export interface Fence {
  /** In upload order. */
  readonly shapes: readonly FenceShape[];
  readonly returnPoint: FenceReturn | null;
}

export interface RallyPoint {
  readonly id: PartId;
  readonly frame: number;
  readonly spot: Spot;
  readonly heightM: number;
}

/** The assumed start of the drone: heights above home and distances from home refer to it. */
export interface PlannedHome {
  readonly spot: Spot;
  /** Above mean sea level. */
  readonly altM: number;
}

/** Defaults of new items. */
export interface PlanDefaults {
  readonly heightM: number;
  readonly frame: number;
  readonly speedMS: number;
}

export interface Plan {
  readonly home: PlannedHome | null;
  readonly items: readonly PlanItem[];
  readonly fence: Fence;
  readonly rally: readonly RallyPoint[];
  readonly defaults: PlanDefaults;
  readonly nextId: PartId;
}

/** The tower's limit (MAX_ITEMS_ANY of wire/plans.py); the autopilots' limits are in their profiles. */
export const MAX_ITEMS = 724;

export const EMPTY_PLAN: Plan = {
  home: null,
  items: [],
  fence: { shapes: [], returnPoint: null },
  rally: [],
  defaults: { heightM: 50, frame: 3, speedMS: 5 },
  nextId: 1,
};

export const degOf = (e7: number): number => e7 / 1e7;
export const e7Of = (deg: number): number => Math.round(deg * 1e7);
export const spotOf = (latDeg: number, lonDeg: number): Spot => ({ latE7: e7Of(latDeg), lonE7: e7Of(lonDeg) });
export const latDegOf = (spot: Spot): number => degOf(spot.latE7);
export const lonDegOf = (spot: Spot): number => degOf(spot.lonE7);

/** A valid place on earth, in the wire's resolution. */
export const isOnEarth = (spot: Spot): boolean =>
  Number.isInteger(spot.latE7) &&
  Number.isInteger(spot.lonE7) &&
  Math.abs(spot.latE7) <= 900_000_000 &&
  Math.abs(spot.lonE7) <= 1_800_000_000;
