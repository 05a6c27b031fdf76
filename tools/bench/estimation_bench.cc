// SPDX-License-Identifier: Apache-2.0
// Time of the estimator alone: poses and tracks are in memory. See docs/performance.md.
//
//   estimation_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
#include <cstdint>

#include <benchmark/benchmark.h>

#include "model/gyro_increment.h"
#include "support/synthetic_poses.h"
#include "support/accel_mag_trials.h"
#include "support/six_turns.h"
#include "truetriad/calibrate/calibrate.h"

namespace truetriad {
namespace {

constexpr std::uint64_t kSeed = 7;

// Integrates one turn of 10 s at 100 Hz, with all derivatives.
void IntegrateTurn(benchmark::State& state) {
  Random random(kSeed);
  GyroMove move;
  for (int i = 0; i < 1000; ++i) {
    move.time_s.push_back(0.01 * i);
    move.reading_raw.push_back(random.Normal3());
    move.force_mps2.push_back(10.0 * random.Normal3());
  }
  for ([[maybe_unused]] const auto _ : state) {
    benchmark::DoNotOptimize(
        IntegrateMove(move, GyroModel{}, Eigen::Vector3d::Ones(), RateSampling::kInstantaneous));
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}
BENCHMARK(IntegrateTurn)->Unit(benchmark::kMicrosecond);

void RunCalibrate(const PoseSet& poses, const CalibrateOptions& options, benchmark::State* state) {
  for ([[maybe_unused]] const auto _ : *state) {
    const auto summary = Calibrate(poses, options);
    if (!summary || !summary->calibration.IsUsable()) state->SkipWithError("not usable");
    benchmark::DoNotOptimize(summary);
  }
  state->SetComplexityN(state->range(0));
}

// Calibrates accelerometer and magnetometer: 22 parameters and the dip. The noise is known.
void CalibrateJoint(benchmark::State& state) {
  Random random(kSeed);
  const SyntheticUnit unit = trials::RandomUnit({}, &random);
  CalibrateOptions options = trials::JointOptions(unit);
  for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kNone;
  const auto attitudes = RandomAttitudes(static_cast<int>(state.range(0)), &random);
  RunCalibrate(SimulatePoses(unit, attitudes, trials::ModelNoise(), &random), options, &state);
}
BENCHMARK(CalibrateJoint)
    ->Unit(benchmark::kMillisecond)
    ->RangeMultiplier(4)
    ->Range(24, 1536)
    ->Complexity(benchmark::oN);

// Calibrates all three triads, with turns of 2.5 s at 100 Hz between the poses: 33 parameters and
// the dip. All excess noise is estimated, which is the default.
void CalibrateNineAxes(benchmark::State& state) {
  constexpr Triad kGyroscope = Triad::kGyroscope;
  Random random(kSeed);
  // A spread like that of chips. If it were larger, turns would miss gravity by so much that a long
  // search for a wrong unit of measure would begin.
  trials::UnitSpread spread;
  spread.offset = 0.03;
  SyntheticUnit unit = trials::RandomUnit(spread, &random);
  unit.models[kGyroscope] = trials::RandomModel(spread, 1.0, &random);
  unit.units[kGyroscope] = trials::UnitOf(kGyroscope, false);
  CalibrateOptions options = trials::JointOptions(unit);
  options.triads[kGyroscope].enabled = true;
  SyntheticNoise noise = trials::ModelNoise();
  noise.rest_sigma[kGyroscope] = 5e-5;
  SyntheticTurns turns;
  turns.gyroscope_sigma_radps = 1e-3;
  turns.accelerometer_sigma_mps2 = 0.06;
  const auto attitudes = RandomAttitudes(static_cast<int>(state.range(0)), &random);
  PoseSet poses = SimulatePoses(unit, attitudes, noise, &random);
  AddTurns(unit, attitudes, turns, &random, &poses);
  RunCalibrate(poses, options, &state);
}
BENCHMARK(CalibrateNineAxes)
    ->Unit(benchmark::kMillisecond)
    ->RangeMultiplier(4)
    ->Range(24, 384)
    ->Complexity(benchmark::oN);

// Calibrates from six slow turns without a rest: 25 700 samples of each triad at 80 Hz. Argument:
// the number of samples from one attitude of the chain to the next.
void CalibrateTumbling(benchmark::State& state) {
  Random random(kSeed);
  const trials::SixTurns unit = trials::DrawSixTurns(&random);
  const auto push = [](double) -> Eigen::Vector3d { return Eigen::Vector3d::Zero(); };
  const double spacing_s = static_cast<double>(state.range(0)) * unit.spacing_s();
  RunCalibrate(trials::RecordSixTurns(unit, 1.0, push, &random),
               trials::SixTurnsOptions(unit, false, spacing_s),
               &state);
}
BENCHMARK(CalibrateTumbling)
    ->Unit(benchmark::kMillisecond)
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Arg(8)
    ->Arg(40);

}  // namespace
}  // namespace truetriad

BENCHMARK_MAIN();
