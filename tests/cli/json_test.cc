// SPDX-License-Identifier: Apache-2.0
//
// --json of every verb against share/truetriad/schema.
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace json_test {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Of pairs of a schema and a file.
constexpr char kValidate[] = R"py(
import json, pathlib, sys
import jsonschema
folder = pathlib.Path(sys.argv[1])
schemas = {n: json.loads((folder / n).read_text()) for n in ("calibration.json", "output.json", "fleet-progress.json")}
for name, file in zip(sys.argv[2::2], sys.argv[3::2]):
    schema = schemas[name]
    jsonschema.Draft202012Validator.check_schema(schema)
    resolver = jsonschema.RefResolver(base_uri=name, referrer=schema, store=schemas)
    text = json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
    for error in jsonschema.Draft202012Validator(schema, resolver=resolver).iter_errors(text):
        print(text.get("verb"), list(error.absolute_path), error.message[:300])
)py";

class JsonOutput : public ::testing::Test {
 protected:
  // Runs with --json; the one object on stdout, which the schema must allow.
  json Run(std::vector<std::string> arguments, int exit_code) {
    arguments.emplace_back("--json");
    std::string said;
    for (const std::string& argument : arguments) said += argument + " ";
    SCOPED_TRACE(said);
    const Finished run = RunTruetriad(arguments);
    EXPECT_EQ(run.exit_code, exit_code) << run.out << run.err;
    const json object = json::parse(run.out, nullptr, false);
    EXPECT_FALSE(object.is_discarded()) << run.out;
    if (object.is_discarded()) return {};
    EXPECT_EQ(object["exit"], exit_code);
    Validate("output.json", folder_.Write(std::to_string(validated_.size()) + ".json", run.out));
    return object;
  }
  void Validate(const std::string& schema, const std::string& file) {
    validated_ += " " + schema + " '" + file + "'";
  }
  void TearDown() override {
    if (RunShell("python3 -c 'import jsonschema'").exit_code != 0) {
      GTEST_SKIP() << "python3-jsonschema is not installed: nothing was validated";
    }
    const std::string script = folder_.Write("validate.py", kValidate);
    const Finished run = RunShell(
        "python3 '" + script + "' '" TRUETRIAD_SOURCE_DIR "/share/truetriad/schema'" + validated_);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, IsEmpty());
  }
  std::string Calibrated() {
    const std::string out = folder_.Path("result");
    EXPECT_EQ(RunTruetriad({"calibrate", log_, "-o", out, "--overwrite"}).exit_code, 0);
    return out + "/calibration.yaml";
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.Write("log.csv", LogText({.rests = 16}));
  std::string validated_;  // schemas and files
  const std::string configs_ = TRUETRIAD_SOURCE_DIR "/configs/";
};

TEST_F(JsonOutput, OfACalibrationHoldsItsFieldsAndFindings) {
  const json good = Run({"calibrate", log_, "-o", folder_.Path("good")}, 0);
  EXPECT_EQ(good["verb"], "calibrate");
  EXPECT_EQ(good["outcome"], "converged");
  EXPECT_EQ(good["findings"], good["result"]["status"]["findings"]);
  EXPECT_TRUE(good["result"]["sensors"].contains("magnetometer"));
  const std::string file = folder_.Path("good/calibration.json");
  EXPECT_EQ(json::parse(TemporaryFolder::Read(file)), good["result"]);
  Validate("calibration.json", file);
  Run({"calibrate", log_, "-o", folder_.Path("limits"), "--set=limits={accelerometer.bias: 1e-6}"},
      4);
  const json refused = Run({"calibrate", folder_.Write("few.csv", LogText({.rests = 4}))}, 3);
  EXPECT_NE(refused["outcome"], "converged");
  EXPECT_FALSE(refused["result"].contains("sensors"));
}

TEST_F(JsonOutput, OfErrorsIsAnObjectAndNothingElse) {
  const json missing = Run({"calibrate", folder_.Path("missing.csv")}, 2);
  EXPECT_THAT(missing["error"]["message"].get<std::string>(), HasSubstr("missing.csv"));
  Run({"inspect", "--bogus"}, 1);
  Run({"bogus"}, 1);
  // A name that is no UTF-8 must not make the output none.
  const Finished odd = RunShell("'" TRUETRIAD_BINARY "' inspect \"$(printf 'a\\377b')\" --json");
  EXPECT_FALSE(json::parse(odd.out, nullptr, false).is_discarded());
}

TEST_F(JsonOutput, OfALogWhoseNameIsNoUtf8IsWritten) {
  const Finished run = RunShell("cp log.csv \"$(printf 'a\377.csv')\" && '" TRUETRIAD_BINARY
                                "' calibrate \"$(printf 'a\377.csv')\" -o odd",
                                folder_.Path("."));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(
      json::parse(TemporaryFolder::Read(folder_.Path("odd/calibration.json")), nullptr, false)
          .is_discarded());
}

TEST_F(JsonOutput, OfEveryOtherVerbIsWhatItsSchemaSays) {
  const std::string calibration = Calibrated();
  EXPECT_EQ(Run({"inspect", log_}, 0)["result"]["poses"].size(), 16u);
  Run({"inspect", folder_.Write("short.csv", LogText({.rests = 16, .rest_s = 0.3}))}, 3);
  Run({"evaluate", calibration, log_}, 0);
  Run({"evaluate", calibration, calibration, log_}, 0);
  EXPECT_EQ(Run({"compare", calibration, calibration}, 0)["result"]["agreement"], "agree");
  Run({"apply", calibration, log_, "-o", folder_.Path("corrected.csv")}, 0);
  Run({"export", calibration, "--to=c-header", "-o", folder_.Path("unit.h")}, 0);
  Run({"export", calibration, "--to=px4", "-o", folder_.Path("unit.params")}, 0);
  Run({"import", folder_.Path("unit.params"), "--from=px4", "-o", folder_.Path("carried.yaml")}, 0);
  Run({"report", calibration, "-o", folder_.Path("again.html")}, 0);
  Run({"simulate",
       configs_ + "scenarios/at-rest.yaml",
       "--set=first_rest_s=120",
       "-o",
       folder_.Path("rest")},
      0);
  Run({"allan", folder_.Path("rest/recording.yaml")}, 0);
  Run({"plan", configs_ + "plans/joint-12.yaml", "--set=plan.poses=9"}, 0);
  Run({"init", log_}, 0);
  Run({"check", configs_ + "experiments/joint.yaml"}, 0);
  Run({"version"}, 0);
  Run({"help", "calibrate"}, 0);
  Run({"explain", "clock-offset", "unknown-key"}, 0);
  const std::string store = folder_.Path("fleet/fleet.db"), runs = folder_.Path("runs.csv");
  Run({"fleet", "run", log_, "-o", folder_.Path("fleet"), "--report=false"}, 0);
  Run({"fleet", "collect", store, "--store=" + folder_.Path("all.db")}, 0);
  Run({"fleet", "export", "--store=" + store, "--to=csv", "-o", runs}, 0);
}

TEST_F(JsonOutput, OfAFleetIsWhatItsSchemaSays) {
  folder_.Write("few.csv", LogText({.rests = 4}));
  const std::string out = "--output=" + folder_.Path("fleet"),
                    store = folder_.Path("fleet/fleet.db");
  const json run = Run({"fleet", "run", folder_.Path("log.csv"), folder_.Path("few.csv"), out}, 0);
  EXPECT_EQ(run["result"]["done"], 2);
  EXPECT_EQ(run["result"]["yield"]["final"], 1);
  folder_.Write("less.csv", LogText({.rests = 3}));
  Run({"fleet", "watch", folder_.Path(""), out, "--until-idle=0.1", "--fail-on=unit"}, 4);
  const json table = Run({"fleet", "query", "--store=" + store}, 0);
  EXPECT_EQ(table["result"]["rows"].size(), 3u);
  folder_.Write("few.csv", LogText({.rests = 5}));
  const Finished lines = RunTruetriad(
      {"fleet", "run", folder_.Path("few.csv"), out, "--progress=jsonl", "--retest-most=0"});
  std::istringstream text(lines.err);
  int count = 0;
  for (std::string line; std::getline(text, line); ++count) {
    Validate("fleet-progress.json", folder_.Write(std::to_string(count) + ".line", line));
  }
  EXPECT_EQ(count, 3);  // What counts from now on, the run, and that it does not count.
}

// Of every verb that can end so: 3 refused, 4 outside of limits, 2 and 1 errors.
TEST_F(JsonOutput, OfRefusalsLimitsAndErrorsOfEveryVerbIsWhatItsSchemaSays) {
  const std::string calibration = Calibrated();
  const std::string few = folder_.Write("few.csv", LogText({.rests = 4}));
  const std::string short_log = folder_.Write("short.csv", LogText({.rests = 16, .rest_s = 0.3}));
  const auto code = [](const json& object) { return object["error"]["code"].get<std::string>(); };

  EXPECT_NE(Run({"calibrate", few, "-o", folder_.Path("few")}, 3)["outcome"], "converged");
  EXPECT_FALSE(Run({"calibrate", short_log, "-o", folder_.Path("short")}, 3)["outcome"].is_null());
  Run({"evaluate", calibration, short_log}, 3);
  Run({"init",
       folder_.Write("gyroscope.csv",
                     "time[s],gyro_x[rad/s],gyro_y[rad/s],gyro_z[rad/s]\n0,0,0,1\n1,0,0,0\n")},
      3);
  Run({"plan",
       configs_ + "plans/accelerometer-by-hand.yaml",
       "--set=plan.wanted={accelerometer.bias: 1e-9},plan.max_poses=9"},
      3);
  // The reference's own recording is no test; a shifted one is not as predicted and not the same.
  Run({"check-station", "--golden=" + calibration, log_}, 4);
  Run({"check-station", "--golden=" + calibration, few}, 3);
  Run({"evaluate", calibration, log_, "--fail-on=worse"}, 4);
  std::string other = TemporaryFolder::Read(calibration);
  const std::size_t at = other.find("bias: [") + 7;
  other.insert(at, other[at] == '-' ? "-1" : "1");
  Run({"compare", calibration, folder_.Write("other.yaml", other), "--fail-on=differ"}, 4);

  const std::string missing = folder_.Path("missing.yaml"), out = "--output=" + folder_.Path("x");
  for (const std::vector<std::string>& call : std::vector<std::vector<std::string>>{
           {"inspect", missing},
           {"init", missing},
           {"check", missing},
           {"calibrate", missing},
           {"calibrate", log_, "-c", missing},
           {"apply", missing, log_, out},
           {"apply", calibration, missing, out},
           {"evaluate", missing, log_},
           {"compare", calibration, missing},
           {"check-station", "--golden=" + missing, log_},
           {"allan", missing},
           {"simulate", missing, out},
           {"plan", missing},
           {"convert", missing, "--from=json", "--units=s,g", out},
           {"convert", missing, "--from=dataflash", out},
           {"convert", missing, "--from=euroc", out},
           {"export", missing, "--to=px4", out},
           {"import", missing, "--from=px4", out},
           {"report", missing, out + ".html"},
           {"fleet", "run", missing, out},
           {"fleet", "watch", missing, out},
           {"fleet", "query", "--store=" + missing}}) {
    const json object = Run(call, 2);
    EXPECT_EQ(code(object), "unreadable-file") << object;
    EXPECT_EQ(object["error"]["file"], missing) << object;
  }
  for (const char* verb : {"inspect",
                           "init",
                           "check",
                           "calibrate",
                           "apply",
                           "evaluate",
                           "compare",
                           "check-station",
                           "allan",
                           "simulate",
                           "plan",
                           "convert",
                           "export",
                           "import",
                           "report",
                           "explain",
                           "version",
                           "help"}) {
    EXPECT_EQ(code(Run({verb, "--bogus"}, 1)), "unknown-flag");
  }
}

TEST_F(JsonOutput, OfAConverterHoldsWhatItSaid) {
  for (const char* face : {"+x", "-x", "+y", "-y", "+z", "-z"}) {
    folder_.Write(std::string(face) + ".csv", LogText({.rests = 1, .rest_s = 5.0}));
  }
  const std::string from = "--from=six-face", out = "--output=" + folder_.Path("faces");
  const json wrong = Run({"convert", from, "--input=" + log_, out}, 2);
  EXPECT_EQ(wrong["error"]["code"], "wrong-format");
  EXPECT_THAT(wrong["error"]["message"].get<std::string>(), HasSubstr("is not a folder"));
  const json good = Run({"convert", from, "--input=" + folder_.Path("."), out}, 0);
  EXPECT_THAT(good["result"]["text"].get<std::string>(), HasSubstr("recording.yaml"));
}

TEST_F(JsonOutput, OfAGateSaysTheSameAsItsExitCode) {
  const std::string calibration = Calibrated();
  const std::string other = folder_.Write("other.csv", LogText({.rests = 16, .seed = 5}));
  const std::string second = folder_.Path("second");
  ASSERT_EQ(RunTruetriad({"calibrate", other, "-o", second}).exit_code, 0);
  TriadModel<double> bent = LoggedAccelerometer();
  bent.bias.x() += 0.2;
  const std::string far = folder_.Path("far");
  const std::string bent_log =
      folder_.Write("bent.csv", LogText({.rests = 16, .accelerometer = bent, .seed = 7}));
  ASSERT_EQ(RunTruetriad({"calibrate", bent_log, "-o", far}).exit_code, 0);
  Run({"compare", calibration, second + "/calibration.yaml", "--fail-on=differ"}, 0);
  EXPECT_EQ(Run({"compare", calibration, far + "/calibration.yaml", "--fail-on=differ"},
                4)["result"]["agreement"],
            "differ");
  EXPECT_EQ(RunTruetriad({"compare", calibration, far + "/calibration.yaml"}).exit_code, 0);
  const std::string golden = "--golden=" + calibration;
  EXPECT_EQ(Run({"check-station", golden, other}, 0)["result"]["agrees"], true);
  EXPECT_EQ(Run({"check-station", golden, bent_log}, 4)["result"]["agrees"], false);
  EXPECT_EQ(Run({"check-station", golden, log_}, 4)["result"]["agrees"], nullptr);
  Run({"evaluate", calibration, other, "--fail-on=worse"}, 0);
  EXPECT_EQ(
      Run({"evaluate", far + "/calibration.yaml", log_, "--fail-on=worse"}, 4)["result"]["verdict"],
      "worse");
  Run({"compare", calibration, calibration, "--fail-on=worse"}, 1);
}

}  // namespace json_test
}  // namespace truetriad
