/** The requirements on the board images: number, coverage, tilt, distance. */

import { language, text } from "../../../text";
import { decimal } from "../../../units";
import { degrees, mm } from "../details/format";
import {
  COVERAGE,
  coveredCells,
  type Detection,
  type Requirement,
  requirementsOf,
  type Session,
} from "./session_state";

export function RequirementsView({ session, detection }: { session: Session; detection: Detection | undefined }) {
  const words = text.value.calibration;
  const needs = requirementsOf(session);
  const { boards, cells, tilt, distance } = needs;
  return (
    <section class="card stack needs">
      <RequirementRow
        requirement={boards}
        name={words.boards}
        value={words.boards_have(String(boards.actual), String(boards.required))}
        missing={words.boards_missing}
      />
      <RequirementRow
        requirement={cells}
        name={words.coverage}
        value={words.coverage_have(String(cells.actual), String(cells.required))}
        missing={words.coverage_missing}
      >
        <CoverageMap covered={coveredCells(session)} now={new Set(detection?.coverage_cells)} />
      </RequirementRow>
      <RequirementRow
        requirement={tilt}
        name={words.tilt}
        value={words.tilt_have(String(tilt.actual), String(tilt.required), degrees(tilt.wanted_deg, 0))}
        missing={tilt.values_deg.length === 0 ? words.after_three : words.tilt_missing}
      >
        <Bar
          from={0}
          to={45}
          wanted={[tilt.wanted_deg, 40]}
          values={tilt.values_deg}
          now={detection?.tilt_deg ?? undefined}
          format={(value) => degrees(value, 0)}
        />
      </RequirementRow>
      <RequirementRow
        requirement={distance}
        name={words.distance}
        value={words.distance_have(mm(distance.actual, 0), distance.required > 0 ? mm(distance.required, 0) : "–")}
        missing={distance.values_mm.length < 2 ? words.after_three : words.distance_missing}
      >
        <DistanceBar
          values_mm={distance.values_mm}
          want_mm={distance.required}
          now={detection?.distance_mm ?? undefined}
        />
      </RequirementRow>
    </section>
  );
}

function RequirementRow(properties: {
  requirement: Requirement;
  name: string;
  value: string;
  missing: string;
  children?: preact.ComponentChildren;
}) {
  const { requirement, name, value, missing, children } = properties;
  return (
    <div class="need" data-met={requirement.met}>
      <div class="row">
        <strong class="grow">{name}</strong>
        <span class="number muted">{value}</span>
        {requirement.met && <span class="tag">✓ {text.value.calibration.requirement_met}</span>}
      </div>
      {children}
      {!requirement.met && <small class="muted">{missing}</small>}
    </div>
  );
}

/** The cells of the image; a cell is covered when a board was detected in it. */
function CoverageMap({ covered, now }: { covered: ReadonlySet<number>; now: ReadonlySet<number> }) {
  const words = text.value.calibration;
  const { columns, rows } = COVERAGE;
  const stateOf = (cell: number) => (covered.has(cell) ? "covered" : now.has(cell) ? "now" : "empty");
  const names = { covered: words.cell_covered, now: words.cell_now, empty: words.cell_empty };
  const label = `${words.coverage}: ${words.coverage_have(String(covered.size), String(columns * rows))}`;
  return (
    <div class="coverage" role="img" aria-label={label} data-covered={covered.size}>
      {Array.from({ length: columns * rows }, (_, cell) => {
        const state = stateOf(cell);
        const title = words.coverage_cell(Math.floor(cell / columns) + 1, (cell % columns) + 1, names[state]);
        return <span key={cell} data-cell={state} data-seen={now.has(cell)} title={title} />;
      })}
    </div>
  );
}

interface BarProperties {
  from: number;
  to: number;
  /** The target range. */
  wanted: readonly [number, number];
  values: readonly number[];
  now: number | undefined;
  format: (value: number) => string;
}

/** A scale with the target range, a tick per image, and a marker for the current board. */
function Bar({ from, to, wanted, values, now, format }: BarProperties) {
  const words = text.value.calibration;
  const at = (value: number) => `${(100 * (Math.min(to, Math.max(from, value)) - from)) / (to - from)}%`;
  return (
    <div class="range">
      <div class="track" aria-hidden="true">
        <span class="wanted" style={{ left: at(wanted[0]), right: `calc(100% - ${at(wanted[1])})` }} />
        {values.map((value, idx) => (
          <span key={idx} class="tick" style={{ left: at(value) }} />
        ))}
        {now !== undefined && <span class="now" style={{ left: at(now) }} />}
      </div>
      <div class="row ends number muted">
        <small>{format(from)}</small>
        <small class="grow middle">{now !== undefined && words.now_at(format(now))}</small>
        <small>{format(to)}</small>
      </div>
    </div>
  );
}

function DistanceBar(properties: { values_mm: readonly number[]; want_mm: number; now: number | undefined }) {
  const { values_mm, want_mm, now } = properties;
  const known = now === undefined ? values_mm : [...values_mm, now];
  if (known.length === 0) return null;
  const middle = known.reduce((sum, value) => sum + value, 0) / known.length;
  // The required spread around the mean fills half of the scale.
  const half_mm = Math.max(want_mm, ...known.map((value) => 1.1 * Math.abs(value - middle)), 1);
  return (
    <Bar
      from={middle - half_mm}
      to={middle + half_mm}
      wanted={[middle - want_mm / 2, middle + want_mm / 2]}
      values={values_mm}
      now={now}
      format={(value) => `${decimal(value, 0, language.value)} mm`}
    />
  );
}
