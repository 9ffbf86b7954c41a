/**
 * Which page is shown: the hash of the address. `#/` is the monitor, `#/drone/7` the control page of drone 7,
 * `#/account/tokens` a section of one's own account, `#/admin/users` one of the administration.
 */

export type Route =
  | { readonly page: 'monitor' }
  | { readonly page: 'control'; readonly droneId: number }
  | { readonly page: 'account' | 'admin'; readonly section: string };

export function readRoute(hash: string): Route {
  const control = /^#\/drone\/(\d+)$/.exec(hash);
  if (control) return { page: 'control', droneId: Number(control[1]) };
  const sectioned = /^#\/(account|admin)(?:\/([a-z-]*))?$/.exec(hash);
  if (sectioned) return { page: sectioned[1] as 'account' | 'admin', section: sectioned[2] ?? '' };
  return { page: 'monitor' };
}

export const monitorHref = '#/';
export const controlHref = (droneId: number): string => `#/drone/${droneId}`;
export const accountHref = (section = ''): string => `#/account${section && `/${section}`}`;
export const adminHref = (section = ''): string => `#/admin${section && `/${section}`}`;

export const navigation = $state({ route: readRoute(window.location.hash) });
window.addEventListener('hashchange', () => {
  navigation.route = readRoute(window.location.hash);
});
