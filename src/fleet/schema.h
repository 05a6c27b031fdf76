// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

namespace truetriad::fleet {

/// Version of the tables below; a store of a later one is not written to.
inline constexpr int kSchemaVersion = 5;

/// What takes a store from version i to i + 1, by place. For SQLite and PostgreSQL alike, but for
/// {text}, {real} and {bytes}, the types of text that is compared byte by byte, of double-precision
/// numbers and of bytes. Tables are never changed once they were used: stores of that version are
/// about. The last part makes the views `latest` and `standing`.
///
/// A run is never changed; `latest` has the last of each unit by name, `standing` what counts.
/// covariance: of the run's parameters in their order, lower triangle row by row, doubles, least
/// significant byte first.
///
/// `measured` has of each run the first of the unit that is of the same recording: of the same log,
/// untouched, or of all the files that its samples are from. An attempt is a recording, however
/// often it is calibrated.
///
/// recorded: when the unit was measured, ISO 8601, UTC; by recorded_by "list", "recording" or
/// "file". Runs are in the order of that, those of one second in that of their logs' names; those
/// without it, of stores of before, come first, in the order of their names.
///
/// `standing` has of each unit the run that counts, which is chosen once a unit (the cross join
/// keeps SQLite from doing it once a run). `before` is how many recordings were before that of a
/// run; the limit, which none reaches, has each first_run taken once, and PostgreSQL take the
/// window at all. A unit with one run costs some ten microseconds, one with 200 some ten
/// milliseconds. A decision holds unless the run that counts is a later one and of another
/// recording: none of the unit's runs before the decision, whether they counted or not, was of the
/// same log, untouched, or of all the files that its samples are from. (What was exported of the
/// runs that count alone may name a run that is later than the decision.)
inline constexpr std::array<std::string_view, kSchemaVersion> kMigrations = {R"sql(
CREATE TABLE unit (
  serial {text} PRIMARY KEY
);
CREATE TABLE run (
  run {text} PRIMARY KEY,
  serial {text} NOT NULL REFERENCES unit (serial),
  log {text} NOT NULL,
  log_bytes BIGINT NOT NULL,
  log_modified_ns BIGINT NOT NULL,
  created {text} NOT NULL,
  software {text} NOT NULL,
  config_sha256 {text} NOT NULL,
  shard {text} NOT NULL,
  folder {text} NOT NULL,
  verdict {text} NOT NULL,
  code {text} NOT NULL,
  message {text} NOT NULL,
  mode {text} NOT NULL,
  wall_s {real} NOT NULL,
  cpu_s {real} NOT NULL,
  effective_dof {real} NOT NULL,
  covariance {bytes}
);
CREATE INDEX run_of_unit ON run (serial, run);
CREATE INDEX run_of_log ON run (log, run);
CREATE TABLE tag (
  run {text} NOT NULL REFERENCES run (run),
  name {text} NOT NULL,
  value {text} NOT NULL,
  PRIMARY KEY (run, name)
);
CREATE TABLE input (
  run {text} NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  file {text} NOT NULL,
  sha256 {text} NOT NULL,
  samples BIGINT NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE parameter (
  run {text} NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  name {text} NOT NULL,
  value {real} NOT NULL,
  sigma {real} NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE finding (
  run {text} NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  code {text} NOT NULL,
  severity {text} NOT NULL,
  sensor {text},
  axis {text},
  pose BIGINT,
  text {text} NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE judgement (
  run {text} NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  name {text} NOT NULL,
  component {text} NOT NULL,
  lower {real},
  target {real},
  upper {real},
  value {real} NOT NULL,
  sigma {real} NOT NULL,
  outside {real} NOT NULL,
  pass BIGINT NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE disposition (
  disposition {text} PRIMARY KEY,
  run {text} NOT NULL REFERENCES run (run),
  created {text} NOT NULL,
  who {text} NOT NULL,
  verdict {text} NOT NULL,
  why {text} NOT NULL
);
CREATE TABLE fact (
  name {text} PRIMARY KEY,
  value {text} NOT NULL
);
)sql",
                                                                             R"sql(
ALTER TABLE finding ADD COLUMN remedy {text};
ALTER TABLE finding ADD COLUMN "values" {text};
CREATE TABLE station_check (
  station_check {text} PRIMARY KEY,
  station {text} NOT NULL,
  serial {text} NOT NULL,
  created {text} NOT NULL,
  agrees BIGINT NOT NULL,
  p {real},
  largest {real},
  parameter {text} NOT NULL,
  log {text} NOT NULL
);
CREATE INDEX check_of_station ON station_check (station, station_check);
CREATE INDEX disposition_of_run ON disposition (run, disposition);
DROP INDEX run_of_unit;
CREATE INDEX run_of_unit ON run (serial, run, verdict);
)sql",
                                                                             R"sql(
ALTER TABLE finding ADD COLUMN treatment {text};
ALTER TABLE run ADD COLUMN temperature_degc {real};
ALTER TABLE station_check ADD COLUMN recording {text} NOT NULL DEFAULT '';
ALTER TABLE station_check ADD COLUMN repeatability {text} NOT NULL DEFAULT '';
)sql",
                                                                             R"sql(
CREATE VIEW measured AS
  SELECT
    one.run,
    one.serial,
    one.verdict,
    CASE WHEN one.run = (SELECT min(seen.run) FROM run AS seen WHERE seen.serial = one.serial)
    THEN one.run
    ELSE (
      SELECT min(seen.run) FROM (
        SELECT (
          SELECT same.run FROM run AS same
          WHERE same.log = one.log AND same.serial = one.serial
            AND same.log_bytes = one.log_bytes AND same.log_modified_ns = one.log_modified_ns
          ORDER BY same.run LIMIT 1
        ) AS run
        UNION ALL
        SELECT (
          SELECT shared.run FROM input AS shared CROSS JOIN run AS same
          WHERE shared.sha256 = (
              SELECT made_from.sha256 FROM input AS made_from
              WHERE made_from.run = one.run AND made_from.samples > 0
              ORDER BY made_from.place LIMIT 1
            )
            AND shared.run <= one.run AND same.run = shared.run AND same.serial = one.serial
            AND NOT EXISTS (
              SELECT 1 FROM input AS made_from
              WHERE made_from.run = one.run AND made_from.samples > 0 AND NOT EXISTS (
                SELECT 1 FROM input AS known
                WHERE known.run = shared.run AND known.sha256 = made_from.sha256
              )
            )
          ORDER BY shared.run LIMIT 1
        ) AS run
      ) AS seen
    ) END AS first_run
  FROM run AS one;
CREATE INDEX input_of_content ON input (sha256, run);
)sql",
                                                                             R"sql(
ALTER TABLE run ADD COLUMN recorded {text} NOT NULL DEFAULT '';
ALTER TABLE run ADD COLUMN recorded_by {text} NOT NULL DEFAULT '';
DROP VIEW IF EXISTS standing;
DROP VIEW IF EXISTS latest;
CREATE VIEW latest AS
  SELECT * FROM run AS one
  WHERE NOT EXISTS (SELECT 1 FROM run AS later WHERE later.serial = one.serial AND later.run > one.run);
CREATE VIEW standing AS
  SELECT
    run.*,
    (SELECT one.verdict FROM run AS one WHERE one.serial = unit.serial
      ORDER BY one.recorded, CASE WHEN one.recorded <> '' THEN one.log END, one.run LIMIT 1)
      AS first_verdict,
    (SELECT count(*) FROM measured AS one
      WHERE one.serial = unit.serial AND one.first_run = one.run) AS attempts,
    COALESCE(decision.verdict, run.verdict) AS final_verdict,
    decision.who AS disposed_by,
    decision.why AS disposed_why
  FROM unit
  CROSS JOIN run
  LEFT JOIN disposition AS decision ON decision.disposition = (
      SELECT max(one.disposition)
      FROM run AS its CROSS JOIN disposition AS one
      WHERE its.serial = unit.serial AND one.run = its.run
    )
    AND (
      EXISTS (
        SELECT 1 FROM run AS seen
        WHERE seen.serial = unit.serial
          AND (seen.run <= decision.disposition OR seen.run <= decision.run)
          AND seen.log = run.log AND seen.log_bytes = run.log_bytes
          AND seen.log_modified_ns = run.log_modified_ns
      )
      OR (
        EXISTS (
          SELECT 1 FROM input AS made_from WHERE made_from.run = run.run AND made_from.samples > 0
        )
        AND NOT EXISTS (
          SELECT 1 FROM input AS made_from
          WHERE made_from.run = run.run AND made_from.samples > 0 AND NOT EXISTS (
            SELECT 1 FROM run AS seen CROSS JOIN input AS known
            WHERE seen.serial = unit.serial
              AND (seen.run <= decision.disposition OR seen.run <= decision.run)
              AND known.run = seen.run AND known.sha256 = made_from.sha256
          )
        )
      )
    )
  WHERE run.serial = unit.serial AND run.run = (
    SELECT counted.run
    FROM (
      SELECT one.run, one.verdict, one.recorded, one.log FROM run AS one
      WHERE one.serial = unit.serial AND NOT EXISTS (SELECT 1 FROM fact WHERE name = 'retest_most')
      UNION ALL
      SELECT placed.run, placed.verdict, its.recorded, its.log
      FROM (
        SELECT
          one.run,
          one.verdict,
          count(*) FILTER (WHERE one.first_run = one.run) OVER (
            ORDER BY
              (SELECT its.recorded FROM run AS its WHERE its.run = one.first_run),
              (SELECT its.log FROM run AS its WHERE its.run = one.first_run AND its.recorded <> ''),
              one.first_run
            GROUPS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
          ) AS before
        FROM (
          SELECT * FROM measured
          WHERE serial = unit.serial AND EXISTS (SELECT 1 FROM fact WHERE name = 'retest_most')
          ORDER BY run LIMIT 1000000000
        ) AS one
      ) AS placed CROSS JOIN run AS its
      WHERE its.run = placed.run AND placed.before <= (SELECT CAST(value AS BIGINT) FROM fact WHERE name = 'retest_most')
    ) AS counted
    ORDER BY
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'best' THEN
        CASE counted.verdict
          WHEN 'PASS' THEN 0 WHEN 'NO_LIMITS' THEN 1 WHEN 'FAIL' THEN 2 ELSE 3
        END
      END,
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'first' THEN
        counted.recorded
      END,
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'first' AND counted.recorded <> ''
      THEN
        counted.log
      END,
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'first' THEN
        counted.run
      END,
      counted.recorded DESC,
      CASE WHEN counted.recorded <> '' THEN counted.log END DESC,
      counted.run DESC
    LIMIT 1
  );
)sql"};

}  // namespace truetriad::fleet
