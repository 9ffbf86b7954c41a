export interface StrayText {
  readonly kind: 'run' | 'attribute' | 'literal';
  readonly start: number;
  readonly end: number;
  /** With `{}` for each value in it. */
  readonly shown: string;
}
export function strayTexts(path: string, code: string): StrayText[];
