export const operate = {
  title: "Bedienen",
};
