/** The frame around every page: bar, rail, what a person must know now, and the page itself. */

import { useApp } from "../app";
import { route } from "../state/route";
import { text } from "../text";
import { Banners } from "./banners";
import { Bar } from "./bar";
import { Page } from "./page";
import { Rail } from "./rail";

export function Frame() {
  const { station } = useApp();
  const classes = ["frame", station.simulated.value && "simulated", station.stale.value && "stale"];
  return (
    <div class={classes.filter(Boolean).join(" ")}>
      <button type="button" class="skip" onClick={() => document.getElementById("page")?.focus()}>
        {text.value.frame.skip}
      </button>
      <Bar />
      <Rail />
      <main class="page" id="page" tabIndex={-1}>
        <Banners />
        <Page key={route.value.page} />
      </main>
    </div>
  );
}
