-- Studies of the station: what is tested and what was found so far. `version` grows with every change.
CREATE TABLE studies (
    id            TEXT   NOT NULL PRIMARY KEY,
    version       BIGINT NOT NULL,
    body          TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL,
    changed_at_ms BIGINT NOT NULL,
    seal          TEXT
);
