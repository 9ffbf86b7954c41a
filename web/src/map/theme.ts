/** The map's colours, read from the design tokens: a canvas cannot use CSS variables by itself. */

import type { DroneState } from '../link/flight_values';

export interface MapTheme {
  readonly sea: string;
  readonly land: string;
  readonly coast: string;
  readonly border: string;
  readonly green: string;
  readonly building: string;
  readonly road: string;
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
  return {
    sea: token('map-sea'),
    land: token('map-land'),
    coast: token('map-coast'),
    border: token('map-border'),
    green: token('map-green'),
    building: token('map-building'),
    road: token('map-road'),
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
