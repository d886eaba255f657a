import { text } from "../../text";

export default function Settings() {
  return (
    <header>
      <h1>{text.value.settings.title}</h1>
    </header>
  );
}
