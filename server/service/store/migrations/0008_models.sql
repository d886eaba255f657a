-- CAD models. Plans name a model by the hash of its file, so a recipe keeps the file even if the model is deleted here.
CREATE TABLE models (
    id            TEXT   NOT NULL PRIMARY KEY,
    name          TEXT   NOT NULL,
    file          TEXT   NOT NULL,
    size_bytes    BIGINT NOT NULL,
    summary       TEXT   NOT NULL,
    created_at_ms BIGINT NOT NULL,
    seal          TEXT
);
