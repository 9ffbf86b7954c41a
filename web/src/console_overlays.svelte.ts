/** What lies over every page when the user asks for it: the search, the help of the page, the tour. */

export const overlay = $state<{ open: 'search' | 'help' | null; isTouring: boolean }>({ open: null, isTouring: false });
