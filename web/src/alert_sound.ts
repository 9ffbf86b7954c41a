/** Audible alerts, synthesised in the browser: two tones for a critical alert, one for a warning. */

import type { AlertSeverity } from './link/alerts';

const TONE_S = 0.16;
const PAUSE_S = 0.08;
const GAIN = 0.15;
const TONES_HZ: Record<AlertSeverity, readonly number[]> = {
  critical: [880, 660, 880, 660],
  warning: [620],
  notice: [],
};

let context: AudioContext | null = null;

/** Plays the tones. Returns false while the browser blocks sound: it requires a user action on the page first. */
export function playAlert(severity: AlertSeverity): boolean {
  try {
    context ??= new AudioContext();
  } catch {
    return false;
  }
  if (context.state === 'suspended') void context.resume();
  if (context.state !== 'running') return false;
  for (const [index, frequencyHz] of TONES_HZ[severity].entries()) {
    const begin = context.currentTime + index * (TONE_S + PAUSE_S);
    const tone = context.createOscillator();
    const gain = context.createGain();
    tone.frequency.value = frequencyHz;
    gain.gain.setValueAtTime(0, begin);
    gain.gain.linearRampToValueAtTime(GAIN, begin + 0.01);
    gain.gain.setValueAtTime(GAIN, begin + TONE_S - 0.02);
    gain.gain.linearRampToValueAtTime(0, begin + TONE_S);
    tone.connect(gain).connect(context.destination);
    tone.start(begin);
    tone.stop(begin + TONE_S);
  }
  return true;
}
