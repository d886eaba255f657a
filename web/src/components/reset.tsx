/** Reset after a Stop or a fault: the user allows motion and laser again. */

import { useMemo } from "preact/hooks";
import { data } from "../api/client";
import { useApp } from "../app";
import { Command } from "../state/station/command";
import { CommandButton } from "./command_button";

interface Properties {
  label: string;
  kind?: "primary" | "operator" | "primary operator";
}

export function ResetButton({ label, kind }: Properties) {
  const { api, control } = useApp();
  const reset = useMemo(
    () =>
      new Command(async () => {
        await control.ensure();
        const params = { header: { "Sheaf-Control": control.id() ?? "" } };
        await data(api.POST("/api/v1/station/reset", { params }));
      }),
    [api, control],
  );
  return (
    <CommandButton command={reset} {...(kind ? { kind } : {})}>
      {label}
    </CommandButton>
  );
}
