// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tools/truetriad/command.h"
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Paths and texts.
using FileTexts = std::vector<std::pair<std::string, std::string>>;

/// Writes files, all or none.
Status WriteFiles(const FileTexts& files);

/// Makes the folder of a file to come.
Status EnsureFolderOf(const std::string& file);

/// The path of a file in the folder that --output names.
std::string InOutput(const std::string& name);

/// Finds out before the work starts that the result could not be written, and creates nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

/// Renames what the result to come must not replace: calibration.yaml in `directory` becomes
/// calibration.previous.yaml; says so.
Status MoveAside(const std::filesystem::path& directory, const std::vector<std::string>& names);

/// A folder whose place something new takes, and which comes back with the end of this object,
/// unless the new one is kept. Meanwhile it is NAME.aside, and after a kill the next object finds
/// it there.
class FolderGivesWay {
 public:
  /// What becomes of the one that was there.
  enum class End { kGoes, kIsPrevious };

  /// Moves `folder`, if it is there. Error (bad input): it cannot be renamed; `input` is in it.
  static Result<FolderGivesWay> For(const std::filesystem::path& folder,
                                    const std::filesystem::path& input);
  ~FolderGivesWay();
  FolderGivesWay(FolderGivesWay&& other) noexcept;
  FolderGivesWay& operator=(FolderGivesWay&&) = delete;
  /// kIsPrevious: it is NAME.previous from now on.
  void Keep(End of_earlier);

 private:
  explicit FolderGivesWay(std::filesystem::path folder);

  std::filesystem::path Named(const char* suffix) const { return folder_.string() + suffix; }

  std::filesystem::path folder_;  ///< Empty: moved from.
  bool has_made_parent_ = false;
};

/// Error (bad input): `directory` has the calibration of another unit than `serial`. One without a
/// serial number is nobody's, nor is a file that is no calibration.
Status CheckIsOfUnit(const std::filesystem::path& directory, const std::string& serial);

/// Writes the page that --report names, where it is given, and says so in the result.
Status WriteStatedReport(const std::string& html, VerbResult* result);

/// Error (bad input): both numbers are known and differ. `what`: "log.csv: the recording".
Status CheckSameUnit(const std::string& what, const std::string& serial, const Calibration& of);
/// Error (bad input): both state a unit, or device ids of their sensors, and not the same.
Status CheckSameSensors(const std::string& what,
                        const Calibration& one,
                        const Calibration& other,
                        const std::string& remedy =
                            "give calibrations of one sensor (`import --instance=N` chooses it)");

}  // namespace truetriad
