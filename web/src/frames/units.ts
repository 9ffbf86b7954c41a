/** The wire's units as people read them: `degE7` in degrees, `mm` in metres. */

import type { Field } from '../link/field_types';

interface ShownUnit {
  readonly unit: string;
  readonly factor: number;
}

const DEGREES = 180 / Math.PI;
const SHOWN: Readonly<Record<string, ShownUnit>> = {
  degE7: { unit: '°', factor: 1e-7 },
  degE5: { unit: '°', factor: 1e-5 },
  cdeg: { unit: '°', factor: 0.01 },
  deg: { unit: '°', factor: 1 },
  rad: { unit: '°', factor: DEGREES },
  'rad/s': { unit: '°/s', factor: DEGREES },
  'mrad/s': { unit: '°/s', factor: DEGREES / 1000 },
  'deg/s': { unit: '°/s', factor: 1 },
  'ddeg/s': { unit: '°/s', factor: 0.1 },
  mm: { unit: 'm', factor: 0.001 },
  cm: { unit: 'm', factor: 0.01 },
  dm: { unit: 'm', factor: 0.1 },
  'cm/s': { unit: 'm/s', factor: 0.01 },
  'dm/s': { unit: 'm/s', factor: 0.1 },
  'mm/s': { unit: 'm/s', factor: 0.001 },
  'm/s/s': { unit: 'm/s²', factor: 1 },
  mV: { unit: 'V', factor: 0.001 },
  cV: { unit: 'V', factor: 0.01 },
  cA: { unit: 'A', factor: 0.01 },
  mA: { unit: 'A', factor: 0.001 },
  'd%': { unit: '%', factor: 0.1 },
  'c%': { unit: '%', factor: 0.01 },
  cdegC: { unit: '°C', factor: 0.01 },
  degC: { unit: '°C', factor: 1 },
};

export const shownUnit = ({ unit }: Field): ShownUnit => SHOWN[unit] ?? { unit, factor: 1 };
