/** The frame around every page: bar, rail, banners and the page itself. */

import { useEffect } from "preact/hooks";
import { useApp } from "../app";
import { route } from "../state/browser/route";
import { text } from "../text";
import { Banners } from "./banners";
import { Bar } from "./bar";
import { Page } from "./page";
import { Rail } from "./rail";
import { titleOf } from "./title";

export function Frame() {
  const { station } = useApp();
  const stale = station.stale.value;
  const title = titleOf(text.value, route.value.page, station.status.value?.state, stale);
  useEffect(() => {
    document.title = title;
  }, [title]);
  const classes = ["frame", station.simulated.value && "simulated", stale && "stale"];
  return (
    <div class={classes.filter(Boolean).join(" ")}>
      <button type="button" class="skip" onClick={() => document.getElementById("page")?.focus()}>
        {text.value.frame.skip}
      </button>
      <Bar />
      <Rail />
      <div class="body">
        <Banners />
        <main class="page" id="page" tabIndex={-1}>
          <Page key={route.value.page} />
        </main>
      </div>
    </div>
  );
}
