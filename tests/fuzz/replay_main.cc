// SPDX-License-Identifier: Apache-2.0
//
// truetriad_fuzz_replay TARGET FILE_OR_FOLDER…: hands every file to the target, without a fuzzer.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <glog/logging.h>

#include "fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> FilesOf(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

int Replay(const truetriad::fuzz::Target& target, const std::vector<fs::path>& paths) {
  std::size_t count = 0;
  for (const fs::path& path : paths) {
    for (const fs::path& file : FilesOf(path)) {
      std::ifstream stream(file, std::ios::binary);
      const std::vector<char> text{std::istreambuf_iterator<char>(stream), {}};
      // Said before, so that what brings the process down has its name.
      std::printf("%s\n", file.c_str());
      std::fflush(stdout);
      const std::vector<std::uint8_t> bytes(text.begin(), text.end());
      target.fuzz_one(bytes);
      ++count;
    }
  }
  std::printf("%zu inputs\n", count);
  return count > 0 ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (const truetriad::fuzz::Target& target : truetriad::fuzz::Targets()) {
    if (words.size() > 1 && target.name == words[0])
      return Replay(target, {words.begin() + 1, words.end()});
  }
  std::fprintf(stderr, "Usage: truetriad_fuzz_replay TARGET FILE_OR_FOLDER...\nTargets:");
  for (const truetriad::fuzz::Target& target : truetriad::fuzz::Targets())
    std::fprintf(stderr, " %s", std::string(target.name).c_str());
  std::fprintf(stderr, "\n");
  return 1;
}
