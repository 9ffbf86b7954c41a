/** Starts the console in the chosen language. Nothing with texts may be imported here: it would miss the catalogue. */

import { loadLanguage } from './languages/loading';
import './styles/tokens.css';
import './styles/base.css';

void loadLanguage()
  .then(() => import('./start_console'))
  .then(({ startConsole }) => startConsole());
