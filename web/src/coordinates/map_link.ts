/** Reads the place in a geo: URI (RFC 5870) or in the address of a map on the web. Opens nothing. Pure. */

import type { Place } from '../link/messages';

const NUMBER = String.raw`[+-]?\d{1,3}(?:\.\d+)?`;
const PAIR = new RegExp(String.raw`^\s*(${NUMBER})\s*[,~ ]\s*(${NUMBER})(?![\d.])`);
/** A pin is said before what the map happens to show. */
const PIN = new RegExp(`!3d(${NUMBER})!4d(${NUMBER})`, 'g');
const PATH = new RegExp(String.raw`/@?(${NUMBER}),[\s+]{0,2}(${NUMBER})(?![\d.])`);
const OSM_VIEW = new RegExp(String.raw`map=\d+(?:\.\d+)?/(${NUMBER})/(${NUMBER})`);
const KEYS = ['q', 'query', 'destination', 'daddr', 'll', 'coordinate', 'center', 'sll', 'cp', 'map', 'viewpoint'];
/** Longitude first. */
const YANDEX_KEYS = ['pt', 'whatshere[point]', 'll'];
const SHORTENED = /^(maps\.app\.goo\.gl|goo\.gl|g\.co|osm\.org|bit\.ly|w3w\.co|what3words\.com)$/;

const isLink = (text: string): boolean => /^https?:\/\//i.test(text);
export const isGeoUri = (text: string): boolean => /^geo:/i.test(text);

/** Whether it is an address of a place, to be read here. */
export const isPlaceAddress = (text: string): boolean => isGeoUri(text) || isLink(text);

/** Null: it holds none. `isShort`: the place is only known to the site that the address belongs to. */
export function readPlaceAddress(text: string): { readonly place: Place | null; readonly isShort: boolean } {
  if (isGeoUri(text)) return { place: readGeoUri(text.slice(4)), isShort: false };
  const url = urlOf(text);
  const place = url && readLink(url);
  return { place, isShort: place === null && url !== null && SHORTENED.test(url.hostname) };
}

function urlOf(text: string): URL | null {
  try {
    return new URL(text);
  } catch {
    return null;
  }
}

const pairOf = (text: string | null): [number, number] | null => {
  const found = PAIR.exec(text ?? '');
  return found && [Number(found[1]), Number(found[2])];
};
const placeOf = (pair: [number, number] | null): Place | null => pair && { latDeg: pair[0], lonDeg: pair[1] };

/** "47.4,8.5,410;u=20"; and Android's "0,0?q=47.4,8.5(Field)". Places are those of WGS 84 only. */
function readGeoUri(text: string): Place | null {
  const [before = '', query = ''] = text.split('?');
  if (/;crs=(?!wgs84(;|$))/i.test(before)) return null;
  const asked = pairOf(new URLSearchParams(query).get('q'));
  return placeOf(asked ?? pairOf(before));
}

function readLink(url: URL): Place | null {
  const all = `${safelyDecoded(url.pathname)}${safelyDecoded(url.hash)}`;
  const pin = [...all.matchAll(PIN)].at(-1);
  if (pin) return placeOf([Number(pin[1]), Number(pin[2])]);
  const values = url.searchParams;
  if (/(^|\.)yandex\./.test(url.hostname)) {
    const pair = YANDEX_KEYS.map((name) => pairOf(values.get(name))).find(Boolean);
    return pair ? placeOf([pair[1], pair[0]]) : null;
  }
  const marked = pairOf(`${values.get('mlat')},${values.get('mlon')}`);
  if (marked) return placeOf(marked);
  const named = KEYS.map((name) => pairOf(values.get(name)?.replace(/^loc:/, '') ?? null)).find(Boolean);
  if (named) return placeOf(named);
  const shown = PATH.exec(all) ?? OSM_VIEW.exec(all);
  if (shown) return placeOf([Number(shown[1]), Number(shown[2])]);
  return placeOf(pairOf(`${values.get('lat')},${values.get('lon') ?? values.get('lng')}`));
}

function safelyDecoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
