/** Camera, stage and laser: identity and connection. */

import type { Schemas, Station } from "../../api/client";
import { positionOf } from "../../state/station/station";
import { language, text } from "../../text";
import { decimal } from "../../units";
import { Facts, HealthCard } from "./card";
import { deviceTone } from "./tone";

export function Devices({ status }: { status: Station }) {
  const words = text.value.health;
  const number = (value: number | null | undefined, digits: number, unit: string) =>
    value == null ? text.value.common.unknown : `${decimal(value, digits, language.value)} ${unit}`;
  const { camera, stage, laser } = status;
  const interlock =
    laser.interlock_closed == null
      ? "interlock_unknown"
      : laser.interlock_closed
        ? "interlock_closed"
        : "interlock_open";
  return (
    <>
      <Device name="camera" device={camera} status={status}>
        {[
          [words.frame_rate, number(camera.measured_rate_hz, 1, "Hz")],
          [words.exposure, number(camera.settings.exposure_us, 0, "µs")],
        ]}
      </Device>
      <Device name="stage" device={stage} status={status}>
        {[
          [words.position, number(positionOf(stage), 3, stage.kind === "rotary" ? "°" : "mm")],
          [words.homed, stage.homed ? text.value.common.yes : text.value.common.no],
        ]}
      </Device>
      <Device name="laser" device={laser} status={status}>
        {[
          [words.light, text.value.frame.light[laser.light] ?? laser.light],
          [text.value.frame.interlock, text.value.frame[interlock]],
        ]}
      </Device>
    </>
  );
}

interface Properties {
  name: "camera" | "stage" | "laser";
  device: { connected: boolean; identity: Schemas["IdentityDto"] };
  status: Station;
  children: (readonly [string, string])[];
}

function Device({ name, device, status, children }: Properties) {
  const words = text.value.health;
  const { connected, identity } = device;
  const fault = status.faults.find((fault) => fault.device === name);
  const model = [identity.vendor, identity.model].filter(Boolean).join(" ");
  return (
    <HealthCard
      title={words.devices[name]}
      tone={deviceTone(connected, status.faults, name)}
      headline={connected ? (fault ? fault.detail : words.connected) : words.not_connected}
      advice={fault?.remedy ?? words.check_cable}
    >
      <Facts
        of={[
          ...children,
          [words.device, model || "–"],
          [words.serial, identity.serial || "–"],
          [words.driver, [identity.driver, identity.firmware].filter(Boolean).join(", ") || "–"],
        ]}
      />
    </HealthCard>
  );
}
