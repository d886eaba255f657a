import { text } from "../../text";

export default function Jobs() {
  return (
    <header>
      <h1>{text.value.jobs.title}</h1>
    </header>
  );
}
