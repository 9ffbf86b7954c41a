/** The module that scripts/mpeg1_decoder_file.ts generates, and its source. */

declare module 'virtual:mpeg1-decoder' {
  /** The URL of the decoder. */
  const address: string;
  export default address;
}

declare module '@cycjimmy/jsmpeg-player' {
  const JSMpeg: { readonly WASM_BINARY_INLINED: string };
  export default JSMpeg;
}
