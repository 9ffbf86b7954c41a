/**
 * Short messages about a user action that need no response ("Saved."). What matters for a drone is an alert
 * (docs/alerts.md), a banner or an inline report, never a toast alone.
 */

import { toast } from 'svelte-sonner';

export type ToastTone = 'done' | 'failed' | 'plain';

export function say(text: string, tone: ToastTone = 'plain'): void {
  if (tone === 'done') toast.success(text);
  else if (tone === 'failed') toast.error(text);
  else toast(text);
}
