import type { Catalogue } from "../en";

export const dark_frame: Catalogue["dark_frame"] = {
  title: "Dunkelbild",
  none: "Keines aufgenommen. Ein Dunkelbild korrigiert Hotpixel und das Festmusterrauschen des Sensors in jedem Bild.",
  take: "Dunkelbild aufnehmen",
  retake: "Neu aufnehmen",
  remove: "Entfernen",
  cover_lens:
    "Das Objektiv abdecken. Der Laser wird ausgeschaltet, und 32 Bilder werden mit der aktuellen Belichtung und Verstärkung gemittelt. Danach die Abdeckung wieder abnehmen.",
  covered: "Objektiv ist abgedeckt: aufnehmen",
  taken: "Aufgenommen",
  exposure: "Belichtung, Verstärkung",
  hot_pixels: "Hotpixel",
  noise: "Zeitliches Rauschen",
  pattern: "Festmusterrauschen",
  levels: (value, full_scale) => `${value} von ${full_scale} Graustufen`,
  used: {
    no_dark_frame: "Die Bilder werden nicht korrigiert.",
    other_camera: "Nicht verwendet: Es gehört zu einer anderen Kamera. Neu aufnehmen.",
    other_format: "Nicht verwendet: Bildgröße oder Bittiefe hat sich geändert. Neu aufnehmen.",
    hot_pixels:
      "Hotpixel werden korrigiert; das Festmusterrauschen nicht, weil sich Belichtung oder Verstärkung geändert hat. Neu aufnehmen, um beides zu korrigieren.",
    full: "Hotpixel und Festmusterrauschen werden in jedem Bild korrigiert.",
  },
};
