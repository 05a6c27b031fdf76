// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

namespace truetriad::fleet {

/// Version of the tables below; a store of a later one is not written to.
inline constexpr int kSchemaVersion = 1;

/// What takes a store from version i to i + 1, by place. For SQLite and PostgreSQL alike, but for
/// {real} and {bytes}, the types of double-precision numbers and of bytes.
///
/// A run is never changed; the last of a unit by name, in `latest`, supersedes those before.
/// covariance: of the run's parameters in their order, lower triangle row by row, doubles, least
/// significant byte first.
inline constexpr std::array<std::string_view, kSchemaVersion> kMigrations = {R"sql(
CREATE TABLE unit (
  serial TEXT PRIMARY KEY
);
CREATE TABLE run (
  run TEXT PRIMARY KEY,
  serial TEXT NOT NULL REFERENCES unit (serial),
  log TEXT NOT NULL,
  log_bytes BIGINT NOT NULL,
  log_modified_ns BIGINT NOT NULL,
  created TEXT NOT NULL,
  software TEXT NOT NULL,
  config_sha256 TEXT NOT NULL,
  shard TEXT NOT NULL,
  folder TEXT NOT NULL,
  verdict TEXT NOT NULL,
  code TEXT NOT NULL,
  message TEXT NOT NULL,
  mode TEXT NOT NULL,
  wall_s {real} NOT NULL,
  cpu_s {real} NOT NULL,
  effective_dof {real} NOT NULL,
  covariance {bytes}
);
CREATE INDEX run_of_unit ON run (serial, run);
CREATE INDEX run_of_log ON run (log, run);
CREATE TABLE tag (
  run TEXT NOT NULL REFERENCES run (run),
  name TEXT NOT NULL,
  value TEXT NOT NULL,
  PRIMARY KEY (run, name)
);
CREATE TABLE input (
  run TEXT NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  file TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  samples BIGINT NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE parameter (
  run TEXT NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  name TEXT NOT NULL,
  value {real} NOT NULL,
  sigma {real} NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE finding (
  run TEXT NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  code TEXT NOT NULL,
  severity TEXT NOT NULL,
  sensor TEXT,
  axis TEXT,
  pose BIGINT,
  text TEXT NOT NULL,
  PRIMARY KEY (run, place)
);
CREATE TABLE judgement (
  run TEXT NOT NULL REFERENCES run (run),
  place BIGINT NOT NULL,
  name TEXT NOT NULL,
  component TEXT NOT NULL,
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
  disposition TEXT PRIMARY KEY,
  run TEXT NOT NULL REFERENCES run (run),
  created TEXT NOT NULL,
  who TEXT NOT NULL,
  verdict TEXT NOT NULL,
  why TEXT NOT NULL
);
CREATE TABLE fact (
  name TEXT PRIMARY KEY,
  value TEXT NOT NULL
);
CREATE VIEW latest AS
  SELECT * FROM run AS one
  WHERE NOT EXISTS (SELECT 1 FROM run AS later WHERE later.serial = one.serial AND later.run > one.run);
)sql"};

}  // namespace truetriad::fleet
