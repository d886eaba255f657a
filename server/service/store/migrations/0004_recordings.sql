-- What cameras and stages delivered, as MCAP files. A calibration or a scan may go: the file carries what it needs.
CREATE TABLE recordings (
    id             TEXT   NOT NULL PRIMARY KEY,
    name           TEXT   NOT NULL,
    origin         TEXT   NOT NULL CHECK (origin IN ('live', 'scan')),
    state          TEXT   NOT NULL CHECK (state IN ('recording', 'finishing', 'complete', 'interrupted', 'failed')),
    scan_id        TEXT,
    calibration_id TEXT,
    file           TEXT,
    size_bytes     BIGINT NOT NULL,
    summary        TEXT   NOT NULL,
    started_at_ms  BIGINT NOT NULL,
    seal           TEXT
);
