import type { Schemas } from "../../api/client";

export const dark_frame = {
  title: "Dark frame",
  none: "None taken. A dark frame corrects hot pixels and the fixed-pattern noise of the sensor in every frame.",
  take: "Take dark frame",
  retake: "Retake",
  remove: "Remove",
  cover_lens:
    "Cover the lens. The laser turns off, and 32 frames are averaged at the current exposure and gain. Then uncover the lens again.",
  covered: "Lens is covered: take it",
  taken: "Taken",
  exposure: "Exposure, gain",
  hot_pixels: "Hot pixels",
  noise: "Temporal noise",
  pattern: "Fixed-pattern noise",
  levels: (value: string, full_scale: number) => `${value} of ${full_scale} grey levels`,
  used: {
    no_dark_frame: "Frames are not corrected.",
    other_camera: "Not in use: it belongs to another camera. Retake it.",
    other_format: "Not in use: image size or bit depth has changed. Retake it.",
    hot_pixels:
      "Hot pixels are corrected; fixed-pattern noise is not, because exposure or gain has changed. Retake it to correct both.",
    full: "Hot pixels and fixed-pattern noise are corrected in every frame.",
  } as Record<Schemas["DarkFrameUseDto"], string>,
};
