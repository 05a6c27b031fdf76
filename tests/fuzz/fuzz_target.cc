// SPDX-License-Identifier: Apache-2.0
#include "fuzz/fuzz_target.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace truetriad::fuzz {
namespace {

namespace fs = std::filesystem;

class PrivateFolder {
 public:
  PrivateFolder() {
    std::error_code failure;
    const fs::path memory = "/dev/shm";
    const fs::path base = fs::is_directory(memory, failure) ? memory : fs::temp_directory_path();
    std::string name = (base / "truetriad-fuzz-XXXXXX").string();
    Must(mkdtemp(name.data()) != nullptr, "a folder for inputs can be made");
    path_ = name;
  }
  ~PrivateFolder() {
    std::error_code failure;
    fs::remove_all(path_, failure);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

std::vector<Target>& Targets() {
  static std::vector<Target> targets;
  return targets;
}

const std::string& Folder() {
  static const PrivateFolder folder;
  return folder.path();
}

std::string WriteInput(const std::string& name, std::string_view text) {
  std::string path = Folder() + "/" + name;
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  Must(descriptor >= 0, "an input can be written", path);
  while (!text.empty()) {
    const ssize_t written = write(descriptor, text.data(), text.size());
    Must(written > 0, "an input can be written", path);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  close(descriptor);
  return path;
}

std::string FreshOutput() {
  std::string path = Folder() + "/out";
  std::error_code failure;
  fs::remove_all(path, failure);
  return path;
}

void Must(bool holds, const char* what, std::string_view detail) {
  if (holds) return;
  std::fprintf(
      stderr, "does not hold: %s\n%.*s\n", what, static_cast<int>(detail.size()), detail.data());
  std::abort();
}

void MustSay(const Error& error) { Must(!error.message.empty(), "an error says something"); }

}  // namespace truetriad::fuzz
