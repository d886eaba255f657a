export const results = {
  title: "Ergebnisse",
};
