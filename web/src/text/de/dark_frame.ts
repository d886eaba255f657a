import type { Catalogue } from "../en";

export const dark_frame: Catalogue["dark_frame"] = {
  title: "Dunkelbild",
  none: "Keines aufgenommen. Ein Dunkelbild korrigiert Hotpixel und das feste Muster des Sensors in jedem Bild.",
  take: "Dunkelbild aufnehmen",
  retake: "Neu aufnehmen",
  remove: "Entfernen",
  cover_lens:
    "Decken Sie das Objektiv ab. Der Laser wird ausgeschaltet, und 32 Bilder werden mit der aktuellen Belichtung und Verstärkung gemittelt. Nehmen Sie danach die Abdeckung wieder ab.",
  covered: "Objektiv ist abgedeckt: aufnehmen",
  taken: "Aufgenommen",
  exposure: "Belichtung, Verstärkung",
  hot_pixels: "Hotpixel",
  noise: "Rauschen",
  pattern: "Festes Muster",
  levels: (value, full_scale) => `${value} von ${full_scale} Graustufen`,
  used: {
    no_dark_frame: "Die Bilder werden nicht korrigiert.",
    other_camera: "Nicht verwendet: Es gehört zu einer anderen Kamera. Nehmen Sie es neu auf.",
    other_format: "Nicht verwendet: Bildgröße oder Bittiefe hat sich geändert. Nehmen Sie es neu auf.",
    hot_pixels:
      "Hotpixel werden korrigiert; das feste Muster nicht, weil sich Belichtung oder Verstärkung geändert hat.",
    whole: "Hotpixel und festes Muster werden in jedem Bild korrigiert.",
  },
};
