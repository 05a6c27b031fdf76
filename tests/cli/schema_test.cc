// SPDX-License-Identifier: Apache-2.0
//
// The JSON Schemas of the files that users write: share/truetriad/schema/*.schema.json.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "io/calibration_tree.h"
#include "support/log_writer.h"

namespace truetriad {
namespace schema_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// The kinds of files, and the key by which each is known.
const std::vector<std::pair<std::string, std::string>> kKinds = {{"experiment", "experiment"},
                                                                 {"limits", "limits_preset"},
                                                                 {"recording", "recording"},
                                                                 {"scenario", "scenario"},
                                                                 {"sensors", "sensor_preset"}};

// Prints an error of each text that its schema does not allow.
constexpr char kValidate[] = R"py(
import json, pathlib, sys
import jsonschema
def infinite(tree):
    """`.inf`, which JSON lacks, is null in a tree."""
    if isinstance(tree, dict):
        return {key: infinite(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [infinite(value) for value in tree]
    return float("inf") if tree is None else tree
folder = pathlib.Path(sys.argv[1])
for case in json.loads(pathlib.Path(sys.argv[2]).read_text(encoding="utf-8")):
    schema = json.loads((folder / (case["kind"] + ".schema.json")).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    for error in jsonschema.Draft202012Validator(schema).iter_errors(infinite(case["tree"])):
        print(case["name"], list(error.absolute_path), error.message[:300])
        break
)py";

/// The kind of a file; empty if it has no schema.
std::string KindOf(const Json& tree) {
  for (const auto& [kind, key] : kKinds) {
    if (tree.is_object() && tree.contains(key)) return kind;
  }
  return "";
}

class InputSchemas : public ::testing::Test {
 protected:
  void SetUp() override {
    if (RunShell("/usr/bin/python3 -c 'import jsonschema'").exit_code != 0) {
      GTEST_SKIP() << "python3-jsonschema is not installed: nothing was validated";
    }
  }
  void Add(const std::string& name, const std::string& kind, const Json& tree) {
    cases_.push_back({{"name", name}, {"kind", kind}, {"tree", tree}});
  }
  /// A line for each text that is not valid.
  std::string Invalid() {
    const Finished run = RunShell("/usr/bin/python3 '" + folder_.Write("validate.py", kValidate) +
                                  "' '" TRUETRIAD_SOURCE_DIR "/share/truetriad/schema' '" +
                                  folder_.Write("cases.json", TextOf(cases_)) + "'");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.out;
  }

  const TemporaryFolder folder_;
  Json cases_ = Json::array();
};

TEST(InputSchema, IsWhatTheProgramWrites) {
  for (const auto& [kind, key] : kKinds) {
    const Finished run = RunTruetriad({"help", "--as=schema", kind});
    const std::string file = "/share/truetriad/schema/" + kind + ".schema.json";
    EXPECT_EQ(run.out, TemporaryFolder::Read(TRUETRIAD_SOURCE_DIR + file))
        << "write it with `build/truetriad help --as=schema " << kind << " >" << file.substr(1);
  }
  EXPECT_THAT(RunTruetriad({"help", "--as=schema", "log"}).err, HasSubstr("experiment limits"));
}

TEST_F(InputSchemas, AllowEveryFileThatComesWithTruetriad) {
  const std::string root = TRUETRIAD_SOURCE_DIR;
  for (const char* folder : {"/configs", "/datasets", "/examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root + folder)) {
      if (entry.path().extension() != ".yaml") continue;
      const std::string file = entry.path().string();
      const Json tree = TreeOfYaml(TemporaryFolder::Read(file));
      const std::string kind = KindOf(tree);
      if (kind.empty()) continue;
      Add(file, kind, tree);
      if (kind != "experiment") continue;
      const Finished check = RunTruetriad({"check", file, "--json"});
      Add(file + ", resolved", kind, Json::parse(check.out)["result"]["config"]);
    }
  }
  EXPECT_GT(cases_.size(), 100u);
  EXPECT_EQ(Invalid(), "");
}

TEST_F(InputSchemas, AllowWhatTheProgramWritesAndReads) {
  const std::string log = folder_.Write("log.csv", LogText({.rests = 16}));
  const std::string experiment = RunTruetriad({"init", log}).out;
  const std::string begin = "# yaml-language-server: $schema=";
  ASSERT_THAT(experiment, StartsWith(begin));
  const std::size_t size = experiment.find('\n') - begin.size();
  EXPECT_TRUE(fs::exists(experiment.substr(begin.size(), size)));
  Add("init", "experiment", TreeOfYaml(experiment));
  const std::string scenario = TRUETRIAD_SOURCE_DIR "/configs/scenarios/at-rest.yaml";
  RunTruetriad({"simulate", scenario, "--set=first_rest_s=1", "-o", folder_.Path("rest")});
  Add("simulate",
      "recording",
      TreeOfYaml(TemporaryFolder::Read(folder_.Path("rest/recording.yaml"))));
  for (const char* text :
       {"serial: 7",
        "applied: { accelerometer: none }",
        "poses: every_row",
        "poses: { column: pose }",
        "run: { lot: 17, note: x }",
        "device: { ids: { gyroscope: 7 }, magnetometer_turn_deg: [0, 0, 90] }"}) {
    Add(text, "recording", TreeOfYaml("recording: 1\nstreams: {}\n" + std::string(text)));
  }
  for (const char* text :
       {"sensors: { accelerometer: { noise: { sigma: auto, excess: { sigma: 0.1 } }, fixed: { "
        "matrix: identity } }, gyroscope: { thermal: none, g_sensitivity: auto, nonlinearity: { "
        "percent_of_full_scale: 0.1, full_scale_degps: 500 } } }",
        "sensors: { accelerometer: { thermal: { knots: [20, 30], regression: full, rate: [linear] "
        "} }, magnetometer: { thermal: { knots: 2, regression: [reading], bias_order: auto } } }",
        "poses: { sweep: auto }",
        "poses: { sweep: { window_s: 2 } }",
        "poses: { motion: { spacing_s: 0.1 } }",
        "attitudes: { file: a.yaml, sigma_deg: 0.01, fixture_rotation: unknown }",
        "limits: { accelerometer: { bias: { x: 1, y: { lower: -1, upper: 1 } } }, decision: { "
        "guard_band_k: 2 }, reference.field_ut: { lower: 40, target: 48, upper: 50 } }",
        "limits: { accelerometer.bias.x: 1, decision: simple }",
        "strict: true",
        "strict: 2.5",
        "input: [a, b]",
        "robust: none",
        "turns: { file: turns.yaml, held_out: all }",
        "reference: { earth_rate: position, field: { strength_ut: { value: 48, sigma: 1 } } }",
        "mounting: { magnetometer: +y+x-z, gyroscope: any, accelerometer: ROTATION_YAW_90 }",
        "plan: { wanted: { accelerometer.bias: 0.01 }, rotations: { spread: 500 } }"}) {
    Add(text, "experiment", TreeOfYaml("experiment: 1\n" + std::string(text)));
  }
  EXPECT_EQ(Invalid(), "");
}

TEST_F(InputSchemas, RefuseMistakes) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> mistakes = {
      {"experiment",
       {"experiment: 2",
        "sensors: {}",
        "experiment: 1\nsensor: {}",
        "experiment: 1\nsensors: { accelerometer: { model: ful } }",
        "experiment: 1\nreference: { gravity_mps2: 1 }",
        "experiment: 1\nreference: { position: { height_m: 1 } }",
        "experiment: 1\nobservable_sigma: 1",
        "experiment: 1\nrobust: { scale: 0 }",
        "experiment: 1\nposes: every_rows",
        "experiment: 1\nmounting: { magnetometer: +y+x }",
        "experiment: 1\nlimits: { accelerometer.bais: 1 }",
        "experiment: 1\nlimits: { accelerometer: { bias: -1 } }"}},
      {"limits", {"limits: {}", "limits_preset: 1\nlimits: { accelerometer.bias: wide }"}},
      {"recording",
       {"recording: 1",
        "recording: 1\nstreams: { barometer: {} }",
        "recording: 1\nstreams: { gyroscope: { file: a, x: 0, y: 1, z: 2, unit: g } }",
        "recording: 1\nstreams: { gyroscope: { file: a, x: 0, y: 1, unit: deg/s } }",
        "recording: 1\nstreams: {}\nposes: { every: 0 }"}},
      {"scenario",
       {"scenario: 1\ncount: 0",
        "scenario: 1\nmotion: [{ jump: {} }]",
        "scenario: 1\nsensors: { gyroscope: { output: mean } }"}},
      {"sensors", {"sensor_preset: 1\naccelerometer: { time_offset_s: 11 }"}}};
  for (const auto& [kind, texts] : mistakes) {
    for (const std::string& text : texts) Add("[" + text + "]", kind, TreeOfYaml(text));
  }
  const std::string invalid = Invalid();
  for (const Json& each : cases_) {
    const Json name = each["name"];
    EXPECT_THAT(invalid, HasSubstr(name.get<std::string>()));
  }
}

}  // namespace schema_test
}  // namespace truetriad
