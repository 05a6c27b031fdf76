// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truetriad/base/result.h"
#include "truetriad/data/known_motion.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/io/recording_writer.h"
#include "truetriad/model/calibration.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// One triad of one unit as it really is.
struct TrueTriad {
  TriadModel<double> model;
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<ThermalTerms> thermal;
};

/// One unit drawn from the population of a scenario.
struct SimulatedUnit {
  std::string serial;
  PerTriad<std::optional<TrueTriad>> triads;
};

/// Unit `index` (0-based, below `count`) of a valid scenario. Depends on the seed and the index
/// alone: units can be drawn in any order.
SimulatedUnit DrawUnit(const Scenario& scenario, int index);

/// The scenario of one session (0-based) of unit `index`: that unit alone, with the bias that it
/// has after it was switched on, and random numbers of the session's own. The first session of unit
/// 0 differs from a scenario without sessions in its bias alone.
Scenario SessionOf(const Scenario& scenario, int index, int session);

/// The truth of unit `index` in the schema of a calibration, to be compared with what is estimated
/// from its recording: outcome kConverged, every sigma zero; the covariance lists all of the unit's
/// parameters, temperature terms and g-sensitivity too. Gauge `accel-x` if the leading triad's
/// matrix has that form, else `fixture`: the body frame is that of the scenario's attitudes. The
/// reference temperature is that of the thermal terms if there are any, else the scenario's start.
Calibration TruthOf(const Scenario& scenario, int index);

class Simulation;
/// As TruthOf above, but with the biases averaged over a recording that has been read to its end.
Calibration TruthOf(const Scenario& scenario, int index, const Simulation& simulation);

/// One rest of the recording, as it really is.
struct TrueRest {
  int number = 0;        ///< 1-based.
  double start_s = 0.0;  ///< True time.
  double end_s = 0.0;
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< At its end.
  /// The attitude that the program asked for, without the error with which the pose was taken.
  Eigen::Quaterniond intended_world_from_body = Eigen::Quaterniond::Identity();
  double element_degc = 25.0;  ///< Temperature of the sensing elements, mean of start and end.
  std::string label;           ///< Label of the pose, or empty.
};

/// The recording of one unit, generated while it is read, in bounded memory. The readings equal
/// those in the file that WriteRecording writes, to the bit.
class Simulation : public SampleSource {
 public:
  /// Error (bad input): the scenario is not valid.
  static Result<std::unique_ptr<Simulation>> Create(const Scenario& scenario, int index);

  /// Every rest between moves that is longer than zero.
  virtual const std::vector<TrueRest>& rests() const = 0;

  /// The rows of each rest, as `poses.yaml` states them: in the accelerometer's file; without one,
  /// in the magnetometer's, else in the gyroscope's. The first sampling interval is left out, since
  /// a gyroscope averages part of the move over it. Complete once everything has been read. Rests
  /// shorter than a sampling interval are missing.
  virtual std::vector<PoseRange> rest_rows() const = 0;

  /// What the operator of a table would state of the scenario's `turn` and `turntable` steps, with
  /// rows as for rests. A turn includes a reading at rest before and after it; a rate covers its
  /// hold. Complete once everything has been read.
  virtual std::vector<StatedTurn> turns() const = 0;
  virtual std::vector<StatedRate> rates() const = 0;

  /// What bias instability and random walk added to a triad's bias, raw: the mean over the rests,
  /// each counting once; if the unit tumbles, over the recording. Complete once everything has been
  /// read.
  virtual Eigen::Vector3d mean_wander(Triad triad) const = 0;

  /// Attitude at a true time, held at the ends.
  virtual Eigen::Quaterniond WorldFromBody(double time_s) const = 0;

  /// Length of the recording.
  virtual double duration_s() const = 0;

  /// How WriteRecording is to write the recording.
  virtual const RecordingFormat& format() const = 0;
};

}  // namespace truetriad
