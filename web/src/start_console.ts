/** The console itself, once its language is there. */

import { mount } from 'svelte';

import App from './App.svelte';
import { keepConsole } from './console_version.svelte';
import { applyTheme } from './preferences.svelte';

export function startConsole(): void {
  applyTheme();
  mount(App, { target: document.getElementById('app')! });
  keepConsole();
}
