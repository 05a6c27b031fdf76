// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace truetriad {
namespace layers_test {

// Bottom to top. Linking catches calls upward; this catches what headers alone would hide.
constexpr std::array<std::string_view, 28> kLayers = {
    "base",    "tree",   "math",    "model",   "thermometer", "data",     "io",
    "sim",     "init",   "problem", "start",   "solve",       "noise",    "faults",
    "verdict", "choice", "motion",  "sweep",   "calibrate",   "planning", "report",
    "allan",   "config", "session", "formats", "line",        "fleet",    "python"};

int LayerOf(std::string_view name) {
  const auto* at = std::find(kLayers.begin(), kLayers.end(), name);
  return at == kLayers.end() ? -1 : static_cast<int>(at - kLayers.begin());
}

TEST(Layers, IncludeOnlyWhatStandsBelow) {
  const std::filesystem::path root = TRUETRIAD_SOURCE_DIR;
  int includes = 0;
  for (const auto& folder : {root / "src", root / "include" / "truetriad"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cc" && extension != ".h") continue;
      // A layer may have rooms of its own: the first folder counts.
      const int own = LayerOf(entry.path().lexically_relative(folder).begin()->string());
      ASSERT_GE(own, 0) << entry.path() << " stands in no layer";
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        if (!line.starts_with("#include \"")) continue;
        std::string path = line.substr(10);
        if (path.starts_with("truetriad/")) path = path.substr(10);
        const int other = LayerOf(path.substr(0, path.find('/')));
        ASSERT_GE(other, 0) << entry.path() << ": " << line;
        EXPECT_LE(other, own) << entry.path() << " points upward: " << line;
        ++includes;
      }
    }
  }
  EXPECT_GT(includes, 100);
}

}  // namespace layers_test
}  // namespace truetriad
