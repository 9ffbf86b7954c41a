/** Draws pictures with WebGL: uploads the planes unchanged, and the graphics card computes the colours. */

import type { AnyCanvas, Planes, Screen } from './screen';

const CORNERS = `
attribute vec2 corner;
uniform vec2 part;
varying vec2 at;
void main() {
  at = corner * part;
  gl_Position = vec4(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0);
}`;

// ITU-R BT.601 with luma 16 to 235, as in MPEG-1.
const FROM_PLANES = `
precision mediump float;
uniform sampler2D y;
uniform sampler2D cb;
uniform sampler2D cr;
varying vec2 at;
void main() {
  float luma = 1.16438 * (texture2D(y, at).r - 0.0627451);
  float blue = texture2D(cb, at).r - 0.5019608;
  float red = texture2D(cr, at).r - 0.5019608;
  gl_FragColor = vec4(luma + 1.59603 * red, luma - 0.39176 * blue - 0.81297 * red, luma + 2.01723 * blue, 1.0);
}`;

const FROM_FRAME = `
precision mediump float;
uniform sampler2D frame;
varying vec2 at;
void main() {
  gl_FragColor = vec4(texture2D(frame, at).rgb, 1.0);
}`;

interface Drawing {
  readonly program: WebGLProgram;
  readonly part: WebGLUniformLocation | null;
  readonly textures: readonly WebGLTexture[];
}

/** Null without WebGL. */
export function webglScreen(canvas: AnyCanvas): Screen | null {
  const gl = canvas.getContext('webgl', {
    alpha: false,
    antialias: false,
    depth: false,
    stencil: false,
    powerPreference: 'low-power',
  }) as WebGLRenderingContext | null;
  return gl && new WebglScreen(canvas, gl);
}

class WebglScreen implements Screen {
  readonly #canvas: AnyCanvas;
  readonly #gl: WebGLRenderingContext;
  #planes: Drawing;
  #frame: Drawing;
  #last: { drawing: Drawing; part: readonly [number, number] } | null = null;

  constructor(canvas: AnyCanvas, gl: WebGLRenderingContext) {
    this.#canvas = canvas;
    this.#gl = gl;
    [this.#planes, this.#frame] = this.#begin();
    // The graphics card may disappear for a while (a driver restart, a tablet that sleeps).
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.#last = null;
    });
    canvas.addEventListener('webglcontextrestored', () => {
      [this.#planes, this.#frame] = this.#begin();
    });
  }

  planes({ width, height, codedWidth, codedHeight, y, cb, cr }: Planes): void {
    const gl = this.#gl;
    this.#fit(width, height);
    gl.useProgram(this.#planes.program);
    const halfWidth = codedWidth / 2;
    const halfHeight = codedHeight / 2;
    this.#upload(0, codedWidth, codedHeight, y);
    this.#upload(1, halfWidth, halfHeight, cb);
    this.#upload(2, halfWidth, halfHeight, cr);
    this.#last = { drawing: this.#planes, part: [width / codedWidth, height / codedHeight] };
    this.again();
  }

  frame(picture: VideoFrame): void {
    const gl = this.#gl;
    this.#fit(picture.displayWidth, picture.displayHeight);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.#frame.textures[0] ?? null);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    this.#last = { drawing: this.#frame, part: [1, 1] };
    this.again();
  }

  again(): void {
    if (!this.#last) return;
    const gl = this.#gl;
    const { drawing, part } = this.#last;
    gl.useProgram(drawing.program);
    gl.uniform2f(drawing.part, ...part);
    drawing.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  #fit(width: number, height: number): void {
    if (this.#canvas.width === width && this.#canvas.height === height) return;
    this.#canvas.width = width;
    this.#canvas.height = height;
    this.#gl.viewport(0, 0, width, height);
  }

  #upload(unit: number, width: number, height: number, plane: Uint8Array): void {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.#planes.textures[unit] ?? null);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.LUMINANCE, width, height, 0, gl.LUMINANCE, gl.UNSIGNED_BYTE, plane);
  }

  #begin(): [Drawing, Drawing] {
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, Float32Array.of(0, 0, 1, 0, 0, 1, 1, 1), gl.STATIC_DRAW);
    gl.viewport(0, 0, this.#canvas.width, this.#canvas.height);
    return [this.#drawing(FROM_PLANES, ['y', 'cb', 'cr']), this.#drawing(FROM_FRAME, ['frame'])];
  }

  #drawing(source: string, samplers: readonly string[]): Drawing {
    const gl = this.#gl;
    const program = gl.createProgram();
    for (const [type, text] of [
      [gl.VERTEX_SHADER, CORNERS],
      [gl.FRAGMENT_SHADER, source],
    ] as const) {
      const shader = gl.createShader(type);
      if (!shader) continue; // the context was lost: it will be set up again
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    // The same location in both programs, so that it is bound only once.
    gl.bindAttribLocation(program, 0, 'corner');
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    const textures = samplers.map((name, unit) => {
      gl.uniform1i(gl.getUniformLocation(program, name), unit);
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const filter of [gl.TEXTURE_MAG_FILTER, gl.TEXTURE_MIN_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
      }
      for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
        gl.texParameteri(gl.TEXTURE_2D, edge, gl.CLAMP_TO_EDGE);
      }
      return texture;
    });
    return { program, part: gl.getUniformLocation(program, 'part'), textures };
  }
}
