-- What a station keeps. Types and constraints are those that SQLite and PostgreSQL share: JSON is TEXT, times are
-- wall-clock milliseconds (labels, never an order), ids are UUID v7 unless said otherwise.

-- Counters that never run backwards, not even when the rows they numbered are forgotten.
CREATE TABLE sequences (
    name  TEXT   NOT NULL PRIMARY KEY,
    value BIGINT NOT NULL
);
INSERT INTO sequences (name, value) VALUES ('event', 0), ('activation', 0), ('calibration', 0);

CREATE TABLE jobs (
    id            TEXT             NOT NULL PRIMARY KEY,
    kind          TEXT             NOT NULL,
    state         TEXT             NOT NULL
        CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled', 'interrupted')),
    input         TEXT             NOT NULL,
    source        TEXT             NOT NULL,
    progress      DOUBLE PRECISION NOT NULL,
    message       TEXT             NOT NULL,
    result_kind   TEXT,
    result_id     TEXT,
    problem       TEXT,
    checkpoint    TEXT,
    created_at_ms BIGINT           NOT NULL,
    started_at_ms BIGINT,
    ended_at_ms   BIGINT
);
CREATE INDEX jobs_by_state ON jobs (state, id);

CREATE TABLE captures (
    id             TEXT   NOT NULL PRIMARY KEY,
    name           TEXT   NOT NULL,
    origin         TEXT   NOT NULL,
    archive        TEXT   NOT NULL,
    archive_format TEXT   NOT NULL,
    size_bytes     BIGINT NOT NULL,
    summary        TEXT   NOT NULL,
    created_at_ms  BIGINT NOT NULL
);

-- Ids are hashes of the content, so `position` keeps the order of arrival.
CREATE TABLE calibrations (
    id            TEXT   NOT NULL PRIMARY KEY,
    position      BIGINT NOT NULL UNIQUE,
    document      TEXT   NOT NULL,
    report        TEXT,
    capture_id    TEXT REFERENCES captures (id) ON DELETE SET NULL,
    job_id        TEXT,
    summary       TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL
);
CREATE INDEX calibrations_by_capture ON calibrations (capture_id);

-- A log: rows are only added, and stay when the calibration they name is deleted.
CREATE TABLE activations (
    seq            BIGINT NOT NULL PRIMARY KEY,
    calibration_id TEXT,
    previous_id    TEXT,
    act            TEXT   NOT NULL,
    actor          TEXT   NOT NULL,
    at_ms          BIGINT NOT NULL
);

CREATE TABLE scans (
    id               TEXT   NOT NULL PRIMARY KEY,
    name             TEXT   NOT NULL,
    state            TEXT   NOT NULL CHECK (state IN ('complete', 'partial', 'invalid')),
    calibration_id   TEXT   NOT NULL REFERENCES calibrations (id),
    plan             TEXT   NOT NULL,
    peaks            TEXT   NOT NULL,
    capture_id       TEXT REFERENCES captures (id) ON DELETE SET NULL,
    cloud            TEXT,
    display          TEXT,
    report           TEXT   NOT NULL,
    recomputed_from  TEXT REFERENCES scans (id) ON DELETE SET NULL,
    job_id           TEXT,
    software_version TEXT   NOT NULL,
    created_at_ms    BIGINT NOT NULL
);
CREATE INDEX scans_by_calibration ON scans (calibration_id);
CREATE INDEX scans_by_capture ON scans (capture_id);
CREATE INDEX scans_by_origin ON scans (recomputed_from);

CREATE TABLE measurements (
    id            TEXT   NOT NULL PRIMARY KEY,
    scan_id       TEXT   NOT NULL REFERENCES scans (id) ON DELETE CASCADE,
    request       TEXT   NOT NULL,
    result        TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL
);
CREATE INDEX measurements_by_scan ON measurements (scan_id, id);

CREATE TABLE sessions (
    id            TEXT   NOT NULL PRIMARY KEY,
    version       BIGINT NOT NULL,
    body          TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL,
    changed_at_ms BIGINT NOT NULL
);

CREATE TABLE events (
    seq     BIGINT NOT NULL PRIMARY KEY,
    kind    TEXT   NOT NULL,
    subject TEXT   NOT NULL,
    body    TEXT   NOT NULL,
    at_ms   BIGINT NOT NULL
);

CREATE TABLE idempotency (
    key           TEXT   NOT NULL PRIMARY KEY,
    body_sha256   TEXT   NOT NULL,
    answer        TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL
);
CREATE INDEX idempotency_by_age ON idempotency (created_at_ms);
