// SPDX-License-Identifier: Apache-2.0
#include "io/input_guard.h"

#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include <sys/stat.h>

namespace truetriad {
namespace {

/// Device and inode number. They are the same for all names of a file.
using FileIdentity = std::pair<dev_t, ino_t>;

struct Guarded {
  std::mutex mutex;
  bool is_active = false;
  std::set<FileIdentity> files;
};

Guarded& TheGuarded() {
  static Guarded& guarded = *new Guarded;
  return guarded;
}

std::optional<FileIdentity> IdentityOf(const std::string& path) {
  struct stat about {};
  if (stat(path.c_str(), &about) != 0 || !S_ISREG(about.st_mode)) return std::nullopt;
  return FileIdentity(about.st_dev, about.st_ino);
}

}  // namespace

InputGuard::InputGuard() {
  Guarded& guarded = TheGuarded();
  const std::scoped_lock lock(guarded.mutex);
  guarded.is_active = true;
}

InputGuard::~InputGuard() {
  Guarded& guarded = TheGuarded();
  const std::scoped_lock lock(guarded.mutex);
  guarded.is_active = false;
  guarded.files.clear();
}

void InputGuard::Add(const std::string& path) {
  Guarded& guarded = TheGuarded();
  const std::scoped_lock lock(guarded.mutex);
  if (!guarded.is_active) return;
  if (const std::optional<FileIdentity> identity = IdentityOf(path))
    guarded.files.insert(*identity);
}

bool InputGuard::Holds(const std::string& path) {
  Guarded& guarded = TheGuarded();
  const std::scoped_lock lock(guarded.mutex);
  if (guarded.files.empty()) return false;
  const std::optional<FileIdentity> identity = IdentityOf(path);
  return identity && guarded.files.contains(*identity);
}

Error InputGuard::Refusal(const std::string& path) {
  return Error(ErrorCode::kConflictingArguments,
               {path},
               "would be overwritten, and it is an input; choose another output");
}

}  // namespace truetriad
