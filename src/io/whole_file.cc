// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace truetriad {
namespace {

namespace fs = std::filesystem;

/// A name beside `path` that no other writer uses.
std::string TemporaryName(const std::string& path) {
  static std::atomic<int> count = 0;
  return path + ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(count++);
}

int LastFailure() { return errno != 0 ? errno : EIO; }

}  // namespace

WholeFile::WholeFile(std::string path) : path_(std::move(path)) {
  std::error_code ignored;
  const fs::file_status target = fs::status(path_, ignored);
  if (fs::is_directory(target)) {
    failure_ = EISDIR;
    return;
  }
  const bool is_replaced = !fs::exists(target) || fs::is_regular_file(target);
  const std::string written = is_replaced ? TemporaryName(path_) : path_;
  file_.reset(std::fopen(written.c_str(), "wbe"));
  if (!file_) {
    failure_ = LastFailure();
  } else if (is_replaced) {
    temporary_path_ = written;
  }
}

WholeFile::~WholeFile() {
  if (!temporary_path_.empty()) std::remove(temporary_path_.c_str());
}

void WholeFile::Write(std::string_view text) {
  if (failure_ == 0 && std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) {
    failure_ = LastFailure();
  }
}

Status WholeFile::status() const {
  if (failure_ == 0) return {};
  if (failure_ == EISDIR) {
    return BadInputError(path_ + ": is a folder; give a file name");
  }
  const fs::path parent = fs::path(path_).parent_path();
  std::error_code ignored;
  if (!parent.empty() && !fs::is_directory(parent, ignored)) {
    return BadInputError(path_ + ": cannot be written: there is no folder " + parent.string() +
                         "; create it or choose another");
  }
  return BadInputError(path_ + ": cannot be written: " + std::strerror(failure_));
}

Status WholeFile::Commit() {
  if (failure_ == 0 && std::fclose(file_.release()) != 0) failure_ = LastFailure();
  if (failure_ == 0 && !temporary_path_.empty()) {
    if (std::rename(temporary_path_.c_str(), path_.c_str()) == 0) {
      temporary_path_.clear();
    } else {
      failure_ = LastFailure();
    }
  }
  return status();
}

}  // namespace truetriad
