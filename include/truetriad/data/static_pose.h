// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/tags.h"
#include "truetriad/thermometer/temperature_track.h"

namespace truetriad {

/// Rows `first` to `last` of the leading stream's file, counted from 0, both included; empty if
/// last < first.
struct RowSpan {
  std::int64_t first = 0;
  std::int64_t last = -1;
  bool empty() const { return last < first; }
};

/// A range of time as the log's stamps state it, both ends included; empty if end_ns < start_ns.
struct TimeRange {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = -1;
  bool empty() const { return end_ns < start_ns; }
};

/// Where in a recording a known motion took place: by rows, by time, or by a pose.
struct MotionPlace {
  RowSpan rows;
  TimeRange times;
  /// StaticPose::number, used if neither rows nor times are stated. A rate was held in this pose; a
  /// turn leads from this pose into the next one.
  int pose = 0;
  std::string stated_in;  ///< Where the motion is stated, as "turns.yaml:3"; may be empty.
  bool is_pose() const { return rows.empty() && times.empty(); }
};

/// A turn whose angle the operator states.
struct StatedTurn {
  MotionPlace at;
  std::string id;
  /// Stated axis of the turn: unit vector, body frame, right-handed.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double angle_rad = 0.0;  ///< Whole turns count: 4 pi is two turns.
  /// σ of the attitude that the stated angle predicts after the turn, about each axis. Range: > 0.
  double sigma_rad = 0.0;
  /// σ of the direction of `axis`: of its tilt about each perpendicular axis. Range: > 0.
  double axis_sigma_rad = 0.0;
  /// If true, the turn is only predicted, and the error of the prediction is reported.
  bool held_out = false;
};

/// A rate at which a table is known to have turned the unit.
struct StatedRate {
  MotionPlace at;
  std::string id;
  /// In the body frame. If the axis is not known, only the length of the vector has a meaning.
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();
  bool is_axis_known = true;
  /// Covariance of the error of rate_radps, (rad/s)^2. Errors of different rates are independent.
  Eigen::Matrix3d covariance_radps2 = Eigen::Matrix3d::Zero();
};

/// One pose that an operator, a fixture or the simulator is to take.
struct ProgramPose {
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  std::optional<double> temperature_degc;  ///< Chamber temperature; unset if it is not controlled.
  std::string label;                       ///< "x up, y to the north"; for people.
};

/// Poses in the order in which they are taken.
struct PoseProgram {
  std::vector<ProgramPose> poses;
};

/// The readings of one triad during one rest.
struct TriadPose {
  std::int64_t samples = 0;
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  /// Covariance of mean_raw, raw unit squared, allowing for correlated noise. If it is unknown (one
  /// sample and no sigma column), it is zero and `has_covariance` is false.
  Eigen::Matrix3d mean_covariance_raw = Eigen::Matrix3d::Zero();
  bool has_covariance = false;
  /// Covariance of the samples within the rest, that is, of one sample's noise, raw unit squared.
  Eigen::Matrix3d sample_covariance_raw = Eigen::Matrix3d::Zero();
  /// The mean at the end of the rest minus the mean at its begin; each is over a window, or over up
  /// to 1/64 of a long rest. Zero if the rest is too short for two windows. Divided by the pose's
  /// duration, it is the derivative of mean_raw with respect to a shift of the clock.
  Eigen::Vector3d end_to_end_raw = Eigen::Vector3d::Zero();
  /// The mean of the rest's first quarter minus that of its middle half, times the duration of a
  /// quarter; the same for the last quarter; then the σ of both. Raw unit times s; zero if the rest
  /// has fewer than 16 windows.
  Eigen::Vector3d first_quarter_raw_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_quarter_raw_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d quarter_sigma_raw_s = Eigen::Vector3d::Zero();
};

/// An attitude that another instrument measured (turntable, robot, fixture).
struct AttitudeReference {
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Zero();  ///< About the body axes.
};

/// One rest of the unit: the sufficient statistics of its samples.
struct StaticPose {
  int number = 0;              ///< 1-based; used in messages and reports.
  int session = 0;             ///< Index into PoseSet::sessions.
  std::string id;              ///< Given name, or empty.
  std::int64_t start_ns = 0;   ///< Time of the first sample used; 0 without time.
  std::int64_t end_ns = 0;     ///< Time of the last sample used.
  std::int64_t first_row = 0;  ///< 0-based data rows, both included.
  std::int64_t last_row = 0;
  PerTriad<Boxed<TriadPose>> triads;
  std::optional<double> temperature_degc;
  double temperature_rate_degcps = 0.0;
  std::optional<AttitudeReference> attitude;
  /// Face of the six-face block that points up, if it is stated: "+x", "-x", … ; else empty.
  std::string face_up;

  double duration_s() const { return static_cast<double>(end_ns - start_ns) * 1e-9; }
  std::int64_t middle_ns() const { return start_ns / 2 + end_ns / 2; }
};

/// The gyroscope's readings between two consecutive poses, or in the rows or times of a stated
/// turn.
struct RecordedMove {
  std::size_t from = 0;  ///< Index of the pose before the move; the next pose follows it.
  std::vector<std::int64_t> time_ns;
  std::vector<Eigen::Vector3d> gyroscope_raw;
  /// Interpolated to the gyroscope's times; empty without the sensor.
  std::vector<Eigen::Vector3d> accelerometer_raw, magnetometer_raw;
  std::optional<Finding> fault;  ///< Why the readings do not determine the turn; unset if they do.

  /// Needs at least one reading.
  double duration_s() const { return 1e-9 * static_cast<double>(time_ns.back() - time_ns.front()); }
};

/// Readings of one triad over a whole recording, in time order.
struct ReadingTrack {
  std::vector<std::int64_t> time_ns;
  std::vector<Eigen::Vector3d> reading_raw;
  std::vector<std::int64_t> row;  ///< Rows of its file, 0-based; kept for the gyroscope only.
};

/// The lowest and the highest reading of each axis in consecutive slices of equal length. A drawing
/// of a long recording needs no more, and shows every outlier.
struct ReadingTrace {
  struct Slice {
    Eigen::Vector3f lowest_raw, highest_raw;  ///< Lowest > highest: no reading in the slice.
  };
  std::int64_t start_ns = 0, slice_ns = 0;
  std::vector<Slice> slices;  ///< Empty without time.
};

/// The smoothed temperatures of a sweep, and where its windows lie in them.
struct SweepTrack {
  TemperatureTrack temperature;
  /// Ambient temperature at the same times, if SweepWindows::ambient asked for it; NaN: not read.
  TemperatureTrack ambient;
  /// For each pose (window): first and last place in the track, and number of the attitude, from 0.
  std::vector<std::size_t> first, last;
  std::vector<int> attitude;
  std::vector<std::string> attitude_names;
  /// The outliers in words, such as "row 0 (at 0.0 s, 20.0 degC): outliers: gyroscope x".
  std::vector<std::string> left_out;
};

/// A stated turn and what the gyroscope read during it.
struct KnownTurn {
  StatedTurn stated;
  RecordedMove move;  ///< `from` is not used.
};

/// A stated rate and the means of all triads while it was held.
struct KnownRate {
  StatedRate stated;
  StaticPose means;
};

/// How the time stamps of a stream scatter about even times in the stretches between gaps.
enum class StampKind {
  kRegular,    ///< The RMS jitter is below 2 % of an interval.
  kJittered,   ///< The errors of the stamps are independent.
  kInBursts,   ///< Several samples wait and are stamped together on arrival.
  kOnTicks,    ///< Rounded to the ticks of a coarse clock.
  kIrregular,  ///< Errors about even times add up from sample to sample.
};

/// "regular", "jittered", "in bursts", "on ticks", "irregular".
std::string_view StampKindName(StampKind kind);

/// How one triad's readings behave over the whole recording.
struct StreamSummary {
  Triad triad = Triad::kAccelerometer;
  Unit unit;
  std::int64_t samples = 0;
  std::int64_t dropped_empty = 0;
  double rate_hz = 0.0;  ///< Mean rate between gaps; 0 without time.
  /// Median number of consecutive rows with the same reading; more than 1 if the log is faster than
  /// the sensor.
  double repeats = 1.0;
  StampKind stamps = StampKind::kRegular;
  double jitter_s = 0.0;         ///< RMS difference of the stamps from even times.
  bool are_stamps_even = false;  ///< Whether even times replace the stamps.
  std::int64_t gaps = 0;         ///< Number of spacings above 5 times the usual one.
  double longest_gap_s = 0.0;
  double longest_gap_at_s = 0.0;  ///< Begin of the longest gap, from the stream's first sample.
  std::int64_t duplicate_times = 0;
  Eigen::Vector3d minimum_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d maximum_raw = Eigen::Vector3d::Zero();
  /// The half of all readings whose lengths lie closest together (LengthSpread): their length, the
  /// scatter of lengths and the range of each axis; the last two are shares of the length.
  double length_raw = 0.0;
  double length_scatter = 0.0;
  Eigen::Vector3d length_extent = Eigen::Vector3d::Zero();
  Eigen::Vector3d resolution_raw = Eigen::Vector3d::Zero();  ///< Smallest step; zero when unknown.
  /// Width of the interval of inputs that give the same reading: the step, or a dead band.
  Eigen::Vector3d rest_step_raw = Eigen::Vector3d::Zero();
  /// White-noise σ of one sample inside rests, per axis, pooled; zero when unknown.
  Eigen::Vector3d noise_sigma_raw = Eigen::Vector3d::Zero();
  /// Long-run variance divided by white variance, within rests; 1 means white noise. Correlated
  /// noise raises the variance of a mean by this factor.
  Eigen::Vector3d correlation_inflation = Eigen::Vector3d::Ones();
  /// Upper bound of the shift of all means by one-sided outliers (spikes); zero without outliers.
  Eigen::Vector3d one_sided_raw = Eigen::Vector3d::Zero();
};

/// One of several recordings of a unit that was switched off in between.
struct Session {
  std::string source;  ///< The recording's path.
  int first_pose = 0;  ///< First and last pose number in the set.
  int last_pose = 0;
};

/// All rests of one unit: what the estimator reads.
struct PoseSet {
  std::string source;             ///< The recording's path.
  std::vector<Session> sessions;  ///< Empty: one recording.
  std::string serial;
  Tags tags;  ///< What a manifest states about the unit and the run.
  std::vector<StaticPose> poses;
  std::vector<RecordedMove> moves;  ///< Filled in if PoseSelection::moves is true.
  PerTriad<ReadingTrack> tracks;    ///< Filled in for PoseSelectionKind::kMotion.
  PerTriad<ReadingTrace> traces;
  SweepTrack sweep;              ///< Filled in for PoseSelectionKind::kSweep.
  std::vector<KnownTurn> turns;  ///< In the order they were stated.
  std::vector<KnownRate> rates;  ///< In the order they were stated.
  std::vector<StreamSummary> streams;
  bool has_time = true;
  /// Whether the set has no times and no experiment states that each row is a rest.
  bool rows_may_be_a_log = false;
  std::int64_t start_ns = 0;  ///< Time of the first reading of all.
  double duration_s = 0.0;
  double static_share = 0.0;                              ///< Share of the duration spent in poses.
  std::optional<Eigen::Vector2d> temperature_range_degc;  ///< Over the whole recording.
  std::vector<RecordingJoint> joints;                     ///< In order of time.
  std::vector<TimeRange> excluded;   ///< Times of readings left out on request or as duplicates.
  PerTriad<double> time_offset_s{};  ///< Already subtracted from the triad's times.
  /// The remaining delay of a triad's readings relative to those of the reference triad, if it is
  /// 0.25 s or more.
  PerTriad<std::optional<double>> clock_lag_s;
  std::string how;    ///< "static detection", "every row", …
  Findings findings;  ///< Clipping, stuck samples, gaps and the like.

  const StreamSummary* Find(Triad triad) const {
    for (const StreamSummary& stream : streams) {
      if (stream.triad == triad) return &stream;
    }
    return nullptr;
  }
};

}  // namespace truetriad
