/** The map's colours, read from the design tokens: a canvas cannot use CSS variables by itself. */

import type { DroneState } from '../link/flight_values';

const GROUND = {
  farmland: 'map-farmland',
  wheat: 'map-wheat',
  rape: 'map-rape',
  maize: 'map-maize',
  soil: 'map-soil',
  meadow: 'map-green',
  forest: 'map-forest',
  building: 'map-building',
  road: 'map-road',
  roadMajor: 'map-road-major',
  roadEdge: 'map-road-edge',
} as const;
type GroundColour = keyof typeof GROUND;

const LABEL = {
  place: 'map-label',
  quiet: 'map-label-quiet',
  road: 'map-label-road',
  water: 'map-label-water',
  halo: 'map-label-halo',
  onImagery: 'map-label-on-imagery',
  onImageryHalo: 'map-label-on-imagery-halo',
} as const;
type LabelColour = keyof typeof LABEL;

export interface MapTheme {
  readonly sea: string;
  readonly land: string;
  readonly coast: string;
  readonly border: string;
  readonly ground: Readonly<Record<GroundColour, string>>;
  readonly label: Readonly<Record<LabelColour, string>>;
  readonly imagery: { readonly brightness: number; readonly saturation: number };
  readonly grid: string;
  readonly gridText: string;
  readonly halo: string;
  readonly text: string;
  readonly home: string;
  readonly target: string;
  readonly accent: string;
  readonly warning: string;
  readonly danger: string;
  readonly good: string;
  readonly way: string;
  readonly onWay: string;
  readonly done: string;
  readonly onDone: string;
  readonly rally: string;
  readonly states: Readonly<Record<DroneState, string>>;
}

export function readTheme(): MapTheme {
  const style = getComputedStyle(document.documentElement);
  const token = (name: string): string => style.getPropertyValue(`--${name}`).trim();
  const tokens = <K extends string>(names: Readonly<Record<K, string>>): Record<K, string> =>
    Object.fromEntries(Object.entries<string>(names).map(([key, name]) => [key, token(name)])) as Record<K, string>;
  return {
    sea: token('map-sea'),
    land: token('map-land'),
    coast: token('map-coast'),
    border: token('map-border'),
    ground: tokens(GROUND),
    label: tokens(LABEL),
    imagery: {
      brightness: Number(token('map-imagery-brightness')),
      saturation: Number(token('map-imagery-saturation')),
    },
    grid: token('map-grid'),
    gridText: token('map-grid-text'),
    halo: token('map-halo'),
    text: token('text'),
    home: token('map-home'),
    target: token('map-target'),
    accent: token('accent'),
    warning: token('warning'),
    danger: token('danger'),
    good: token('good'),
    way: token('plan-way'),
    onWay: token('on-plan-way'),
    done: token('plan-done'),
    onDone: token('on-plan-done'),
    rally: token('plan-rally'),
    states: {
      alert: token('state-alert'),
      flying: token('state-flying'),
      armed: token('state-armed'),
      idle: token('state-idle'),
      lost: token('state-lost'),
    },
  };
}

export function onThemeChange(listener: () => void): () => void {
  const observer = new MutationObserver(listener);
  observer.observe(document.documentElement, { attributeFilter: ['data-theme'] });
  return () => observer.disconnect();
}
