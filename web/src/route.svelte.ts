/** Which page is shown: the hash of the address. `#/` is the monitor, `#/drone/7` the control page of drone 7. */

export type Route = { readonly page: 'monitor' } | { readonly page: 'control'; readonly droneId: number };

export function readRoute(hash: string): Route {
  const control = /^#\/drone\/(\d+)$/.exec(hash);
  return control ? { page: 'control', droneId: Number(control[1]) } : { page: 'monitor' };
}

export const monitorHref = '#/';
export const controlHref = (droneId: number): string => `#/drone/${droneId}`;

export const navigation = $state({ route: readRoute(window.location.hash) });
window.addEventListener('hashchange', () => {
  navigation.route = readRoute(window.location.hash);
});
