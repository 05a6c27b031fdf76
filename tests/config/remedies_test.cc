// SPDX-License-Identifier: Apache-2.0
// Types every line that a message of the library advises.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "truetriad/config/experiment.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {
namespace remedies_test {

// All sources of the library, neighbouring pieces of a text joined.
const std::string& Sources() {
  static const std::string& all = *new std::string([] {
    std::string text;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(
             std::filesystem::path(TRUETRIAD_SOURCE_DIR) / "src")) {
      if (entry.path().extension() != ".cc") continue;
      std::ostringstream content;
      content << std::ifstream(entry.path()).rdbuf();
      text += content.str();
    }
    return std::regex_replace(text, std::regex("\"\\s*\\n\\s*\""), "");
  }());
  return all;
}

std::set<std::string> Found(const std::string& pattern) {
  std::set<std::string> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator at(Sources().begin(), Sources().end(), regex), end; at != end; ++at) {
    found.insert((*at)[1]);
  }
  return found;
}

// With a value for each that a person puts in.
std::string Filled(std::string line) {
  for (const auto& [from, to] :
       {std::pair("\\[\\[…\\], \\[…\\], \\[…\\]\\]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        {"x, y, z", "0.1, 0.1, 0.1"},
        {"order: …", "order: 1"},
        {"file: …", "file: f.yaml"},
        {"%\\.[0-9]g", "0.5"},
        {"…", "0.5"}}) {
    line = std::regex_replace(line, std::regex(from), to);
  }
  // A number follows that the message works out.
  const bool is_cut =
      std::count(line.begin(), line.end(), '{') > std::count(line.begin(), line.end(), '}');
  return is_cut ? line + "2 }" : line;
}

// That an experiment has no such key, or not so; a contradiction with the rest is another matter.
bool IsTaken(const std::string& experiment) {
  const Result<Experiment> read = ReadExperimentText(experiment, "typed.yaml", {});
  if (read) return true;
  static const std::set<ErrorCode> kWrong = {ErrorCode::kUnknownKey,
                                             ErrorCode::kInvalidValue,
                                             ErrorCode::kUnknownName,
                                             ErrorCode::kMissingKey,
                                             ErrorCode::kBadYaml};
  return !kWrong.contains(read.error().code);
}

bool IsTakenOfASensor(const std::string& keys) {
  bool is_taken = false;
  for (const Triad triad : kTriads) {
    is_taken = is_taken || IsTaken("experiment: 1\nsensors: { " + std::string(TriadName(triad)) +
                                   ": { " + Filled(keys) + " } }\n");
  }
  return is_taken;
}

TEST(Remedies, AreKeysOfASensorThatAnExperimentTakes) {
  const std::set<std::string> keys = Found("SensorLine\\([^;\"]*\"([a-z][^\"]*)\"");
  EXPECT_GE(keys.size(), 8U);
  for (const std::string& line : keys) EXPECT_TRUE(IsTakenOfASensor(line)) << line;
  for (const AxisTermInfo& info : kAxisTerms) {
    EXPECT_TRUE(IsTakenOfASensor(std::string(info.name) + ": true")) << info.name;
  }
}

TEST(Remedies, AreLinesThatAnExperimentTakes) {
  const std::set<std::string> lines = Found(
      "`((?:reference|poses|attitudes|initialise|cross_validation|exclude_poses|mounting|units|"
      "static): "
      "[^`\"]*)`");
  EXPECT_GE(lines.size(), 8U);
  for (const std::string& line : lines) {
    EXPECT_TRUE(IsTaken("experiment: 1\nsensors: { accelerometer: {}, gyroscope: {} }\n" +
                        Filled(line) + "\n"))
        << line;
  }
}

TEST(Remedies, SayOfWhichSensorAKeyIs) {
  EXPECT_EQ(Found("`((?:model|noise|excess|thermal|bias_order|g_sensitivity|fixed|sign): [^`]*)`"),
            std::set<std::string>());
}

}  // namespace remedies_test
}  // namespace truetriad
