// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "data/known_motions.h"
#include "data/readings_at.h"
#include "data/repeats.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// Readings at an end are averaged over kBridgedS, but at least three: a second difference needs as
// many.
constexpr std::size_t kFewestAtEnd = 3;
// A rate at an end is real above 6 σ, which the norm of three normal errors exceeds once in 10^7.
constexpr double kEndSigmas = 6.0;
// Chosen: a ramp by hand ends within 0.5 s, so a slower ramp is extrapolated by 0.5 s only.
constexpr double kLongestRampS = 0.5;
// Chosen: a turn is cut if its missing angle exceeds this share of the stated angle's σ. The share
// is below 1, as the missing angles of all turns in a file have one sign.
constexpr double kMissingSigmas = 0.5;

struct End {
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d inner_raw = Eigen::Vector3d::Zero();  // Mean of as many readings farther inside.
  double sigma_raw = 0.0;                               // σ of mean_raw along any direction.
  double span_s = 0.0;                                  // Time from one mean to the other.
};

// Begin and end of a turn.
using Ends = std::array<End, 2>;

// The ends of a turn; unset if it has too few readings for both.
std::optional<Ends> EndsOf(const RecordedMove& move) {
  const std::vector<Eigen::Vector3d>& readings = move.gyroscope_raw;
  const std::size_t count = readings.size();
  if (count < 2) return std::nullopt;
  const double spacing_s = move.duration_s() / static_cast<double>(count - 1);
  if (!(spacing_s > 0.0)) return std::nullopt;
  const std::size_t most =
      std::max(kFewestAtEnd, static_cast<std::size_t>(std::lround(kBridgedS / spacing_s)));
  if (count < 4 * most) return std::nullopt;
  Ends ends;
  for (const bool is_last : {false, true}) {
    const auto at = [&](std::size_t i) -> const Eigen::Vector3d& {
      return readings[is_last ? count - 1 - i : i];
    };
    End& end = ends[is_last ? 1 : 0];
    double square = 0.0;
    for (std::size_t i = 0; i < 2 * most; ++i) {
      (i < most ? end.mean_raw : end.inner_raw) += at(i) / static_cast<double>(most);
      // Second differences contain no ramp: their square is 6 σ² on each of three axes.
      square += (at(i) - 2.0 * at(i + 1) + at(i + 2)).squaredNorm() / 18.0;
    }
    end.sigma_raw = std::sqrt(square / static_cast<double>(2 * most * most));
    end.span_s = spacing_s * static_cast<double>(most);
  }
  return ends;
}

struct Level {
  std::int64_t time_ns = 0;
  Eigen::Vector3d reading_raw = Eigen::Vector3d::Zero();
};

// The gyroscope's readings in rests and at the ends of turns; `ends[i]` are of set.turns[i].
std::vector<Level> LevelsOf(const PoseSet& set, const std::vector<std::optional<Ends>>& ends) {
  std::vector<Level> levels;
  for (const StaticPose& pose : set.poses) {
    if (const auto& means = pose.triads[Triad::kGyroscope]) {
      levels.push_back({pose.middle_ns(), means->mean_raw});
    }
  }
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (!ends[i]) continue;
    const std::vector<std::int64_t>& times = set.turns[i].move.time_ns;
    levels.push_back({times.front(), ends[i]->front().mean_raw});
    levels.push_back({times.back(), ends[i]->back().mean_raw});
  }
  return levels;
}

// The reading at rest: the median of the nearest levels. It follows the drift of the bias, and cut
// turns of both signs do not shift it.
Eigen::Vector3d LevelAt(std::int64_t time_ns, std::vector<Level>* levels) {
  // Chosen: the median of 16 has an error of 1.25 / √16 of their σ, a third.
  constexpr std::size_t kNearest = 16;
  const std::size_t count = std::min(kNearest, levels->size());
  const auto distance = [time_ns](const Level& level) { return std::abs(level.time_ns - time_ns); };
  std::partial_sort(levels->begin(),
                    levels->begin() + static_cast<std::ptrdiff_t>(count),
                    levels->end(),
                    [&](const Level& a, const Level& b) { return distance(a) < distance(b); });
  Eigen::Vector3d middle;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back((*levels)[i].reading_raw[axis]);
    middle[axis] = Median(std::move(values));
  }
  return middle;
}

// The angle, rad, by which a turn continues beyond one end, from the rate there and its slope; zero
// within noise. `rad_per_raw`: scale of the integral of readings.
double MissingAngle(const End& end, const Eigen::Vector3d& rest_raw, double rad_per_raw) {
  const Eigen::Vector3d off = end.mean_raw - rest_raw;
  if (!(off.norm() > kEndSigmas * end.sigma_raw)) return 0.0;
  const Eigen::Vector3d direction = off.normalized();
  const double change = (end.inner_raw - end.mean_raw).dot(direction) / end.span_s;
  // The line through both means, extrapolated to the end; negative if the turn begins later.
  const double rate = off.norm() - 0.5 * change * end.span_s;
  if (!(rate > kEndSigmas * std::sqrt(2.5) * end.sigma_raw)) return 0.0;
  const double ramp_s = change > 0.0 ? std::min(rate / change, kLongestRampS) : kLongestRampS;
  return 0.5 * rate * ramp_s * rad_per_raw;
}

// Radians per raw unit and second, from the stated angle of the turn.
double ScaleOf(const KnownTurn& turn, const Eigen::Vector3d& rest_raw) {
  const RecordedMove& move = turn.move;
  const Eigen::Vector3d mean_raw = MeanOverTime(move.time_ns, move.gyroscope_raw);
  const double turned = (mean_raw - rest_raw).norm() * move.duration_s();
  return turned > 0.0 ? std::abs(turn.stated.angle_rad) / turned : 0.0;
}

}  // namespace

void RejectCutTurns(PoseSet* set) {
  if (set->turns.empty()) return;
  std::vector<std::optional<Ends>> ends_of;
  for (const KnownTurn& turn : set->turns) ends_of.push_back(EndsOf(turn.move));
  std::vector<Level> levels = LevelsOf(*set, ends_of);
  std::size_t cut = 0;
  double most_rad = 0.0;
  for (std::size_t i = 0; i < ends_of.size(); ++i) {
    const std::optional<Ends>& ends = ends_of[i];
    KnownTurn& turn = set->turns[i];
    if (!ends || turn.move.fault || turn.stated.at.is_pose()) continue;
    const std::vector<std::int64_t>& times = turn.move.time_ns;
    const Eigen::Vector3d rest_raw = LevelAt(times[times.size() / 2], &levels);
    const double rad_per_raw = ScaleOf(turn, rest_raw);
    for (const bool is_last : {false, true}) {
      const double missing_rad = MissingAngle((*ends)[is_last ? 1 : 0], rest_raw, rad_per_raw);
      if (!(missing_rad > kMissingSigmas * turn.stated.sigma_rad)) continue;
      if (!Acts(Mechanism::kTurnCut)) continue;
      turn.move.fault =
          Finding(FindingCode::kTurnCut,
                  std::string("it ") + (is_last ? "ends" : "begins") +
                      Format(" while the unit still turns: about %.2g deg of the turn are ",
                             missing_rad * kDegPerRad) +
                      (is_last ? "after its stated end" : "before its stated start"))
              .With("missing", missing_rad * kDegPerRad, "deg");
      most_rad = std::max(most_rad, missing_rad);
    }
    cut += turn.move.fault ? 1 : 0;
  }
  if (cut == 0) return;
  set->findings.push_back(
      Finding(FindingCode::kTurnCut,
              "of " + std::to_string(set->turns.size()) + " known turns " + std::to_string(cut) +
                  (cut == 1 ? " is" : " are") +
                  " left out, as the stated rows or times begin or end while the unit still turns" +
                  Format(": up to about %.2g deg of a turn are outside", most_rad * kDegPerRad))
          .About(Triad::kGyroscope)
          .With("turns", static_cast<double>(cut))
          .With("missing", most_rad * kDegPerRad, "deg"));
}

}  // namespace truetriad
