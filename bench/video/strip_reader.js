// Reads a canvas at each animation frame and once between two. Runs in the page that shows it, with the CSS selector of
// the canvas. `window.stripReader` then has [Unix ms, cells] for each change of the clock strip (bench/video/strip.py),
// the number of reads, and the longest time between two reads.
(selector) => {
  const CELLS = 20;
  const CELL_PX = 8;
  const PICTURE_ROWS = 120;
  const STRIP_ROWS = 6; // a twentieth of the picture
  const LEAST_CONTRAST = 60;
  const SECOND_LOOK_MS = 6;

  const copy = document.createElement('canvas');
  copy.width = CELLS * CELL_PX;
  copy.height = STRIP_ROWS; // the rest of the picture is cropped
  const pen = copy.getContext('2d', { willReadFrequently: true, alpha: false });
  const reader = { readings: [], looks: 0, longestGapMs: 0 };
  let last = -1;
  let lastLook = 0;

  function cells() {
    const canvas = document.querySelector(selector);
    if (canvas === null || canvas.width === 0) return null;
    pen.drawImage(canvas, 0, 0, copy.width, PICTURE_ROWS);
    const pixels = pen.getImageData(0, 2, copy.width, 2).data;
    const level = (cell) => {
      let sum = 0;
      for (let row = 0; row < 2; row += 1)
        for (let x = 2; x < CELL_PX - 2; x += 1) sum += pixels[4 * (row * copy.width + cell * CELL_PX + x) + 1];
      return sum / (2 * (CELL_PX - 4));
    };
    const black = level(0);
    const white = level(1);
    if (white - black < LEAST_CONTRAST) return null;
    let bits = 0;
    for (let cell = 0; cell < CELLS; cell += 1) bits = (bits << 1) | (level(cell) > (black + white) / 2 ? 1 : 0);
    return bits;
  }

  function look(at) {
    requestAnimationFrame(look);
    reader.looks += 1;
    if (lastLook) reader.longestGapMs = Math.max(reader.longestGapMs, at - lastLook);
    lastLook = at;
    see();
    // A worker's drawing reaches the page's canvas shortly after the beginning of the frame that shows it.
    setTimeout(see, SECOND_LOOK_MS);
  }

  function see() {
    const now = cells();
    if (now === null || now === last) return;
    last = now;
    reader.readings.push([Date.now(), now]);
  }

  window.stripReader = reader;
  requestAnimationFrame(look);
}
