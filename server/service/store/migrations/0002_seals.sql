-- Every row carries a checksum of its other columns, so that a flipped bit is found when the row is read.
-- SQLite cannot compute it: the program seals what is there already, and drops `unsealed` in the same transaction.

ALTER TABLE sequences ADD COLUMN seal TEXT;
ALTER TABLE jobs ADD COLUMN seal TEXT;
ALTER TABLE captures ADD COLUMN seal TEXT;
ALTER TABLE calibrations ADD COLUMN seal TEXT;
ALTER TABLE activations ADD COLUMN seal TEXT;
ALTER TABLE scans ADD COLUMN seal TEXT;
ALTER TABLE measurements ADD COLUMN seal TEXT;
ALTER TABLE sessions ADD COLUMN seal TEXT;
ALTER TABLE events ADD COLUMN seal TEXT;
ALTER TABLE idempotency ADD COLUMN seal TEXT;
CREATE TABLE unsealed (note TEXT);
