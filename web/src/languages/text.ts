/**
 * The texts of the console in the chosen language. The English text is the key: English needs no catalogue and no
 * look-up. Nothing here loads a catalogue (loading.ts) or knows a page.
 */

import type { Language } from './languages';

/** The forms of a text that counts, by the categories of `Intl.PluralRules`; `other` is always there. */
export type PluralForms = Readonly<Partial<Record<Intl.LDMLPluralRule, string>> & { other: string }>;
/** Translations by English text. Those of `tAs` have their context behind it: `Open [[verb]]`. */
export type Catalogue = Readonly<Record<string, string | PluralForms>>;
/** Nothing is shown for null and undefined. */
export type TextValue = string | number | null | undefined;

type NamesIn<Message extends string> = Message extends `${string}{${infer Name}}${infer Rest}`
  ? Name | NamesIn<Rest>
  : never;
/** Exactly the values that a message names; a message without names takes none. */
type ValuesOf<Name extends string> = [Name] extends [never] ? [] : [values: Readonly<Record<Name, TextValue>>];
/** A text that is not known when it is compiled cannot be collected for the translators. */
type Known<Message extends string> = string extends Message ? never : Message;

let catalogue: Catalogue | null = null;
let chosen: Language = 'en';
let plurals: Intl.PluralRules | null = null;
let decimalSign = '.';

/** Once, before any module with texts is loaded: tables of words call `t` when they are made. Null: English. */
export function useCatalogue(language: Language, texts: Catalogue | null): void {
  chosen = language;
  catalogue = texts;
  plurals = texts && new Intl.PluralRules(language);
  const parts = texts ? new Intl.NumberFormat(language).formatToParts(1.5) : [];
  decimalSign = parts.find(({ type }) => type === 'decimal')?.value ?? '.';
}

export const currentLanguage = (): Language => chosen;

/** A number as text (`12.5`) with the decimal sign of the language. */
export const inLanguage = (number: string): string => (decimalSign === '.' ? number : number.replace('.', decimalSign));

function filled(message: string, values: Readonly<Record<string, TextValue>> | undefined): string {
  if (!values) return message;
  return message.replace(/\{(\w+)\}/g, (hole, name: string) => {
    if (!(name in values)) return hole;
    const value = values[name];
    return typeof value === 'number' ? inLanguage(String(value)) : (value ?? '');
  });
}

function found(key: string): string | null {
  const translation = catalogue?.[key];
  return (typeof translation === 'string' ? translation : translation?.other) || null;
}

/** `t('Hold {drone}', { drone })`. Numbers are written as the language does. */
export function t<const Message extends string>(
  message: Known<Message>,
  ...values: ValuesOf<NamesIn<Message>>
): string {
  return filled(found(message) ?? message, values[0]);
}

/** For the rare English text with two meanings: `tAs('verb', 'Open')`. */
export function tAs<const Message extends string>(
  context: string,
  message: Known<Message>,
  ...values: ValuesOf<NamesIn<Message>>
): string {
  return filled(found(`${message} [[${context}]]`) ?? message, values[0]);
}

/** `plural(drones, { one: '{n} drone', other: '{n} drones' })`; the key of the catalogue is the form `other`. */
export function plural<const One extends string, const Other extends string>(
  n: number,
  forms: { readonly one: Known<One>; readonly other: Known<Other> },
  ...values: ValuesOf<Exclude<NamesIn<One> | NamesIn<Other>, 'n'>>
): string {
  const translation = catalogue?.[forms.other] || undefined;
  const english = n === 1 ? forms.one : forms.other;
  const message =
    translation === undefined
      ? english
      : typeof translation === 'string'
        ? translation
        : (translation[plurals?.select(n) ?? 'other'] ?? translation.other);
  return filled(message, { ...values[0], n });
}
