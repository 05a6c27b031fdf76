// SPDX-License-Identifier: Apache-2.0
//
// ADIS16405 at rest for 2.8 hours, against the numbers that somebody else computed from it.

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "accuracy/shared_recordings.h"
#include "allan/allan_file.h"
#include "cli/command_line_run.h"

namespace truetriad {
namespace allan_test {

constexpr char kFolder[] = "d-adis16405-static-2p8h";
constexpr double kGyroPerCount = 0.05;      // deg/s
constexpr double kAccelPerCount = 3.33e-3;  // g

class AdisAtRest : public SharedRecordings {
 protected:
  Result<AllanResult> Run(const std::string& flags = "") {
    const Finished run =
        RunShell("'" TRUETRIAD_BINARY "' allan --input='" + Manifest("adis16405-static") +
                 "' --output='" + work().Path("allan") + "' " + flags);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return ReadAllanFile(work().Path("allan/allan.yaml"));
  }

  /// Overlapping deviation at `tau_s`, along the line between the nearest points in logarithms.
  static double At(const AllanAxis& axis, double tau_s) {
    const auto next = std::find_if(axis.points.begin(), axis.points.end(), [&](const auto& point) {
      return point.tau_s >= tau_s * (1.0 - 1e-9);
    });
    if (next == axis.points.begin()) return next->deviation.value;
    const AllanPoint& before = *std::prev(next);
    const double share = std::log(tau_s / before.tau_s) / std::log(next->tau_s / before.tau_s);
    return std::exp(
        std::lerp(std::log(before.deviation.value), std::log(next->deviation.value), share));
  }
};

TEST_F(AdisAtRest, HasTheDeviationsOfTheReferenceAtAllTauOfAllAxes) {
  const auto result = Run();
  ASSERT_TRUE(result) << result.error().message;
  const YAML::Node reference = YAML::LoadFile(File(std::string(kFolder) + "/reference.json"));
  for (const Triad triad : {Triad::kGyroscope, Triad::kAccelerometer}) {
    const bool is_gyro = triad == Triad::kGyroscope;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const YAML::Node answers = reference[std::string(is_gyro ? "g" : "a") + "xyz"[axis]];
      for (std::size_t i = 0; i < answers["taus_s"].size(); ++i) {
        const double tau_s = answers["taus_s"][i].as<double>();
        const double seen =
            (is_gyro ? kGyroPerCount : kAccelPerCount) * At(result->Find(triad)->axes[axis], tau_s);
        // The tau of 0.01 to 10 s are points of the curve, with terms of full or nearly full
        // overlap; 1000 s lies on a line between points a tenth of a decade apart.
        const double tolerance = tau_s < 1.5 ? 1e-4 : tau_s < 50.0 ? 1e-3 : 2e-2;
        EXPECT_NEAR(seen / answers["overlapping_allan_deviation"][i].as<double>(), 1.0, tolerance)
            << TriadName(triad) << " "
            << "xyz"[axis] << " at " << tau_s << " s";
      }
    }
  }
}

TEST_F(AdisAtRest, HasTheNoiseDensityOfItsGyroscope) {
  const YAML::Node reference = YAML::LoadFile(File(std::string(kFolder) + "/reference.json"));
  for (const char* const flags : {"--white_range=0.3,3", ""}) {
    const auto result = Run(flags);
    ASSERT_TRUE(result) << result.error().message;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at_one_second =
          reference[std::string("g") + "xyz"[axis]]["overlapping_allan_deviation"][2].as<double>();
      const AllanAxis& seen = result->Find(Triad::kGyroscope)->axes[axis];
      // The value at 1 s holds some flicker noise beside the white.
      EXPECT_NEAR(kGyroPerCount * seen.white_density->value / at_one_second, 1.0, 0.1) << flags;
    }
  }
}

TEST_F(AdisAtRest, HasTheBiasInstabilityOfItsDataSheet) {
  const auto result = Run();
  ASSERT_TRUE(result) << result.error().message;
  for (const AllanAxis& axis : result->Find(Triad::kGyroscope)->axes) {
    ASSERT_TRUE(axis.instability);
    const double minimum = kGyroPerCount * axis.instability->minimum.value;
    EXPECT_GT(minimum, 0.006);
    EXPECT_LT(minimum, 0.010);
    EXPECT_GT(kGyroPerCount * axis.instability->coefficient.value, 0.009);
    EXPECT_LT(kGyroPerCount * axis.instability->coefficient.value, 0.015);
  }
}

}  // namespace allan_test
}  // namespace truetriad
