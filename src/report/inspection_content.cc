// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "report/charts.h"
#include "report/content.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

/// If the directions of two poses differ by less than this, they count as the same pose: a unit may
/// tilt by nearly as much on its seat.
constexpr double kDistinctDeg = 5.0;
/// The directions of one triad's raw readings, before any calibration.
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

Section StreamsSection(const PoseSet& poses, const Result<Calibration>& tried) {
  Table counts = Headed(
      "stream; unit; samples; rate [Hz]; jitter [ms]; time stamps; gaps; longest [s]; dropped rows",
      "llrrrlrrr");
  Table values = Headed("stream; ; x; y; z; unit", "llrrrl");
  for (const StreamSummary& stream : poses.streams) {
    const std::string_view name = TriadName(stream.triad);
    const std::string unit = DisplayUnit(stream.unit.name);
    counts.Add() << name << unit << stream.samples
                 << (poses.has_time ? Significant(stream.rate_hz, 6) : "no time")
                 << (poses.has_time ? Significant(1e3 * stream.jitter_s, 2) : "–")
                 << (poses.has_time ? StampKindName(stream.stamps) : "–") << stream.gaps
                 << Significant(stream.longest_gap_s, 3) << stream.dropped_empty;
    values.Add() << name << "smallest reading" << Significant(stream.minimum_raw, 5) << unit;
    values.Add() << ""
                 << "largest reading" << Significant(stream.maximum_raw, 5) << unit;
    if (!(stream.noise_sigma_raw.maxCoeff() > 0.0)) continue;
    values.Add() << ""
                 << "noise σ" << Significant(stream.noise_sigma_raw, 3) << unit;
    values.Add() << ""
                 << "correlation" << Significant(stream.correlation_inflation, 3) << "";
  }
  return {
      "Streams",
      {counts,
       values,
       "Noise is the σ of one sample within rests; correlation is the factor by which correlated "
       "noise increases the variance of a mean (1: white noise)."},
      [&poses, &tried] {
        return std::vector{TimelineDrawing(
            poses,
            tried ? tried->quality.rests.rejected_poses : std::vector<RejectedPose>(),
            /*leads_to_rows=*/false)};
      }};
}

/// The number of decimals that shows the largest mean of `triad` to six digits. The whole table has
/// the same number of decimals, which keeps its columns aligned.
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

Section PosesSection(const PoseSet& poses, Triad triad) {
  const int decimals = MeanDecimals(poses, triad);
  Table table =
      Headed("pose; start [s]; lasts [s]; samples; mean x; y; z; σ of mean; °C", "rrrrrrrrr");
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[triad]) continue;
    const TriadPose& reading = *pose.triads[triad];
    const double sigma = std::sqrt(reading.mean_covariance_raw.trace() / 3.0);
    table.Add() << pose.number
                << (poses.has_time ? Fixed(static_cast<double>(pose.start_ns) * 1e-9, 1) : "–")
                << (poses.has_time ? Fixed(pose.duration_s(), 1) : "–") << reading.samples
                << Fixed(reading.mean_raw, decimals)
                << (reading.has_covariance ? Significant(sigma, 2) : "–")
                << (pose.temperature_degc ? Fixed(*pose.temperature_degc, 1) : "–");
  }
  if (table.rows.empty()) return {};
  const std::size_t count = table.rows.size();
  if (count > kMostListed) {
    const auto half = static_cast<std::ptrdiff_t>(kMostListed / 2);
    table.rows.erase(table.rows.begin() + half, table.rows.end() - half);
    table.rows.insert(table.rows.begin() + half,
                      std::vector<std::string>(table.alignment.size(), "…"));
  }
  const StreamSummary* stream = poses.Find(triad);
  return {"Poses: " + std::string(TriadName(triad)) +
              (stream ? " [" + DisplayUnit(stream->unit.name) + "]" : "") + ", " +
              std::to_string(count) + (count > kMostListed ? ", the middle omitted" : ""),
          {table}};
}

/// Directions of accelerometer and magnetometer, if recorded; unset for the gyroscope.
using DirectionsOfSensors = PerTriad<std::optional<Directions>>;

DirectionsOfSensors DirectionsOf(const PoseSet& poses) {
  DirectionsOfSensors directions;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (poses.Find(triad)) directions[triad] = DirectionsAsRead(poses, triad);
  }
  return directions;
}

Section CoverageOfReadings(const DirectionsOfSensors& directions) {
  Table table =
      Headed("sensor; poses; distinct; spread along the three axes; largest gap", "lrrrr");
  for (const Triad triad : kTriads) {
    if (!directions[triad]) continue;
    const auto& [unit, distinct, coverage] = *directions[triad];
    table.Add() << TriadName(triad) << unit.size() << distinct
                << Joined(Fixed(coverage.eigenvalues, 3), " · ")
                << Fixed(coverage.largest_gap_deg, 0) + " deg";
  }
  if (table.rows.empty()) return {};
  return {
      "Coverage of the raw readings",
      {table,
       "Directions are seen from the middle of the range of the readings and count as distinct if "
       "at least " +
           Significant(kDistinctDeg, 2) +
           " deg apart. If the directions are spread evenly, each spread is 0.333; the gap is the "
           "radius of the largest circle on the sphere that contains no direction."},
      [directions] {
        return OfEachSensor([&](Triad triad) {
          return directions[triad] ? CoverageDrawing(directions[triad]->unit, triad) : Drawing();
        });
      }};
}

/// σ of the worst axis in words; "not estimated" if it is zero.
std::string WorstSigma(double sigma, double factor, const std::string& unit) {
  return sigma > 0.0 ? "± " + Significant(factor * sigma, 2) + " " + unit : "not estimated";
}

Section EnoughSection(const Calibration& tried) {
  Table table = Headed("sensor; bias; gains; axes", "lrrr");
  for (const Triad triad : kTriads) {
    if (!tried.sensors[triad]) continue;
    const TriadCalibration& sensor = *tried.sensors[triad];
    const Eigen::Matrix3d relative =
        sensor.Scale().cwiseAbs().cwiseInverse().asDiagonal() * sensor.sensitivity_sigma;
    double gain = 0.0, axes = 0.0;
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        double& worst = sensor.mounting(row, col) != 0.0 ? gain : axes;
        worst = std::max(worst, relative(row, col));
      }
    }
    table.Add() << TriadName(triad)
                << WorstSigma(sensor.bias_sigma.maxCoeff(), 1.0, DisplayUnit(sensor.input_unit))
                << WorstSigma(gain, 100.0, "%") << WorstSigma(axes, 1e3, "mrad");
  }
  return {"Is it enough?",
          {table,
           "One σ of the worst axis, as `truetriad calibrate` without an experiment finds it. "
           "Poses in new directions make σ smaller; `truetriad plan` names such poses."}};
}

/// The headline for `tried`, the outcome of a calibration with defaults.
Headline HeadlineOf(const Result<Calibration>& tried) {
  if (!tried) return {Grade::kBad, "NOT ENOUGH for any calibration", tried.error().message + "."};
  if (tried->IsUsable()) {
    std::string sensors;
    for (const Triad triad : kTriads) {
      if (!tried->sensors[triad]) continue;
      sensors += (sensors.empty() ? "" : ", ") + std::string(TriadName(triad));
    }
    return {Grade::kGood, "ENOUGH for a usable calibration", "Sensors: " + sensors + "."};
  }
  const bool is_enough = tried->outcome == Outcome::kNotConverged;
  const Finding* const refusal = FirstRefusal(tried->findings);
  return {Grade::kBad,
          (is_enough ? "NOT USABLE: " : "NOT ENOUGH: ") + std::string(tried->ReasonNotUsable()),
          refusal == nullptr ? "" : refusal->Message() + "."};
}

Section HeadOf(const PoseSet& poses) {
  Section head;
  head.Add(poses.source + (poses.serial.empty() ? "" : ", unit " + poses.serial));
  std::string found = std::to_string(poses.poses.size()) + " poses";
  if (!poses.how.empty()) found += " by " + poses.how;
  if (poses.has_time) {
    found += " in " + Fixed(poses.duration_s, 1) + " s, " + Percent(poses.static_share) +
             " of it at rest";
  }
  head.Add(found + ".");
  if (!poses.has_time && !poses.poses.empty()) {
    head.Add("No time column: each row is taken as the mean of a rest.");
  }
  head.Add(poses.temperature_range_degc
               ? "Temperature " + Fixed(poses.temperature_range_degc->x(), 1) + " to " +
                     Fixed(poses.temperature_range_degc->y(), 1) + " °C."
               : "No temperature recorded.");
  for (const Finding& finding : poses.findings) {
    head.Add((finding.severity == Severity::kNote ? "" : "WARNING: ") + finding.Message());
  }
  return head;
}

}  // namespace

VerbReport ReportOf(const PoseSet& poses, const Result<Calibration>& tried) {
  const DirectionsOfSensors directions = DirectionsOf(poses);
  PageContent content{"Inspection of " + poses.source, HeadlineOf(tried), {HeadOf(poses)}};
  const auto add = [&content](Section section) {
    if (!section.blocks.empty()) content.sections.push_back(std::move(section));
  };
  add(StreamsSection(poses, tried));
  for (const Triad triad : kTriads) add(PosesSection(poses, triad));
  add(CoverageOfReadings(directions));
  if (tried && tried->IsUsable()) add(EnoughSection(*tried));
  return ReportOf(content);
}

}  // namespace truetriad
