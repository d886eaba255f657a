/** Titles by the last part of a problem's type; the English ones come with the problems. */
export const problems = {} as Record<string, string>;
