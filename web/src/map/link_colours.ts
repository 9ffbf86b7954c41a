/** The colours of grades of a link, in every theme. No map library here. */

import type { LinkGrade } from '../link/link_quality';

/** Blue to red, and darker from grade to grade: who sees no hues tells them by lightness. */
export const GRADE_COLOURS: Readonly<Record<LinkGrade, string>> = {
  good: '#bfe0f2',
  fair: '#6aaed6',
  poor: '#d95f0e',
  bad: '#67001f',
};
