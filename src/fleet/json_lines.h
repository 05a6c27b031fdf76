// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// A file of runs is text. The first line is a header. Each run is a line, LineOf(UnitRun), and the
// decisions about the run are below it; checks of stations may be on any line. The last line states
// the numbers of lines above; a file without this line is incomplete. If lines are added later, a
// new count follows them.

/// The header line states the store of the runs:
/// {"format":"truetriad/runs","schema_version":6,"shards":8,"shard":2,"store":"…",
/// "retest_counts":"last"}
std::string HeaderLine(const StoreHeader& header);

/// {"disposition":{…}} and {"station_check":{…}}.
std::string LineOf(const Disposition& disposition);
std::string LineOf(const StationCheck& check);

/// The number of lines of each kind.
struct LineCounts {
  std::size_t runs = 0, dispositions = 0, station_checks = 0;

  bool operator==(const LineCounts&) const = default;
};
/// {"end":{"runs":2,"dispositions":0,"station_checks":0}}
std::string EndLine(const LineCounts& above);

/// The contents of a file besides its runs.
struct LinesRead {
  StoreHeader header;  ///< 0 shards: no header yet.
  Decisions decisions;
  LineCounts counts;
  bool is_ended = false;   ///< Its last line is an EndLine.
  std::int64_t bytes = 0;  ///< Size of all complete lines.
};

/// The header of a file; unset: it is not a file of runs, or has another version.
std::optional<StoreHeader> HeaderOf(const std::string& path);

/// Calls `take` with every run of a file. A last line without a newline, which a killed writer
/// leaves, is ignored. Errors (bad input): the file cannot be read or is not a file of runs; a line
/// is not valid, is of another shard than the header, or states wrong numbers of the lines above
/// (the message names the line). Returns errors of `take`, too.
Result<LinesRead> ForEachLine(const std::string& path, const std::function<Status(UnitRun)>& take);

/// A file of runs to which one process at a time writes. Each line is appended and flushed to disk.
/// The file may be on a network folder, if each shard writes a file of its own.
class RunLines {
 public:
  /// Opens or creates the file, and calls `take` with its runs. An incomplete line of a killed
  /// writer is removed. Errors as ForEachLine; error (bad input): it cannot be written, or another
  /// process writes to it.
  static Result<std::unique_ptr<RunLines>> Open(const std::string& path,
                                                const std::function<Status(UnitRun)>& take);
  ~RunLines();
  RunLines(const RunLines&) = delete;
  RunLines& operator=(const RunLines&) = delete;

  /// The header; whether there is one; and a function that writes it.
  const StoreHeader& header() const { return read_.header; }
  bool HasBegun() const { return read_.header.shards.count > 0; }
  Status Begin(const StoreHeader& header);
  Status Add(const UnitRun& run);
  /// Writes the EndLine if lines were added since the last one.
  Status End();

 private:
  explicit RunLines(std::string path) : path_(std::move(path)) {}
  Status Lock();
  /// Appends a text, which is on disk on return. After a failure, a written part is cut off.
  Status Append(std::string_view text);
  Error Failure() const;

  std::string path_;
  int descriptor_ = -1;
  LinesRead read_;
  bool is_cut_ = false;  ///< The file ends with an incomplete line.
};

/// The error (bad input) that a file of runs cannot be queried.
Error NoQuestions(const std::string& path);

/// The file of a URL jsonl:PATH or NAME.jsonl. Unset: it names another kind of store.
std::optional<std::string> JsonLinesPath(const std::string& url);

}  // namespace truetriad::fleet
