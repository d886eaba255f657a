export const viewer = {
  title: "Cloud",
};
