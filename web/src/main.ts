/** Starts the console. */

import { mount } from 'svelte';

import App from './App.svelte';
import { keepConsole } from './console_version.svelte';
import { applyTheme } from './preferences.svelte';
import './styles/tokens.css';
import './styles/base.css';

applyTheme();
mount(App, { target: document.getElementById('app')! });
keepConsole();
