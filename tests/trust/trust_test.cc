// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "trust/trial.h"

namespace truetriad::trust {
namespace trust_test {

namespace fs = std::filesystem;

// A prime, so that a slice of the seeds meets all kinds.
constexpr std::uint64_t kStride = 101;

std::vector<Trial> RunAll(const std::vector<Kind>& kinds,
                          std::uint64_t first,
                          std::uint64_t count) {
  const fs::path folder = fs::path(testing::TempDir()) / ("trust" + std::to_string(first));
  std::vector<Trial> trials;
  std::mutex mutex;
  std::atomic<std::uint64_t> next = 0;
  {
    std::vector<std::jthread> workers;
    for (int worker = 0; worker < 2; ++worker) {
      workers.emplace_back([&] {
        for (std::uint64_t i; (i = next++) < count;) {
          const std::uint64_t seed = first + kStride * i;
          const Trial trial = RunTrial(seed, kinds, (folder / std::to_string(seed)).string());
          const std::scoped_lock lock(mutex);
          trials.push_back(trial);
        }
      });
    }
  }
  fs::remove_all(folder);
  return trials;
}

// Other seeds than the 4000 of the nightly run, and than those of docs/trust.md.
TEST(Trust, ContaminatedRecordingsAreRightOrRefused) {
  constexpr std::uint64_t kRuns = 240;
  // Share of the runs in which something shows the fault. It is what is reached today, and must not
  // get worse; docs/trust.md states the aim.
  constexpr double kMostWrong = 0.015;
  int wrong = 0, seen = 0, right = 0;
  for (const Trial& trial : RunAll(Kinds(), 100'000, kRuns)) {
    EXPECT_NE(trial.verdict, Verdict::kCrashed) << trial.seed << ": " << trial.refusal;
    EXPECT_FALSE(trial.is_left_standing) << trial.seed << ": " << trial.kind.Name();
    right += trial.verdict == Verdict::kRight;
    if (!trial.kind.CanBeSeen()) continue;
    ++seen;
    if (trial.verdict != Verdict::kWrong) continue;
    ++wrong;
    std::cout << trial.seed << ": " << trial.kind.Name() << " " << trial.severity << ", "
              << trial.second << ": " << trial.worst_parameter << " off by " << trial.worst_sigmas
              << " sigma\n";
  }
  EXPECT_LE(wrong, kMostWrong * seen);
  EXPECT_GE(right, 0.5 * kRuns);  // Refusing everything is no answer.
}

TEST(Trust, CleanRecordingsAreRight) {
  std::vector<Kind> kinds;
  for (const Regime regime : kRegimes) kinds.push_back({nullptr, {}, regime});
  for (const Trial& trial : RunAll(kinds, 200'000, 140)) {
    EXPECT_EQ(trial.verdict, Verdict::kRight)
        << trial.seed << ": " << trial.kind.Name() << " " << trial.worst_parameter << " "
        << trial.worst_sigmas << " " << trial.refusal;
  }
}

}  // namespace trust_test
}  // namespace truetriad::trust
