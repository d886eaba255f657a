import { text } from "../../text";

export default function Calibration() {
  return (
    <header>
      <h1>{text.value.calibration.title}</h1>
    </header>
  );
}
