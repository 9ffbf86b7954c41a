import svelte from 'eslint-plugin-svelte';
import globals from 'globals';
import ts from 'typescript-eslint';

export default ts.config(
  { ignores: ['dist/', 'node_modules/', 'public/', 'src/link/generated/'] },
  ...ts.configs.recommended,
  ...svelte.configs.recommended,
  {
    languageOptions: { globals: { ...globals.browser, ...globals.node } },
    rules: {
      eqeqeq: 'error',
      'no-console': 'error',
      '@typescript-eslint/consistent-type-imports': 'error',
    },
  },
  {
    files: ['**/*.svelte', '**/*.svelte.ts'],
    languageOptions: { parserOptions: { parser: ts.parser } },
    // The two rules below cry wolf: our router is the hash, and plain maps are replaced whole.
    rules: { 'svelte/no-navigation-without-resolve': 'off', 'svelte/prefer-svelte-reactivity': 'off' },
  },
  {
    // The link layer knows no framework and no view (STYLE: Home Assistant's client).
    files: ['src/link/**/*.ts'],
    rules: {
      'no-restricted-imports': ['error', { patterns: ['svelte', 'svelte/*', 'maplibre-gl', '../*', '!../languages'] }],
    },
  },
  {
    // The planner and the rules of parameters know no framework, no map and no connection. Profiles are plain data.
    files: ['src/plan/**/*.ts', 'src/parameters/**/*.ts'],
    rules: {
      'no-restricted-imports': [
        'error',
        { patterns: ['svelte', 'svelte/*', 'maplibre-gl', '../link/*', '!../link/generated', '../parts/*'] },
      ],
    },
  },
  { files: ['test/fake_tower/**', 'scripts/**'], rules: { 'no-console': 'off' } },
);
