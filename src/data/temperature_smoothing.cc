// SPDX-License-Identifier: Apache-2.0
#include "data/temperature_smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "data/thermometer.h"
#include "truetriad/math/distributions.h"
#include "truetriad/math/random.h"

namespace truetriad {
namespace {

// MAD of normal noise to σ.
constexpr double kMadToSigma = 1.4826;
// Steps finer than this share of the range are noise like any other.
constexpr double kCoarseShare = 1.0 / 400.0;
// Noise may add this share of the typical rate.
constexpr double kRateNoiseShare = 0.01;
// Half-width, as a share of the recording, at most.
constexpr double kWidestShare = 1.0 / 20.0;
// Places where a coarse thermometer changes that are enough to follow them.
constexpr std::size_t kFewestPlaces = 8;
// Residuals beyond this many σ count for nothing.
constexpr double kTukey = 6.0;
constexpr int kRobustRounds = 2;

// What the thermometer says of the temperature at some times.
struct Readings {
  std::vector<double> time_s, degc, weight;
  void Add(double time, double value) {
    time_s.push_back(time), degc.push_back(value), weight.push_back(1.0);
  }
};

double SpanOf(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// σ of single readings from second differences, which a steady drift leaves at zero.
double NoiseOf(const std::vector<double>& degc) {
  std::vector<double> differences;
  for (std::size_t i = 2; i < degc.size(); ++i) {
    differences.push_back(std::abs(degc[i] - 2.0 * degc[i - 1] + degc[i - 2]));
  }
  return differences.empty() ? 0.0 : kMadToSigma * Median(std::move(differences)) / std::sqrt(6.0);
}

// Change a second, up and down together, over some dozens of stretches.
double TypicalRate(const std::vector<double>& time_s, const std::vector<double>& degc) {
  constexpr std::size_t kStretches = 64;
  const std::size_t every = std::max<std::size_t>(degc.size() / kStretches, 1);
  double change = 0.0;
  for (std::size_t i = every; i < degc.size(); i += every) {
    change += std::abs(degc[i] - degc[i - every]);
  }
  return change / (time_s.back() - time_s.front());
}

// Where the readings go from one step to the next, and the middles of steps that last long.
Readings PlacesOfChange(const std::vector<double>& time_s,
                        const std::vector<double>& degc,
                        double step) {
  Readings places;
  // Steps need not be at whole multiples: kelvins are not in degC.
  double base = 0.0;
  for (std::size_t i = degc.size() - 1; i > 0; --i) {
    if (degc[i] == degc[i - 1]) base = degc[i];
  }
  // A cell that holds a change has a mean between two steps.
  const auto level = [step, base](double value) { return std::round((value - base) / step); };
  std::vector<std::pair<double, double>> changes;
  for (std::size_t i = 1; i < degc.size(); ++i) {
    const double before = level(degc[i - 1]), after = level(degc[i]);
    if (before == after) continue;
    const double middle = base + 0.5 * (before + after) * step;
    const double share =
        degc[i] == degc[i - 1] ? 0.5 : (middle - degc[i - 1]) / (degc[i] - degc[i - 1]);
    changes.emplace_back(time_s[i - 1] + std::clamp(share, 0.0, 1.0) * (time_s[i] - time_s[i - 1]),
                         middle);
  }
  std::vector<double> lengths;
  for (std::size_t c = 1; c < changes.size(); ++c) {
    if (changes[c].second == changes[c - 1].second) continue;
    lengths.push_back(changes[c].first - changes[c - 1].first);
  }
  const double usual = lengths.empty() ? time_s.back() - time_s.front() : Median(lengths);
  // A step that lasts much longer than the others is one at which the temperature stays.
  constexpr double kLong = 4.0;
  const auto add_plateau = [&](double from, double to, bool is_open) {
    if (to - from < kLong * usual) return;
    const double end = is_open ? 0.0 : 2.0 * usual;
    double value = 0.0;
    std::size_t count = 0;
    const auto first = std::lower_bound(time_s.begin(), time_s.end(), from) - time_s.begin();
    const auto last = std::upper_bound(time_s.begin(), time_s.end(), to) - time_s.begin();
    for (auto i = first; i < last; ++i, ++count) value += degc[static_cast<std::size_t>(i)];
    if (count == 0) return;
    value /= static_cast<double>(count);
    const auto points = static_cast<int>(std::min(200.0, (to - from - 2.0 * end) / usual));
    for (int p = 0; p < points; ++p) {
      places.Add(from + end + (p + 0.5) * (to - from - 2.0 * end) / points, value);
    }
  };
  double previous = time_s.front();
  // Noise goes to and fro over the same place: one change, at the mean of them.
  constexpr double kSamePlace = 0.15;
  for (std::size_t c = 0; c < changes.size();) {
    double sum = 0.0;
    std::size_t next = c;
    while (next < changes.size() && changes[next].second == changes[c].second &&
           (next == c || changes[next].first - changes[next - 1].first < kSamePlace * usual)) {
      sum += changes[next++].first;
    }
    const double time = sum / static_cast<double>(next - c);
    add_plateau(previous, time, previous == time_s.front());
    if (places.time_s.empty() || time > places.time_s.back()) places.Add(time, changes[c].second);
    previous = time;
    c = next;
  }
  add_plateau(previous, time_s.back(), true);
  // Before the first change and after the last one the straight line on, as far as the reading
  // there allows.
  const auto end_point = [&](double time, double reading, std::size_t near, std::size_t far) {
    const double slope =
        (places.degc[near] - places.degc[far]) / (places.time_s[near] - places.time_s[far]);
    const double line = places.degc[near] + slope * (time - places.time_s[near]);
    const double middle = base + level(reading) * step;
    return std::clamp(line, middle - 0.5 * step, middle + 0.5 * step);
  };
  const std::size_t count = places.time_s.size();
  if (count < 2) return places;
  const double first = end_point(time_s.front(), degc.front(), 0, 1);
  const double last = end_point(time_s.back(), degc.back(), count - 1, count - 2);
  if (places.time_s.back() + 0.5 * usual < time_s.back()) places.Add(time_s.back(), last);
  if (time_s.front() + 0.5 * usual < places.time_s.front()) {
    places.time_s.insert(places.time_s.begin(), time_s.front());
    places.degc.insert(places.degc.begin(), first);
    places.weight.push_back(1.0);
  }
  return places;
}

// A natural cubic smoothing spline through places of change, minimising
//   sum (s(t_i) - y_i)^2 + lambda int s''^2                                  (Reinsch 1967)
// with the lambda of least generalised cross-validation: the times at which a thermometer goes from
// one step to the next err independently. Curved as sharply as that allows at a turning point.
class Spline {
 public:
  Spline(std::vector<double> time, const std::vector<double>& value) : time_(std::move(time)) {
    const auto n = static_cast<Eigen::Index>(time_.size());
    value_ = Eigen::Map<const Eigen::VectorXd>(value.data(), n);
    const Eigen::VectorXd y = value_;
    const Matrix Q = SecondDifferences();
    Smooth(y, SecondDifferences(), Roughness());
  }

  // Value and slope; a straight line beyond the ends.
  std::pair<double, double> At(double time) const {
    const auto after = std::upper_bound(time_.begin(), time_.end(), time);
    const auto i = std::clamp<Eigen::Index>(
        after - time_.begin() - 1, 0, static_cast<Eigen::Index>(time_.size()) - 2);
    const double begin = time_[static_cast<std::size_t>(i)];
    const double h = time_[static_cast<std::size_t>(i) + 1] - begin;
    const double inside = std::clamp(time, time_.front(), time_.back());
    const double b = (inside - begin) / h, a = 1.0 - b;
    const double value =
        a * value_[i] + b * value_[i + 1] +
        ((a * a * a - a) * curvature_[i] + (b * b * b - b) * curvature_[i + 1]) * h * h / 6.0;
    const double slope =
        (value_[i + 1] - value_[i]) / h +
        ((3.0 * b * b - 1.0) * curvature_[i + 1] - (3.0 * a * a - 1.0) * curvature_[i]) * h / 6.0;
    return {value + slope * (time - inside), slope};
  }

 private:
  using Matrix = Eigen::SparseMatrix<double>;

  void Smooth(const Eigen::VectorXd& y, const Matrix& Q, const Matrix& R) {
    const auto n = static_cast<Eigen::Index>(time_.size());
    const Matrix QQ = Q.transpose() * Q;
    // Random signs, always the same ones: their mean square gives the trace of the influence.
    constexpr int kProbes = 24;
    Random random(1);
    Eigen::MatrixXd probes(n, kProbes);
    for (double& sign : probes.reshaped()) sign = random.Normal() > 0.0 ? 1.0 : -1.0;
    const double spacing = (time_.back() - time_.front()) / static_cast<double>(n - 1);
    double least = std::numeric_limits<double>::infinity();
    for (double decade = -4.0; decade <= 4.0; decade += 0.25) {
      const double lambda = std::pow(10.0, decade) * std::pow(spacing, 3);
      const Eigen::SimplicialLDLT<Matrix> solver(R + lambda * QQ);
      const Eigen::VectorXd curvature = solver.solve(Q.transpose() * y);
      const Eigen::VectorXd left = lambda * (Q * curvature);
      const Eigen::MatrixXd left_probes = lambda * (Q * solver.solve(Q.transpose() * probes));
      const double trace = probes.cwiseProduct(left_probes).sum() / kProbes;
      const double score = left.squaredNorm() / (trace * trace);
      if (!(score < least)) continue;
      least = score;
      value_ = y - left;
      curvature_.setZero(n);
      curvature_.segment(1, n - 2) = curvature;
    }
  }

  double Gap(Eigen::Index i) const {
    return time_[static_cast<std::size_t>(i) + 1] - time_[static_cast<std::size_t>(i)];
  }
  Matrix SecondDifferences() const {
    const auto n = static_cast<Eigen::Index>(time_.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index j = 0; j + 2 < n; ++j) {
      entries.emplace_back(j, j, 1.0 / Gap(j));
      entries.emplace_back(j + 1, j, -1.0 / Gap(j) - 1.0 / Gap(j + 1));
      entries.emplace_back(j + 2, j, 1.0 / Gap(j + 1));
    }
    Matrix Q(n, n - 2);
    Q.setFromTriplets(entries.begin(), entries.end());
    return Q;
  }
  Matrix Roughness() const {
    const auto n = static_cast<Eigen::Index>(time_.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index j = 0; j + 2 < n; ++j) {
      entries.emplace_back(j, j, (Gap(j) + Gap(j + 1)) / 3.0);
      if (j + 3 < n) entries.emplace_back(j, j + 1, Gap(j + 1) / 6.0);
      if (j > 0) entries.emplace_back(j, j - 1, Gap(j) / 6.0);
    }
    Matrix R(n - 2, n - 2);
    R.setFromTriplets(entries.begin(), entries.end());
    return R;
  }

  std::vector<double> time_;
  Eigen::VectorXd value_, curvature_;
};

// Local parabola about `time`: value and slope. Reaches `half_width` to both sides, further on one
// where the other is missing, and over at least four readings. `first` moves on with time.
std::pair<double, double> FitAbout(const Readings& readings,
                                   double time,
                                   double half_width,
                                   std::size_t* first) {
  const std::vector<double>& at = readings.time_s;
  const double missing =
      std::max({0.0, half_width - (time - at.front()), half_width - (at.back() - time)});
  double reach = half_width + missing;
  while (*first < at.size() && at[*first] < time - reach) ++*first;
  std::size_t begin = std::min(*first, at.size() - 1);
  std::size_t end = begin;
  while (end < at.size() && at[end] <= time + reach) ++end;
  constexpr std::size_t kFewest = 4;
  while (end - begin < std::min(kFewest, at.size())) {
    const bool later = begin == 0 || (end < at.size() && at[end] - time <= time - at[begin - 1]);
    if (later) {
      ++end;
    } else {
      --begin;
    }
    reach = std::max(reach, 1.05 * std::max(time - at[begin], at[end - 1] - time));
  }
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t j = begin; j < end; ++j) {
    const double u = (at[j] - time) / reach;
    const double tricube = std::pow(std::max(0.0, 1.0 - std::pow(std::abs(u), 3)), 3);
    const double weight = readings.weight[j] * tricube;
    const Eigen::Vector3d row(1.0, u, u * u);
    normal += weight * row * row.transpose();
    right += weight * readings.degc[j] * row;
  }
  // A trace of a ridge: with too few readings for a parabola it is as straight as it can be.
  const double ridge = 1e-9 * normal(0, 0);
  normal.diagonal() += Eigen::Vector3d(0.0, ridge, ridge);
  const Eigen::Vector3d fit = normal.ldlt().solve(right);
  return {fit[0], fit[1] / reach};
}

}  // namespace

Result<TemperatureTrack> SmoothTemperature(const std::vector<double>& time_s,
                                           const std::vector<double>& degc,
                                           double step_degc,
                                           double hold_s) {
  TemperatureTrack track;
  track.time_s = time_s;
  const double duration = time_s.back() - time_s.front();
  const double span = SpanOf(degc);
  if (!(span > 0.0) || !(duration > 0.0)) {
    return NotEnoughError("the temperature is " + std::to_string(degc.front()) +
                          " degC all the time; a sweep needs one that goes up and down");
  }
  const double rate = std::max(TypicalRate(time_s, degc), span / duration);
  const double widest = kWidestShare * duration;
  Readings readings;
  if (step_degc > kCoarseShare * span) {
    readings = PlacesOfChange(time_s, degc, step_degc);
    if (readings.time_s.size() >= kFewestPlaces) {
      track.step_degc = step_degc;
      track.smoothing_s = std::min(widest, step_degc / rate);
      const Spline spline(readings.time_s, readings.degc);
      for (std::size_t i = 0; i < time_s.size(); ++i) {
        const auto [value, slope] = spline.At(time_s[i]);
        track.degc.push_back(std::clamp(value, degc[i] - step_degc, degc[i] + step_degc));
        track.rate_degcps.push_back(slope);
      }
      return track;
    }
    readings = Readings();
  }
  // A reading that is repeated until the next one is none but the first time.
  constexpr double kSlow = 4.0;
  double spacing = duration / static_cast<double>(time_s.size() - 1);
  TakenReadings taken{time_s, degc};
  if (hold_s > kSlow * spacing) {
    TakenReadings slow = ReadingsAsTaken(time_s, degc, hold_s);
    if (slow.time_s.size() >= kFewestPlaces) {
      taken = std::move(slow);
      spacing = hold_s;
    }
  } else if (hold_s > 0.0) {
    for (double& time : taken.time_s) time -= 0.5 * hold_s;
  }
  for (std::size_t i = 0; i < taken.degc.size(); ++i) {
    readings.Add(taken.time_s[i], taken.degc[i]);
  }
  // Rounding hangs together over the time that a step lasts.
  const double noise = NoiseOf(taken.degc);
  const double rounding = step_degc * step_degc / 12.0 * std::max(spacing, step_degc / rate);
  const double density = noise * noise * spacing + rounding;
  // Variance of a local parabola's slope: about 2.3 density / half-width^3.
  const double noise_width = std::cbrt(2.3 * density / std::pow(kRateNoiseShare * rate, 2));
  track.smoothing_s = std::clamp(noise_width, 3.0 * spacing, std::max(widest, 3.0 * spacing));
  const auto fit_all = [&](const std::vector<double>& times,
                           std::vector<double>* values,
                           std::vector<double>* rates) {
    std::size_t first = 0;
    values->clear(), rates->clear();
    for (const double time : times) {
      const auto [value, slope] = FitAbout(readings, time, track.smoothing_s, &first);
      values->push_back(value), rates->push_back(slope);
    }
  };
  std::vector<double> values, rates;
  for (int round = 0; round < kRobustRounds; ++round) {
    fit_all(readings.time_s, &values, &rates);
    std::vector<double> residuals;
    for (std::size_t i = 0; i < values.size(); ++i) {
      residuals.push_back(std::abs(readings.degc[i] - values[i]));
    }
    const double sigma = std::max(kMadToSigma * Median(residuals), 1e-6 * span);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double u = residuals[i] / (kTukey * sigma);
      readings.weight[i] = u < 1.0 ? std::pow(1.0 - u * u, 2) : 1e-6;
    }
  }
  fit_all(time_s, &track.degc, &track.rate_degcps);
  return track;
}

}  // namespace truetriad
