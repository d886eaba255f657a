/** Titles by the last segment of a problem's type; English titles come from the server. */
export const problems = {} as Record<string, string>;
