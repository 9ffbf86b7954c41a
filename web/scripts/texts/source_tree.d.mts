export function sourceFiles(): string[];
export function readSource(path: string): string;
export function lineAt(code: string, at: number): number;
