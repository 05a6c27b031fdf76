// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// What a thermometer of coarse steps says for certain: where it goes from one step to the next the
/// temperature is half way between. Inside of a step that lasts long it is somewhere in it, which
/// `sigma_degc` says; 0: a place of change.
struct StepPlaces {
  std::vector<double> time_s, degc, sigma_degc;
  void Add(double time, double value, double sigma) {
    time_s.push_back(time), degc.push_back(value), sigma_degc.push_back(sigma);
  }
};

/// `time_s` increases; `degc`: readings, or means of some of them, in multiples of `step_degc` from
/// any base. Noise that goes to and fro over the same place is one change.
StepPlaces PlacesOfChange(const std::vector<double>& time_s,
                          const std::vector<double>& degc,
                          double step_degc);

/// The temperature through such places. A board follows its chamber with a lag, and a chamber goes
/// straight from one setting to the next, or nearly:
///
///   lag T' = C - T,    C' = a walk of small steps + a few large ones (kinks)
///
/// or behind two lags, as of the air in the chamber and the board in the air.
/// Between places only this says how the temperature turns. Lag, kinks, the size of the small steps
/// and σ of the places are those of the largest posterior: Kalman filter, disturbance smoother, and
/// kinks added as long as they raise it (de Jong and Penzer 1998). Lag 0 without kinks is a cubic
/// smoothing spline.
class StepTrack {
 public:
  /// At least four places, of which two differ; `spacing_s`: of the readings.
  StepTrack(StepPlaces places, double begin_s, double end_s, double spacing_s);

  /// Temperature and rate at `time_s`, which increases.
  void At(const std::vector<double>& time_s,
          std::vector<double>* degc,
          std::vector<double>* rate_degcps) const;

  using Lags = std::array<double, 2>;  ///< s; 0: none. The second is shorter.
  double sigma_degc() const { return sigma_degc_; }
  int kinks() const { return kinks_; }

 private:
  /// From `time_s` on T = line + slope (t - time) + sum_i settling_i exp(-(t - time) / lag_i).
  struct Piece {
    double time_s;
    Eigen::Vector4d state;  ///< Line, slope, settling.
  };
  std::vector<Piece> pieces_;
  Lags lags_s_{};
  double sigma_degc_ = 0.0;
  int kinks_ = 0;
};

}  // namespace truetriad
