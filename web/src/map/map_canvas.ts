/**
 * A canvas over the map, of the map's size and resolution: what is painted on it stays in place while the map moves.
 * The owner paints: `paint` is called for each frame of the map, and once after `soon()`.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { Projection } from './projection';
import { drawnGround } from './relief';

export type Pen = CanvasRenderingContext2D;

/** An empty canvas, its projection and its size. */
export interface Sheet {
  readonly pen: Pen;
  readonly projection: Projection;
  readonly zoom: number;
  readonly widthPx: number;
  readonly heightPx: number;
}

export interface MapCanvasOptions {
  readonly paint: (sheet: Sheet) => void;
  /** Directly above the ground, below the other canvases. */
  readonly isLowest?: boolean;
  readonly testId?: string;
}

export class MapCanvas {
  readonly pen: Pen;
  readonly #map: MapLibreMap;
  readonly #canvas: HTMLCanvasElement;
  readonly #paint: (sheet: Sheet) => void;
  #frame = 0;

  /** Paints first with the next frame, after the owner's constructor has finished. */
  constructor(map: MapLibreMap, { paint, isLowest = false, testId }: MapCanvasOptions) {
    this.#map = map;
    this.#paint = paint;
    this.#canvas = document.createElement('canvas');
    this.#canvas.setAttribute('aria-hidden', 'true');
    if (testId !== undefined) this.#canvas.dataset['testid'] = testId;
    Object.assign(this.#canvas.style, { position: 'absolute', inset: '0', pointerEvents: 'none' });
    if (isLowest) map.getCanvas().after(this.#canvas);
    else map.getCanvasContainer().append(this.#canvas);
    this.pen = this.#canvas.getContext('2d')!;
    map.on('resize', this.#resized);
    // In the same frame as the map, so that the painting does not lag behind it.
    map.on('render', this.#draw);
    this.#fit();
    this.soon();
  }

  /** The content has changed. */
  soon(): void {
    this.#frame ||= requestAnimationFrame(this.#draw);
  }

  projection(): Projection {
    const { clientWidth: widthPx, clientHeight: heightPx } = this.#map.getContainer();
    const { lat, lng } = this.#map.getCenter();
    return new Projection({
      centre: { latDeg: lat, lonDeg: lng },
      zoom: this.#map.getZoom(),
      widthPx,
      heightPx,
      tiltDeg: this.#map.getPitch(),
      ground: drawnGround(this.#map),
    });
  }

  remove(): void {
    cancelAnimationFrame(this.#frame);
    this.#map.off('resize', this.#resized);
    this.#map.off('render', this.#draw);
    this.#canvas.remove();
  }

  #fit(): void {
    const { clientWidth, clientHeight } = this.#map.getContainer();
    const ratio = window.devicePixelRatio || 1;
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    Object.assign(this.#canvas.style, { width: `${clientWidth}px`, height: `${clientHeight}px` });
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  readonly #resized = (): void => {
    this.#fit();
    this.#draw(); // at once: resizing emptied it
  };

  readonly #draw = (): void => {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const { clientWidth: widthPx, clientHeight: heightPx } = this.#map.getContainer();
    this.pen.clearRect(0, 0, widthPx, heightPx);
    this.#paint({ pen: this.pen, projection: this.projection(), zoom: this.#map.getZoom(), widthPx, heightPx });
  };
}
