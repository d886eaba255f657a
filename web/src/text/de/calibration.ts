export const calibration = {
  title: "Kalibrierung",
};
