// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

/// A file that appears under its name only when it is whole: written beside it and renamed. A
/// device
/// (/dev/stdout) is written to directly: replacing it by a file is not what anybody means.
class WholeFile {
 public:
  explicit WholeFile(std::string path);
  ~WholeFile();  ///< Leaves nothing behind unless committed.
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  void Write(std::string_view text);

  /// Why the file cannot be written, if so.
  Status status() const;

  Status Commit();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::string written_path_;
  std::unique_ptr<std::FILE, Close> file_;
  int failure_ = 0;
  bool committed_ = false;
};

}  // namespace truetriad
