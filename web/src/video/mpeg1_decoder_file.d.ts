/** What scripts/mpeg1_decoder_file.ts makes, and what it makes it of. */

declare module 'virtual:mpeg1-decoder' {
  /** Its address. */
  const address: string;
  export default address;
}

declare module '@cycjimmy/jsmpeg-player' {
  const JSMpeg: { readonly WASM_BINARY_INLINED: string };
  export default JSMpeg;
}
