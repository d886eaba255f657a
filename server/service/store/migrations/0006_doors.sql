-- Deliveries to the doors of the station: how far each door is, and the events it has set aside.

-- Everything up to `seq` is delivered, set aside in `deliveries`, or of no interest to the door.
CREATE TABLE doors (
    name            TEXT   NOT NULL PRIMARY KEY,
    seq             BIGINT NOT NULL,
    n_delivered     BIGINT NOT NULL,
    delivered_seq   BIGINT,
    delivered_at_ms BIGINT,
    seal            TEXT
);

-- A copy of the event, which may be pruned from the log meanwhile. `key` is door/seq.
CREATE TABLE deliveries (
    key        TEXT   NOT NULL PRIMARY KEY,
    door       TEXT   NOT NULL,
    seq        BIGINT NOT NULL,
    kind       TEXT   NOT NULL,
    subject    TEXT   NOT NULL,
    body       TEXT   NOT NULL,
    at_ms      BIGINT NOT NULL,
    state      TEXT   NOT NULL CHECK (state IN ('waiting', 'dead')),
    n_attempts BIGINT NOT NULL,
    next_at_ms BIGINT NOT NULL,
    reason     TEXT   NOT NULL,
    seal       TEXT
);
CREATE INDEX deliveries_by_door ON deliveries (door, seq);
