/** Files for the map: their names, where they are sent, progress, and the tower's words. */
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { mapFileName, uploadElevation, uploadMapFile } from '../../src/link/map_upload';

class FakeRequest {
  static last: FakeRequest;
  static status = 204;
  static text = '';
  upload: { onprogress?: (event: { loaded: number; total: number }) => void } = {};
  onload?: () => void;
  onerror?: () => void;
  opened: string[] = [];
  headers: Record<string, string> = {};
  status = FakeRequest.status;
  responseText = FakeRequest.text;

  constructor() {
    FakeRequest.last = this;
  }
  open(...words: string[]): void {
    this.opened = words;
  }
  setRequestHeader(name: string, value: string): void {
    this.headers[name] = value;
  }
  send(): void {
    this.upload.onprogress?.({ loaded: 1, total: 4 });
    this.onload?.();
  }
}

beforeEach(() => {
  FakeRequest.status = 204;
  FakeRequest.text = '';
  vi.stubGlobal('XMLHttpRequest', FakeRequest);
});
afterEach(() => vi.unstubAllGlobals());

describe('files for the map', () => {
  it.each([
    ['Alps (1).pmtiles', 'alps-1'],
    ['Copernicus DSM N47.tif', 'copernicus-dsm-n47'],
    ['hills.TIFF', 'hills'],
    ['___.tif', ''],
  ])('%s is called %s', (file, name) => {
    expect(mapFileName(file)).toBe(name);
  });

  it('sends a PMTiles file to where the map files are', async () => {
    const shares: number[] = [];
    await uploadMapFile(new File(['x'], 'Hills.pmtiles'), (share) => shares.push(share));
    expect(FakeRequest.last.opened).toEqual(['PUT', '/api/v1/map/files/hills']);
    expect(FakeRequest.last.headers).toEqual({ 'Content-Type': 'application/vnd.pmtiles' });
    expect(shares).toEqual([0.25]);
  });

  it('sends a GeoTIFF to be converted, with title and credit', async () => {
    FakeRequest.status = 202;
    await uploadElevation(new File(['x'], 'My Hills.tif'), '© A & B', () => undefined);
    const [method, address] = FakeRequest.last.opened;
    const url = new URL(address ?? '', 'http://tower');
    expect([method, url.pathname]).toEqual(['PUT', '/api/v1/map/elevation/my-hills']);
    expect(Object.fromEntries(url.searchParams)).toEqual({ title: 'My Hills', attribution: '© A & B' });
    expect(FakeRequest.last.headers).toEqual({ 'Content-Type': 'image/tiff' });
  });

  it("says what is wrong in the tower's words", async () => {
    FakeRequest.status = 422;
    FakeRequest.text = JSON.stringify({ detail: 'the file is no TIFF file' });
    await expect(uploadElevation(new File(['x'], 'a.tif'), '', () => undefined)).rejects.toThrow('no TIFF file');
    FakeRequest.status = 502;
    FakeRequest.text = '<html>';
    await expect(uploadElevation(new File(['x'], 'a.tif'), '', () => undefined)).rejects.toThrow('502');
    await expect(uploadElevation(new File(['x'], '….tif'), '', () => undefined)).rejects.toThrow('letters or digits');
  });
});
