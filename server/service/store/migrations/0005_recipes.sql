-- What is inspected and how: recipes, whose versions never change, and what came out: inspections, which never change.

-- A recipe's newest version and what finds it. A number is free again once its recipe is archived.
CREATE TABLE recipes (
    id       TEXT   NOT NULL PRIMARY KEY,
    position BIGINT NOT NULL UNIQUE,
    newest   BIGINT NOT NULL,
    number   BIGINT,
    archived BIGINT NOT NULL,
    seal     TEXT
);
CREATE UNIQUE INDEX recipes_by_number ON recipes (number) WHERE archived = 0;

-- Rows are only added; `key` is recipe@version, which keeps a version from being there twice.
CREATE TABLE recipe_versions (
    key           TEXT   NOT NULL PRIMARY KEY,
    recipe_id     TEXT   NOT NULL REFERENCES recipes (id),
    version       BIGINT NOT NULL,
    content       TEXT   NOT NULL,
    digest        TEXT   NOT NULL,
    author        TEXT   NOT NULL,
    reason        TEXT   NOT NULL,
    restored_from BIGINT,
    created_at_ms BIGINT NOT NULL,
    seal          TEXT
);

-- Rows are only added; one stays when its scan is deleted.
CREATE TABLE inspections (
    id                TEXT   NOT NULL PRIMARY KEY,
    seq               BIGINT NOT NULL UNIQUE,
    serial            TEXT   NOT NULL,
    order_number      TEXT,
    recipe_id         TEXT   NOT NULL,
    recipe_version    BIGINT NOT NULL,
    verdict           TEXT   NOT NULL CHECK (verdict IN ('ok', 'undecided', 'invalid', 'not_ok')),
    scan_id           TEXT REFERENCES scans (id) ON DELETE SET NULL,
    re_evaluated_from TEXT,
    job_id            TEXT,
    body              TEXT   NOT NULL,
    created_at_ms     BIGINT NOT NULL,
    seal              TEXT
);
CREATE INDEX inspections_by_serial ON inspections (serial, id);
CREATE INDEX inspections_by_recipe ON inspections (recipe_id, id);
CREATE INDEX inspections_by_scan ON inspections (scan_id);
