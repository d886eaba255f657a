export const health = {
  title: "Zustand",
};
