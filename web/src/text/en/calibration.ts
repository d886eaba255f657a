export const calibration = {
  title: "Calibration",
};
