export const viewer = {
  title: "Punktwolke",
};
