-- What the station remembers beside its records: one JSON value a name.
CREATE TABLE settings (
    name          TEXT   NOT NULL PRIMARY KEY,
    value         TEXT   NOT NULL,
    changed_at_ms BIGINT NOT NULL,
    seal          TEXT
);
