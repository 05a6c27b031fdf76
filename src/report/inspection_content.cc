// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/base/units.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

/// Longer pose tables are cut in the middle.
constexpr std::size_t kMaxPoseLines = 60;
/// Poses closer than this say the same thing again; a tilted seat still counts as new.
constexpr double kDistinctDeg = 5.0;
/// Smallest eigenvalue of the mean of u u^T (1/3 when even) of poses that lie near a plane.
constexpr double kPlanar = 0.05;
/// Two to three times as many equations as unknowns, and enough left over to estimate the noise.
constexpr int kRecommendedPoses = 20;

/// Where the readings of one triad point, as read: before any calibration.
struct Directions {
  std::vector<Eigen::Vector3d> unit;
  int distinct = 0;
  Coverage coverage;
};

int CountDistinct(const std::vector<Eigen::Vector3d>& unit) {
  const double limit = std::cos(kDistinctDeg / kDegPerRad);
  std::vector<Eigen::Vector3d> found;
  for (const Eigen::Vector3d& u : unit) {
    if (std::none_of(found.begin(), found.end(), [&](const auto& v) { return u.dot(v) > limit; })) {
      found.push_back(u);
    }
  }
  return static_cast<int>(found.size());
}

Directions DirectionsAsRead(const PoseSet& poses, Triad triad) {
  std::vector<Eigen::Vector3d> readings;
  for (const StaticPose& pose : poses.poses) {
    if (pose.triads[triad]) readings.push_back(pose.triads[triad]->mean_raw);
  }
  Directions directions;
  if (readings.empty()) return directions;
  Eigen::Vector3d low = readings.front();
  Eigen::Vector3d high = readings.front();
  for (const Eigen::Vector3d& reading : readings) {
    low = low.cwiseMin(reading);
    high = high.cwiseMax(reading);
  }
  const Eigen::Vector3d centre = 0.5 * (low + high);
  for (const Eigen::Vector3d& reading : readings) {
    const Eigen::Vector3d centred = reading - centre;
    if (centred.norm() > 0.0) directions.unit.push_back(centred.normalized());
  }
  directions.distinct = CountDistinct(directions.unit);
  directions.coverage = DirectionCoverage(triad, directions.unit);
  return directions;
}

PageSection StreamsSection(const PoseSet& poses) {
  Table counts{{"stream",
                "unit",
                "samples",
                "rate [Hz]",
                "jitter [ms]",
                "time stamps",
                "gaps",
                "longest [s]",
                "dropped rows"},
               "llrrrlrrr",
               {}};
  Table values{{"stream", "", "x", "y", "z", "unit"}, "llrrrl", {}};
  const auto add = [&](const std::string& label,
                       const std::string& quantity,
                       const Eigen::Vector3d& v,
                       int digits,
                       const std::string& unit) {
    values.rows.push_back({label,
                           quantity,
                           Significant(v.x(), digits),
                           Significant(v.y(), digits),
                           Significant(v.z(), digits),
                           unit});
  };
  for (const StreamSummary& stream : poses.streams) {
    const std::string name(TriadName(stream.triad));
    const std::string unit = DisplayUnit(stream.unit.name);
    counts.rows.push_back({name,
                           unit,
                           std::to_string(stream.samples),
                           poses.has_time ? Significant(stream.rate_hz, 6) : "no time",
                           poses.has_time ? Significant(1e3 * stream.jitter_s, 2) : "–",
                           poses.has_time ? std::string(StampKindName(stream.stamps)) : "–",
                           std::to_string(stream.gaps),
                           Significant(stream.longest_gap_s, 3),
                           std::to_string(stream.dropped_empty)});
    add(name, "smallest reading", stream.minimum_raw, 5, unit);
    add("", "largest reading", stream.maximum_raw, 5, unit);
    if (stream.noise_sigma_raw.maxCoeff() > 0.0) {
      add("", "noise σ", stream.noise_sigma_raw, 3, unit);
      add("", "correlation", stream.correlation_inflation, 3, "");
    }
  }
  return {"Streams",
          {counts,
           values,
           "Noise is the σ of one sample within rests; correlation is the factor on the variance of "
           "means (1 = white)."}};
}

/// Decimals that show the largest mean of `triad` to six digits; one number for a whole table, so
/// that its columns line up.
int MeanDecimals(const PoseSet& poses, Triad triad) {
  double largest = 0.0;
  for (const StaticPose& pose : poses.poses) {
    if (pose.triads[triad]) {
      largest = std::max(largest, pose.triads[triad]->mean_raw.cwiseAbs().maxCoeff());
    }
  }
  if (!(largest > 0.0) || !std::isfinite(largest)) return 3;
  return std::clamp(5 - static_cast<int>(std::floor(std::log10(largest))), 0, 12);
}

PageSection PosesSection(const PoseSet& poses, Triad triad) {
  const int decimals = MeanDecimals(poses, triad);
  Table table{{"pose", "start [s]", "lasts [s]", "samples", "mean x", "y", "z", "σ of mean", "°C"},
              "rrrrrrrrr",
              {}};
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[triad]) continue;
    const TriadPose& reading = *pose.triads[triad];
    table.rows.push_back(
        {std::to_string(pose.number),
         poses.has_time ? Fixed(static_cast<double>(pose.start_ns) * 1e-9, 1) : "–",
         poses.has_time ? Fixed(pose.duration_s(), 1) : "–",
         std::to_string(reading.samples),
         Fixed(reading.mean_raw.x(), decimals),
         Fixed(reading.mean_raw.y(), decimals),
         Fixed(reading.mean_raw.z(), decimals),
         reading.has_covariance
             ? Significant(std::sqrt(reading.mean_covariance_raw.trace() / 3.0), 2)
             : "–",
         pose.temperature_degc ? Fixed(*pose.temperature_degc, 1) : "–"});
  }
  if (table.rows.empty()) return {};
  const std::size_t count = table.rows.size();
  if (count > kMaxPoseLines) {
    constexpr auto kHalf = static_cast<std::ptrdiff_t>(kMaxPoseLines / 2);
    table.rows.erase(table.rows.begin() + kHalf, table.rows.end() - kHalf);
    table.rows.insert(table.rows.begin() + kHalf,
                      std::vector<std::string>(table.alignment.size(), "…"));
  }
  const StreamSummary* stream = poses.Find(triad);
  return {"Poses: " + std::string(TriadName(triad)) +
              (stream ? " [" + DisplayUnit(stream->unit.name) + "]" : "") + ", " +
              std::to_string(count) + (count > kMaxPoseLines ? ", the middle omitted" : ""),
          {table}};
}

/// Whether poses suffice; the better, the higher.
enum class Enough { kNo, kBarely, kYes };
struct Judgement {
  Enough enough = Enough::kYes;
  std::string text;
};

/// Whether poses that point as these do determine `unknowns` parameters of one triad.
Judgement JudgementOf(const Directions& directions, int unknowns) {
  const std::string have = std::to_string(directions.distinct);
  const std::string need = std::to_string(unknowns);
  if (directions.distinct < unknowns) {
    return {Enough::kNo, "no: " + have + " distinct directions for " + need + " unknowns"};
  }
  if (directions.coverage.eigenvalues(0) < kPlanar) {
    return {Enough::kNo,
            "no: the directions lie close to one plane; turn the unit about another axis too"};
  }
  if (directions.distinct < std::max(2 * unknowns, 6)) {
    return {Enough::kBarely,
            "barely: " + have + " distinct directions for " + need + " unknowns; " +
                std::to_string(std::max(kRecommendedPoses * unknowns / 9, 6)) +
                " or more recommended"};
  }
  return {Enough::kYes, "yes: " + have + " distinct directions for " + need + " unknowns"};
}

const Judgement& Lesser(const Judgement& a, const Judgement& b) {
  return a.enough <= b.enough ? a : b;
}

/// Directions of the sensors that are calibrated by where they point; empty for others.
using DirectionsOfSensors = PerTriad<std::optional<Directions>>;

DirectionsOfSensors DirectionsOf(const PoseSet& poses) {
  DirectionsOfSensors directions;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (poses.Find(triad)) directions[triad] = DirectionsAsRead(poses, triad);
  }
  return directions;
}

bool GyroscopeRested(const PoseSet& poses) {
  return std::any_of(poses.poses.begin(), poses.poses.end(), [](const auto& pose) {
    return pose.triads[Triad::kGyroscope].has_value();
  });
}

PageSection CoverageOfReadings(const DirectionsOfSensors& directions) {
  Table table{
      {"sensor", "poses", "distinct", "spread along the three axes", "largest gap"}, "lrrrr", {}};
  for (const Triad triad : kTriads) {
    if (!directions[triad]) continue;
    const Directions& found = *directions[triad];
    table.rows.push_back({std::string(TriadName(triad)),
                          std::to_string(found.unit.size()),
                          std::to_string(found.distinct),
                          Fixed(found.coverage.eigenvalues(0), 3) + " · " +
                              Fixed(found.coverage.eigenvalues(1), 3) + " · " +
                              Fixed(found.coverage.eigenvalues(2), 3),
                          Fixed(found.coverage.largest_gap_deg, 0) + " deg"});
  }
  if (table.rows.empty()) return {};
  return {"Coverage of the raw readings",
          {table,
           "Directions are seen from the middle of the range of the readings and count as distinct "
           "if " +
               Significant(kDistinctDeg, 2) +
               " deg apart. Spread is 0.333 each if even; the gap is the radius of the largest cap "
               "of the sphere without a direction."}};
}

constexpr int kBiasUnknowns = 3, kDiagonalUnknowns = 6, kFullUnknowns = 9;

PageSection EnoughSection(const PoseSet& poses, const DirectionsOfSensors& directions) {
  Table table{{"calibration", "enough?"}, "ll", {}};
  for (const Triad triad : kTriads) {
    if (!directions[triad]) continue;
    const std::string name(TriadName(triad));
    for (const auto& [model, unknowns] : {std::pair(", bias only", kBiasUnknowns),
                                          std::pair(", diagonal", kDiagonalUnknowns),
                                          std::pair(", full", kFullUnknowns)}) {
      table.rows.push_back({name + model, JudgementOf(*directions[triad], unknowns).text});
    }
  }
  if (directions[Triad::kAccelerometer] && directions[Triad::kMagnetometer]) {
    table.rows.push_back(
        {"accelerometer and magnetometer, full",
         Lesser(JudgementOf(*directions[Triad::kAccelerometer], kFullUnknowns),
                JudgementOf(*directions[Triad::kMagnetometer], kFullUnknowns))
             .text});
  }
  if (poses.Find(Triad::kGyroscope)) {
    table.rows.push_back({"gyroscope, bias only",
                          GyroscopeRested(poses) ? "yes: it was at rest" : "no rests"});
  }
  return {"Is it enough?",
          {table,
           "With unknown attitudes, each direction gives one equation per sensor; " +
               std::to_string(kRecommendedPoses) +
               " or more well-spread directions are recommended for a full matrix, so that the "
               "noise can be estimated too."}};
}

/// A recording that could be followed through its motion, and has too few rests for anything else.
bool IsTumbled(const PoseSet& poses) {
  constexpr double kMostAtRest = 0.2;
  constexpr std::size_t kFewPoses = 4;
  return poses.has_time && poses.poses.size() < kFewPoses && poses.static_share < kMostAtRest &&
         poses.Find(Triad::kGyroscope) != nullptr && poses.Find(Triad::kAccelerometer) != nullptr;
}

/// Whether there is enough for the full matrix of each sensor that is calibrated by where it points.
Verdict VerdictOf(const PoseSet& poses, const DirectionsOfSensors& directions) {
  if (IsTumbled(poses)) {
    return {Grade::kCaution,
            "HARDLY RESTS",
            "If it was tumbled on purpose, calibrate it with `poses: { motion: { spacing_s: 0.1 } "
            "}`."};
  }
  std::optional<Judgement> least;
  Triad least_triad = Triad::kAccelerometer;
  for (const Triad triad : kTriads) {
    if (!directions[triad]) continue;
    const Judgement judgement = JudgementOf(*directions[triad], kFullUnknowns);
    if (least && judgement.enough >= least->enough) continue;
    least = judgement;
    least_triad = triad;
  }
  if (!least) {
    return GyroscopeRested(poses)
               ? Verdict{Grade::kCaution, "ENOUGH for the gyroscope's bias only", ""}
               : Verdict{Grade::kBad, "NOT ENOUGH for any calibration", ""};
  }
  const std::string what = "a full calibration of the " + std::string(TriadName(least_triad));
  const std::string why = TriadTitle(least_triad) + ": " + least->text + ".";
  switch (least->enough) {
    case Enough::kNo:
      return {Grade::kBad, "NOT ENOUGH for " + what, why};
    case Enough::kBarely:
      return {Grade::kCaution, "BARELY ENOUGH for " + what, why};
    case Enough::kYes:
      break;
  }
  return {Grade::kGood, "ENOUGH for a full calibration", ""};
}

PageSection HeadOf(const PoseSet& poses) {
  PageSection head;
  head.blocks.emplace_back(poses.source + (poses.serial.empty() ? "" : ", unit " + poses.serial));
  std::string found = std::to_string(poses.poses.size()) + " poses";
  if (!poses.how.empty()) found += " by " + poses.how;
  if (poses.has_time) {
    found += " in " + Fixed(poses.duration_s, 1) + " s, " + Percent(poses.static_share) +
             " of it at rest";
  }
  head.blocks.emplace_back(found + ".");
  head.blocks.emplace_back(poses.temperature_range_degc
                               ? "Temperature " + Fixed(poses.temperature_range_degc->x(), 1) +
                                     " to " + Fixed(poses.temperature_range_degc->y(), 1) + " °C."
                               : "No temperature recorded.");
  for (const Finding& finding : poses.findings) {
    head.blocks.emplace_back((finding.severity == Severity::kNote ? "" : "WARNING: ") +
                             finding.Message());
  }
  return head;
}

PageContent ContentOf(const PoseSet& poses) {
  const DirectionsOfSensors directions = DirectionsOf(poses);
  PageContent content{
      "Inspection of " + poses.source, VerdictOf(poses, directions), {HeadOf(poses)}};
  const auto add = [&content](PageSection section) {
    if (!section.blocks.empty()) content.sections.push_back(std::move(section));
  };
  add(StreamsSection(poses));
  for (const Triad triad : kTriads) add(PosesSection(poses, triad));
  add(CoverageOfReadings(directions));
  add(EnoughSection(poses, directions));
  return content;
}

}  // namespace

Grade GradeOf(const PoseSet& poses) { return ContentOf(poses).verdict.grade; }

std::string InspectionText(const PoseSet& poses) { return TextOf(ContentOf(poses)); }

std::string InspectionHtml(const PoseSet& poses) { return HtmlOf(ContentOf(poses)); }

}  // namespace truetriad
