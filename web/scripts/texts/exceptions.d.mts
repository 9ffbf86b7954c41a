export const BY_PLACE: Readonly<Record<string, true | readonly string[]>>;
