// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "math/fast_random.h"
#include "sim/chamber.h"
#include "sim/sensor.h"
#include "sim/surroundings.h"
#include "sim/timeline.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/io/recording.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// Generates the rows of one file for the triads that share it: a row for each sample of the
/// fastest triad; every n-th row also holds a sample of a slower one.
class SampleClock {
 public:
  /// `timeline` must outlive this. `triads`: at least one, in the order of kTriads, all with the
  /// same jitter and offset.
  SampleClock(const Scenario& scenario,
              int unit,
              const SimulatedUnit& truth,
              const Timeline& timeline,
              const RecordingFormat& format,
              const std::vector<Triad>& triads);

  bool at_end() const { return next_ns_ >= end_ns_; }
  /// True time of the next row.
  double time_s() const { return static_cast<double>(next_ns_) * 1e-9; }

  /// Appends a block for each triad that has samples in the rows that come next. The blocks are
  /// valid until the next call.
  void Generate(std::vector<SampleBlock>* blocks);

  /// Unset if the triad is not in this file.
  std::optional<StreamCounts> counts(Triad triad) const;

  /// The rest rows found so far, as in Simulation::rest_rows().
  const std::vector<PoseRange>& rest_rows() const { return rest_rows_; }
  /// The turns and rates found so far, as in Simulation::turns() and rates().
  std::vector<StatedTurn> turns() const { return turns_.Stated(); }
  std::vector<StatedRate> rates() const { return rates_.Stated(); }
  /// Simulation::mean_wander() of the samples so far; unset if the triad is not in this file.
  std::optional<Eigen::Vector3d> mean_wander(Triad triad) const;

 private:
  /// Mean of the means over successive stretches of samples.
  class MeanOfMeans {
   public:
    void Add(std::size_t stretch, const Eigen::Vector3d& value) {
      if (stretch != stretch_)
        *this = MeanOfMeans(Mean(), stretches_ + (count_ > 0.0 ? 1 : 0), stretch);
      sum_ += value;
      ++count_;
    }
    Eigen::Vector3d Mean() const {
      if (count_ == 0) return before_;
      return before_ + (sum_ / count_ - before_) / (stretches_ + 1);
    }
    MeanOfMeans() = default;

   private:
    MeanOfMeans(Eigen::Vector3d before, int stretches, std::size_t stretch)
        : before_(std::move(before)), stretches_(stretches), stretch_(stretch) {}

    Eigen::Vector3d before_ = Eigen::Vector3d::Zero();
    int stretches_ = 0;  ///< Number of stretches before the current one.
    std::size_t stretch_ = 0;
    Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
    double count_ = 0.0;
  };

  struct Channel {
    SimulatedSensor sensor;
    Triad triad;
    GyroscopeOutput gyroscope_output;
    std::int64_t rows_per_sample;
    double dropout;
    FastRandom dropout_random;
    std::vector<TimeSpan> stuck = {};
    /// The state at the previous sample, which a mean rate and a stuck triad need.
    Eigen::Quaterniond last_world_from_body;
    std::int64_t last_ns;
    std::optional<Eigen::Vector3d> last_reading = {};
    std::int64_t samples = 0;
    MeanOfMeans wander = {};

    std::vector<std::int64_t> time_ns = {};
    std::vector<double> x = {}, y = {}, z = {}, temperature_degc = {}, ambient_degc = {};
    std::vector<std::int64_t> row = {};
  };

  /// Finds the rows in which each motion (a turn or a rate) lies. The motions follow each other in
  /// time.
  template <typename Motion>
  struct MotionRows {
    std::vector<TimelineMotion<Motion>> motions;
    std::size_t current = 0;

    void Note(double time_s, std::int64_t row) {
      while (current < motions.size() && time_s > motions[current].end_s) ++current;
      if (current == motions.size() || time_s < motions[current].start_s) return;
      RowSpan& rows = motions[current].stated.at.rows;
      if (rows.empty()) rows.first = row;
      rows.last = row;
    }
    std::vector<Motion> Stated() const {
      std::vector<Motion> stated;
      for (const TimelineMotion<Motion>& motion : motions) {
        if (!motion.stated.at.rows.empty()) stated.push_back(motion.stated);
      }
      return stated;
    }
  };

  std::int64_t RowTime(std::int64_t index) const;
  TemperatureState PlayedTemperature(double time_s);
  double ReadThermometer(double time_s);
  double ReadAmbient(double time_s);
  /// What a thermometer reports at the temperature `degc`.
  double Shown(double degc, double noise_degc, double resolution_degc, FastRandom* random) const;
  Eigen::Vector3d Truth(Channel* channel) const;
  /// Takes a sample. Returns false if the sample is dropped, so that the row lacks it.
  bool Sample(Channel* channel, const TemperatureState& temperature);
  /// If the row that is being written is in a rest, adds the row to that rest.
  void NoteRest(double time_s);
  void NoteWander();

  double rate_hz_;
  std::int64_t end_ns_;
  std::int64_t offset_ns_;
  double jitter_ns_;
  FastRandom jitter_random_;
  const SimulatedTemperature temperature_;
  int temperature_decimals_;
  FastRandom thermometer_random_;
  FastRandom ambient_random_;
  ElementTemperature element_;
  LaggedTemperature thermometer_, ambient_;
  double played_degc_;
  bool is_thermal_;
  Surroundings surroundings_;
  std::vector<Channel> channels_;

  std::int64_t index_ = 0;    ///< Index of the next row that is due.
  std::int64_t next_ns_ = 0;  ///< True time of that row.
  std::int64_t now_ns_ = 0;
  std::int64_t rows_ = 0;  ///< Number of rows written: each has at least one sample.
  std::int64_t last_reported_ns_;

  const std::vector<TrueRest>& rests_;
  double longest_interval_s_;
  std::size_t rest_ = 0;  ///< Index of the rest that the next row is in or, between rests, of the
                          ///< next rest.
  bool rest_began_ = false;
  std::vector<PoseRange> rest_rows_;
  bool tumbles_;
  MotionRows<StatedTurn> turns_;
  MotionRows<StatedRate> rates_;
};

}  // namespace truetriad
