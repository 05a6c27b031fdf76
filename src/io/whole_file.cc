// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <unistd.h>

namespace truetriad {

WholeFile::WholeFile(std::string path) : path_(std::move(path)) {
  std::error_code failure;
  const std::filesystem::file_status target = std::filesystem::status(path_, failure);
  const bool replaceable =
      !std::filesystem::exists(target) || std::filesystem::is_regular_file(target);
  written_path_ = replaceable ? path_ + ".tmp" + std::to_string(getpid()) : path_;
  file_.reset(std::fopen(written_path_.c_str(), "wbe"));
  if (!file_) failure_ = errno;
}

WholeFile::~WholeFile() {
  if (!committed_ && file_ && written_path_ != path_) std::remove(written_path_.c_str());
}

void WholeFile::Write(std::string_view text) {
  if (failure_ == 0 && std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) {
    failure_ = errno;
  }
}

Status WholeFile::status() const {
  if (failure_ == 0) return {};
  return BadInputError(path_ + ": cannot be written: " + std::strerror(failure_));
}

Status WholeFile::Commit() {
  if (failure_ == 0 && std::fflush(file_.get()) != 0) failure_ = errno;
  if (failure_ == 0 && written_path_ != path_ &&
      std::rename(written_path_.c_str(), path_.c_str()) != 0) {
    failure_ = errno;
  }
  committed_ = failure_ == 0;
  return status();
}

}  // namespace truetriad
