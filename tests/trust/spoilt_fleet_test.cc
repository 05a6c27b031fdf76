// SPDX-License-Identifier: Apache-2.0
//
// Spoilt units among good ones in one fleet: each has a code, and no good one fails because of
// them.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "math/random.h"
#include "support/nightly.h"
#include "truetriad/config/experiment.h"
#include "trust/faults.h"
#include "trust/recording.h"

namespace truetriad::trust {
namespace spoilt_fleet_test {

namespace fs = std::filesystem;

struct Spoilt {
  std::string_view fault;
  std::optional<Triad> triad;
  std::string_view code;            ///< Of its run, or of one of the run's findings.
  std::string_view or_code = code;  ///< If the fault may be seen as another one.
};

const std::vector<Spoilt>& SpoiltUnits() {
  using enum Triad;
  static const std::vector<Spoilt> kSpoilt = {
      {"few poses", {}, "too-few-poses"},
      {"rad/s as deg/s", kGyroscope, "wrong-unit"},
      {"short rests", {}, "followed-motion"},
      {"drift", kAccelerometer, "fault"},
      {"axis flipped", kAccelerometer, "mounting-contradicted"},
      {"axes swapped", kGyroscope, "mounting-contradicted"},
      // A tenth of the field, or ten times it, which no field is.
      {"tenfold", kMagnetometer, "odd-gain", "wrong-unit"},
      {"thousandfold", kAccelerometer, "wrong-unit"},
      {"deg/s as rad/s", kGyroscope, "wrong-unit"},
      {"g as m/s^2", kAccelerometer, "wrong-unit"},
      {"normalised", kMagnetometer, "not-raw"},
      {"kelvins", {}, "wrong-unit"},
      {"hard iron moved", kMagnetometer, "fault"},
      {"axes cycled", kAccelerometer, "mounting-contradicted"},
      {"zero rows", kGyroscope, "impossible-rows"},
      {"stuck axis", kMagnetometer, "constant-axis"},
      {"ms as s", {}, "wrong-unit"},
      {"clipped", kAccelerometer, "stuck-sensor"},
      {"pieces exchanged", {}, "joined-recording"},
  };
  return kSpoilt;
}

const Fault& FaultNamed(std::string_view name) {
  return *std::ranges::find(Faults(), name, &Fault::name);
}

Status WriteUnit(const Scenario& clean, int unit, const Spoilt* spoilt, const std::string& folder) {
  Scenario scenario = clean;
  Random random(static_cast<std::uint64_t>(unit));
  Strike strike{.random = &random};
  if (spoilt != nullptr) {
    const Fault& fault = FaultNamed(spoilt->fault);
    strike.triad = spoilt->triad.value_or(Triad::kAccelerometer);
    // These two faults are worst at their least severity.
    strike.severity =
        spoilt->fault == "few poses" || spoilt->fault == "short rests" ? fault.least : fault.most;
    if (fault.before != nullptr) fault.before(strike, &scenario);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(Recording recording, Play(scenario, unit));
  if (spoilt != nullptr) {
    const Fault& fault = FaultNamed(spoilt->fault);
    if (fault.after != nullptr) fault.after(strike, &recording);
  }
  TRUETRIAD_RETURN_IF_ERROR(Write(recording, folder));
  return {};
}

class SpoiltFleet : public testing::Test {
 protected:
  std::vector<std::string> Ask(const std::string& sql) const {
    const Finished run =
        RunShell("'" TRUETRIAD_BINARY "' fleet query --csv --store=out/fleet.db \"" + sql + "\"",
                 folder_.Path(""));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::istringstream text(run.out);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    if (!lines.empty()) lines.erase(lines.begin());
    return lines;
  }

  const TemporaryFolder folder_;
};

TEST_F(SpoiltFleet, HasACodeForEachAndNoGoodUnitFailsBecauseOfThem) {
  // At night 2 % of the units are spoilt.
  const int units = IsNightly() ? 1000 : 40;
  const auto& spoilt = SpoiltUnits();
  const int stride = units / static_cast<int>(spoilt.size());
  const auto scenario = ReadScenario(TRUETRIAD_SOURCE_DIR "/configs/scenarios/fleet.yaml",
                                     {"count=" + std::to_string(units), "seed=1818"});
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto name = [](int unit) { return "unit" + std::to_string(10'000 + unit); };
  const auto spoilt_as = [&](int unit) -> const Spoilt* {
    const auto at = static_cast<std::size_t>(unit / stride);
    return unit % stride == 1 && at < spoilt.size() ? &spoilt[at] : nullptr;
  };
  for (int unit = 0; unit < units; ++unit) {
    const Status written =
        WriteUnit(*scenario, unit, spoilt_as(unit), folder_.Path("line/" + name(unit)));
    ASSERT_TRUE(written) << written.error().message;
  }
  // Three more units end their worker.
  const Finished run = RunShell(
      "TRUETRIAD_FLEET_FAULT=crash:" + name(0) + ",hang:" + name(2) + ",memory:" + name(4) +
          " '" TRUETRIAD_BINARY
          "' fleet run line -o out --report=false --time-limit=30 "
          "'--serial={serial}' -c '" TRUETRIAD_SOURCE_DIR "/configs/experiments/nine-axis.yaml'",
      folder_.Path(""));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::map<std::string, std::string> verdicts;
  for (const std::string& line :
       Ask("SELECT serial, CASE verdict WHEN 'NO_RESULT' THEN code ELSE verdict END FROM latest")) {
    verdicts[line.substr(0, line.find(','))] = line.substr(line.find(',') + 1);
  }
  EXPECT_EQ(verdicts.size(), static_cast<std::size_t>(units));
  const std::map<int, std::string> ended = {{0, "crashed"}, {2, "time-limit"}, {4, "memory-limit"}};
  for (int unit = 0; unit < units; ++unit) {
    SCOPED_TRACE(name(unit));
    if (const auto found = ended.find(unit); found != ended.end()) {
      EXPECT_EQ(verdicts[name(unit)], found->second);
    } else if (const Spoilt* one = spoilt_as(unit); one == nullptr) {
      EXPECT_EQ(verdicts[name(unit)], "NO_LIMITS");
    } else {
      const std::string of_unit = "serial = '" + name(unit) + "'";
      const std::vector<std::string> codes =
          Ask("SELECT code FROM latest WHERE " + of_unit +
              " UNION SELECT finding.code FROM finding JOIN latest USING (run) WHERE " + of_unit +
              " AND (severity <> 'note' OR finding.code = 'followed-motion')");
      EXPECT_THAT(codes, testing::Contains(testing::AnyOf(one->code, one->or_code)))
          << one->fault << ": " << verdicts[name(unit)];
    }
  }
}

}  // namespace spoilt_fleet_test
}  // namespace truetriad::trust
