/** The fitness of the station: acceptance tests and measurement system analysis. */

import { data } from "../../../api/client";
import { useApp } from "../../../app";
import { useAutoReloaded } from "../../../components/loading/auto_reloaded";
import { Show } from "../../../components/loading/loading";
import { href, route } from "../../../state/browser/route";
import { language, text } from "../../../text";
import { dateTime } from "../../../units";
import { NewStudy } from "./new_study";
import { StudyView } from "./study";
import "./studies.css";

export default function Studies() {
  const { id } = route.value;
  return id === undefined ? <List /> : <StudyView key={id} id={id} />;
}

function List() {
  const { api } = useApp();
  const words = text.value.studies;
  const { state } = useAutoReloaded(
    () => data(api.GET("/api/v1/studies")),
    ({ kind }) => kind.startsWith("study."),
    [api],
  );
  return (
    <div class="stack studies">
      <h1>{words.title}</h1>
      <p class="about">{words.about}</p>
      <Show of={state}>
        {({ items }) =>
          items.length === 0 ? (
            <p class="card muted">{words.none_yet}</p>
          ) : (
            <section class="card" aria-label={words.title}>
              <table class="wide">
                <thead>
                  <tr>
                    <th>{words.name}</th>
                    <th>{words.kind}</th>
                    <th>{words.when}</th>
                    <th>{words.by}</th>
                  </tr>
                </thead>
                <tbody>
                  {items.map((item) => (
                    <tr key={item.id}>
                      <td data-label={words.name}>
                        <a class="name" href={href("studies", item.id)}>
                          {item.name}
                        </a>
                      </td>
                      <td data-label={words.kind}>{words.kinds[item.kind]}</td>
                      <td data-label={words.when}>{dateTime(item.created_at_ms, language.value)}</td>
                      <td data-label={words.by}>{item.author}</td>
                    </tr>
                  ))}
                </tbody>
              </table>
            </section>
          )
        }
      </Show>
      <NewStudy />
    </div>
  );
}
