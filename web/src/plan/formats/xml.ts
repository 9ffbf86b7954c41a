/** Reads XML of other programs, whatever prefix their names have. */

import { t } from '../../languages/text';
import { NotAPlanFile } from './plan_file';

/** The browser's DOMParser, or an equivalent. Throws, or makes a `parsererror`, if the text is not XML. */
export type ParseXml = (text: string) => Document;

export const looksLikeXml = (text: string): boolean => text.startsWith('<');

export function rootOf(text: string, parseXml: ParseXml): Element {
  let root: Element | null = null;
  try {
    const document = parseXml(text);
    if (document.getElementsByTagName('parsererror').length === 0) root = document.documentElement;
  } catch {
    // It is not XML.
  }
  if (!root) throw new NotAPlanFile(t('This file is not whole: its XML cannot be read.'));
  return root;
}

export const childrenOf = (element: Element): Element[] =>
  Array.from(element.childNodes).filter((node): node is Element => node.nodeType === 1);

export const descendantsOf = (element: Element): Element[] => Array.from(element.getElementsByTagName('*'));

/** The text of the first child of this name, or nothing. */
export const textOf = (element: Element, name: string): string =>
  childrenOf(element).find(({ localName }) => localName === name)?.textContent ?? '';
