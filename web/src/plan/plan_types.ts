/**
 * A plan as the planner holds it: mission, fence and rally points, unchangeable values that edits replace. Places are whole
 * numbers of 1e-7 degrees and heights are float32, as the wire carries them: what is drawn is what is flown.
 * Nothing of a framework, a map or a connection comes in here.
 */

export type PlanKind = 'mission' | 'fence' | 'rally';

/** Stays with an item, a shape or a point while others are moved, put in and taken out; never used twice in a plan. */
export type PartId = number;

/** In 1e-7 degrees. */
export interface Spot {
  readonly latE7: number;
  readonly lonE7: number;
}

/** `null` is "not given": a NaN on the wire. */
export type Param = number | null;
export type Params = readonly [Param, Param, Param, Param];

/** What MISSION_ITEM_INT carries of an item. `x` and `y` are 1e-7 degrees where the frame is global, raw numbers elsewhere. */
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
  /** Of a jump: the item that it goes to, wherever that moves. `null`: parameter 1 is a number that names no item here. */
  readonly jumpTo: PartId | null;
}

export interface FencePolygon {
  readonly id: PartId;
  /** The drone must stay inside; otherwise it must stay outside. */
  readonly inclusion: boolean;
  /** Inclusion polygons of one group hold together (MAVLink: parameter 2). */
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
  /** In the order that they are sent in. */
  readonly shapes: readonly FenceShape[];
  readonly returnPoint: FenceReturn | null;
}

export interface RallyPoint {
  readonly id: PartId;
  readonly frame: number;
  readonly spot: Spot;
  readonly heightM: number;
}

/** Where the plan takes it that the drone starts: heights above home and distances from home are measured from it. */
export interface PlannedHome {
  readonly spot: Spot;
  /** Above mean sea level. */
  readonly altM: number;
}

/** What new items begin with. */
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

/** The tower takes no more (MAX_ITEMS_ANY of wire/plans.py); what an autopilot has room for is in plan_room.ts. */
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

/** A place on earth, to the last digit that the wire carries. */
export const isOnEarth = (spot: Spot): boolean =>
  Number.isInteger(spot.latE7) &&
  Number.isInteger(spot.lonE7) &&
  Math.abs(spot.latE7) <= 900_000_000 &&
  Math.abs(spot.lonE7) <= 1_800_000_000;
