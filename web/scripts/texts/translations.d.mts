export interface Message {
  readonly names: readonly string[];
  readonly isPlural: boolean;
}
type Translation = string | Readonly<Record<string, string>>;
export function isTranslated(translation: Translation | undefined): boolean;
export function offeredLanguages(): Set<string>;
export function faultsOf(
  language: string,
  messages: ReadonlyMap<string, Message>,
  translations: ReadonlyMap<string, Translation>,
): string[];
