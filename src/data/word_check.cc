// SPDX-License-Identifier: Apache-2.0
#include "data/word_check.h"

#include <algorithm>
#include <cmath>

namespace truetriad {
namespace {

// Fewer readings do not say how they spread.
constexpr std::size_t kFewestAbout = 6;
// A check leaves out the most extreme of those about it on each side, which may be bad themselves.
constexpr std::size_t kTrimmed = 1;
// What remains of 16 spreads over 2.6 σ, which it tells like 12 degrees of freedom do.
constexpr double kSpreadSigmas = 2.6, kDof = 12.0;
// A word is this many times as far off as the others spread: they are 16 readings of one motion,
// whose end lies within one spread of them.
constexpr double kFarSpreads = 5.0;
// A chance below which a row is none: one good row in a million is no loss.
constexpr double kUnlikely = 1e-6;
// A third of the share of zeros in a stream: the chance that another one is a reading is then less
// than one in four.
constexpr double kZeroShare = 1.0 / 3.0;
// Where each row is elsewhere on the sphere a word lies among the others; a few in a row are then
// no rest.
constexpr std::size_t kFewInARow = 3;
// Another word on all three axes at once is none where it is half a spread off.
constexpr double kApartSpreads = 0.5;
// Readings that spread over fewer steps are a rest, in which any word may lie outside by chance.
constexpr double kSomeSteps = 20.0;

struct Spread {
  double low, high, step;
  double width() const { return std::max(high - low, step); }
  // Widths that a value is outside.
  double Off(double value) const { return std::max({low - value, value - high, 0.0}) / width(); }
  // Chance of a value of one step among readings scattered like these; of it, where it lies.
  double sigma() const { return std::max((high - low) / kSpreadSigmas, 0.5 * step); }
  double TailOf(double value) const {
    const double distance = (value - 0.5 * (low + high)) / sigma();
    return std::pow(1.0 + distance * distance / kDof, -0.5 * (kDof + 1.0));
  }
  double StepShare() const { return std::min(1.0, 0.4 * step / sigma()); }
};

Spread SpreadOf(const AboutWord& about, int axis) {
  std::vector<double> values;
  values.reserve(about.readings.size());
  for (const Eigen::Vector3d& reading : about.readings) values.push_back(reading[axis]);
  std::sort(values.begin(), values.end());
  return {values[kTrimmed], values[values.size() - 1 - kTrimmed], about.step[axis]};
}

}  // namespace

bool IsOneWord(const Eigen::Vector3d& reading) {
  return reading.x() == reading.y() && reading.y() == reading.z();
}

bool IsNoReading(const Eigen::Vector3d& reading, const AboutWord& about) {
  // What is not finite is a fault of the file.
  if (!reading.allFinite()) return false;
  if (reading.cwiseAbs().maxCoeff() >= kNoSensorReads) return true;
  if (about.readings.size() < kFewestAbout) return false;
  const bool one_word = IsOneWord(reading);
  const bool few = about.in_a_row <= kFewInARow;
  bool has_noise = false;
  double chance = 1.0, farthest = 0.0, apart = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const Spread spread = SpreadOf(about, axis);
    has_noise = has_noise || spread.high > spread.low;
    const double off = spread.Off(reading[axis]);
    if (one_word || IsWord(reading[axis])) farthest = std::max(farthest, off);
    if (one_word && spread.width() >= kSomeSteps * spread.step) apart = std::max(apart, off);
    chance *= spread.TailOf(reading[axis]) * (few ? spread.StepShare() : 1.0);
  }
  // A simulated rest between turns at constant rates.
  if (!has_noise && !few) return false;
  if (farthest > kFarSpreads) return true;
  if (!one_word) return false;
  if (reading.x() == 0.0) return chance < std::max(kUnlikely, kZeroShare * about.zero_share);
  return few && IsWord(reading.x()) && apart > kApartSpreads;
}

}  // namespace truetriad
