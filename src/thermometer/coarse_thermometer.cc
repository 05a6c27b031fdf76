// SPDX-License-Identifier: Apache-2.0
#include "thermometer/coarse_thermometer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "math/distributions.h"

namespace truetriad {
namespace {

using State = Eigen::Vector3d;  // Value and slope of the line, and the settling term: see Piece.
using Matrix = Eigen::Matrix3d;

// From `time_s` on, T = line + slope (t - time_s) + settling exp(-(t - time_s) / lag).
struct Piece {
  double time_s;
  State state;
};

// Chosen: a reading that stays for four times the median duration of a step is a plateau.
constexpr double kLong = 4.0;
// Chosen: successive changes to and fro within half of a step's median duration are one passage.
constexpr double kSamePassage = 0.5;
// Chosen: at a node the chamber's slope may change; the mean duration of a step has 8 nodes.
constexpr double kNodesInStep = 8.0;
// Chosen: the largest number of nodes; the time of a pass is proportional to it.
constexpr double kMostNodes = 4096.0;
// Chosen: the largest number of kinks; a chamber's program changes its slope less often.
constexpr int kMostKinks = 40;
// Chosen: the largest number of rounds that place all kinks again; they end when no kink moves.
constexpr int kKinkRounds = 4;
// Chosen: the chamber's slope is a random walk; this is its least variance per node, relative to
// the square of the mean rate. Over 4096 nodes the slope then changes by 64e-7 of the mean rate, so
// only kinks change the slope noticeably.
constexpr double kStiffest = 1e-14;
// Chosen: lags are tried in steps of a factor 1.6 and refined afterwards.
constexpr double kLagRatio = 1.6;
// In nodes: a lag below this settles by a factor e within two nodes, which is too fast to be seen.
constexpr double kShortestLagNodes = 2.0;
constexpr double kLongestLagShare = 0.1;  // Chosen: longest lag / duration.
// Chosen: refinement ends at steps of two per cent of a lag.
constexpr double kFinestRatio = 1.02;

double Decay(double since_s, double lag_s) {
  return lag_s > 0.0 ? std::exp(-std::max(since_s, 0.0) / lag_s) : 0.0;
}

// Noise may repeat a change when the temperature passes a place. Returns the end of the repeated
// changes that start at `begin`. If their number is odd, they lead to the next step. If it is even,
// they lead back, and only the first one counts.
std::size_t EndOfPassage(const std::vector<std::pair<double, double>>& changes,
                         std::size_t begin,
                         double usual_s) {
  std::size_t end = begin + 1;
  while (end < changes.size() && changes[end].second == changes[begin].second &&
         changes[end].first - changes[end - 1].first < kSamePassage * usual_s) {
    ++end;
  }
  return (end - begin) % 2 == 1 ? end : begin + 1;
}

// Time of a passage with changes at t0, t1, …: t0 - t1 + t2 - …. If one change at this time
// replaces them, the reading stays on either step for as long as before.
double TimeOfPassage(const std::vector<std::pair<double, double>>& changes,
                     std::size_t begin,
                     std::size_t end) {
  double sum = 0.0;
  for (std::size_t c = begin; c < end; ++c) {
    sum += (c - begin) % 2 == 0 ? changes[c].first : -changes[c].first;
  }
  return sum;
}

// Kalman filter and smoother of the temperature for one lag, s; 0: no lag.
class LaggedChamber {
 public:
  // A node, where the chamber's slope may change, or a place of the thermometer (StepPlaces).
  struct Event {
    double time_s = 0.0;
    int place = -1;
    int node = -1;
  };

  LaggedChamber(
      const StepPlaces& places, double begin_s, double end_s, double spacing_s, double lag_s)
      : places_(places), lag_s_(lag_s) {
    const std::vector<double>& value = places.degc;
    const auto [low, high] = std::minmax_element(value.begin(), value.end());
    span_ = *high - *low;
    for (std::size_t i = 1; i < value.size(); ++i) rate_ += std::abs(value[i] - value[i - 1]);
    rate_ /= places.time_s.back() - places.time_s.front();
    std::size_t place = 0;
    const auto take_places_before = [&](double time) {
      while (place < places.time_s.size() && places.time_s[place] < time) {
        events_.push_back({places.time_s[place], static_cast<int>(place), -1});
        ++place;
      }
    };
    const double node_s = NodeSpacing(places, begin_s, end_s);
    for (double time = begin_s; time <= end_s; time += node_s) {
      take_places_before(time);
      events_.push_back({time, -1, node_count_++});
    }
    take_places_before(std::numeric_limits<double>::infinity());
    double before_s = events_.front().time_s;
    for (const Event& event : events_) {
      const double length_s = event.time_s - before_s;
      steps_.push_back({length_s, Decay(length_s, lag_s)});
      before_s = event.time_s;
    }
    // The error of a change's time is uniform within one spacing, so the temperature there has an
    // error of variance rate² spacing² / 12.
    least_variance_ = std::pow(rate_ * spacing_s, 2) / 12.0;
    variance_ = std::max(least_variance_, std::pow(0.01 * span_ / value.size(), 2));
    walk_ = 1e-6 * rate_ * rate_;
    kink_ = 4.0 * rate_ * rate_;  // (2 rate_)^2: the slope changes from a rise to a fall.
    is_kink_.assign(static_cast<std::size_t>(node_count_), false);
  }

  static double NodeSpacing(const StepPlaces& places, double begin_s, double end_s) {
    const double usual = (places.time_s.back() - places.time_s.front()) /
                         static_cast<double>(places.time_s.size() - 1);
    return std::max(usual / kNodesInStep, (end_s - begin_s) / kMostNodes);
  }

  // Logarithm of the posterior of the best kinks, walk and σ, up to a constant. If `stiff`, kinks
  // are sought with the smallest walk, so that the walk does not take their place.
  double Solve(bool stiff) {
    if (stiff) {
      walk_ = kStiffest * rate_ * rate_;
      Pass();
    } else {
      Tune();
    }
    while (kinks_ < kMostKinks) {
      const std::optional<std::size_t> best = BestKink();
      if (!best) break;
      Set(*best, true);
      if (stiff) {
        Pass();
      } else {
        Tune();
      }
    }
    double likelihood = Tune();
    for (int round = 0; round < kKinkRounds && Move(); ++round) likelihood = Tune();
    return likelihood - price() * kinks_;
  }

  std::vector<Piece> Pieces() const {
    std::vector<Piece> pieces;
    for (std::size_t e = 0; e < events_.size(); ++e) {
      pieces.push_back({events_[e].time_s, states_[e]});
    }
    return pieces;
  }

 private:
  // Least gain in log likelihood by a kink: the log of the number of nodes to choose from.
  double price() const { return std::log(static_cast<double>(node_count_)); }

  void Set(std::size_t node, bool is_kink) {
    is_kink_[node] = is_kink;
    kinks_ += is_kink ? 1 : -1;
  }

  // The node at which a kink raises the likelihood of the last pass most (de Jong and Penzer 1998).
  // Unset if no kink raises it by more than its price.
  std::optional<std::size_t> BestKink() const {
    std::optional<std::size_t> best;
    double most = price();
    for (std::size_t k = 0; k < is_kink_.size(); ++k) {
      const double own = 1.0 + kink_ * information_[k];
      const double gain = 0.5 * (score_[k] * score_[k] * kink_ / own - std::log(own));
      if (is_kink_[k] || gain <= most) continue;
      most = gain;
      best = k;
    }
    return best;
  }

  // Removes each kink in turn, and places it again where it is best beside the other kinks, or
  // drops it. Then tries to add a kink. Returns whether any kink changed.
  bool Move() {
    bool has_moved = false;
    for (std::size_t k = 0; k < is_kink_.size(); ++k) {
      if (!is_kink_[k]) continue;
      Set(k, false);
      Pass();
      const std::optional<std::size_t> best = BestKink();
      if (best) Set(*best, true);
      has_moved = has_moved || best != k;
    }
    Pass();
    if (kinks_ < kMostKinks) {
      if (const std::optional<std::size_t> best = BestKink()) {
        Set(*best, true);
        has_moved = true;
      }
    }
    return has_moved;
  }

  double VarianceOf(int place) const {
    const double sigma = places_.sigma_degc[static_cast<std::size_t>(place)];
    return sigma > 0.0 ? sigma * sigma : variance_;
  }
  double JumpOf(int node) const {
    return walk_ + (is_kink_[static_cast<std::size_t>(node)] ? kink_ : 0.0);
  }

  // Finds, for the present kinks, the walk's variance to a factor of ten and the σ of the places.
  // Ends with a pass with the best values, whose results remain.
  double Tune() {
    double likelihood = Pass();
    for (const double factor : {0.1, 10.0}) {
      for (int step = 0; step < 8; ++step) {
        const double before = walk_;
        const double next = walk_ * factor;
        if (next < kStiffest * rate_ * rate_ || next > rate_ * rate_) break;
        walk_ = next;
        const double tried = Pass();
        if (tried > likelihood + 1e-3) {
          likelihood = tried;
          continue;
        }
        walk_ = before;
        break;
      }
    }
    for (int round = 0; round < 2; ++round) {
      Pass();
      variance_ = std::max(square_, least_variance_);
    }
    return Pass();
  }

  // Kalman filter forward, disturbance smoother back (Durbin and Koopman 2012, 4.4 to 4.5).
  // Returns the logarithm of the likelihood.
  double Pass() {
    const std::size_t count = events_.size();
    const State turn = Turn();
    const State shown(1.0, 0.0, 1.0);
    predicted_.resize(count), covariance_.resize(count), states_.resize(count);
    gain_.resize(count), innovation_.resize(count), innovation_variance_.resize(count);
    score_.resize(is_kink_.size()), information_.resize(is_kink_.size());
    State state(places_.degc.front(), 0.0, 0.0);
    const double slope_variance = 100.0 * rate_ * rate_;
    Matrix P = State(100.0 * span_ * span_, slope_variance, kink_ * lag_s_ * lag_s_).asDiagonal();
    double likelihood = 0.0;
    for (std::size_t e = 0; e < count; ++e) {
      const Event& event = events_[e];
      const Step& step = steps_[e];
      state[0] += step.length_s * state[1];
      state[2] *= step.decay;
      P.row(0) += step.length_s * P.row(1);
      P.col(0) += step.length_s * P.col(1);
      P.row(2) *= step.decay;
      P.col(2) *= step.decay;
      if (event.node >= 0) P += JumpOf(event.node) * turn * turn.transpose();
      predicted_[e] = state;
      covariance_[e] = P;
      if (event.place < 0) continue;
      const State spread = P * shown;
      innovation_variance_[e] = shown.dot(spread) + VarianceOf(event.place);
      innovation_[e] = places_.degc[static_cast<std::size_t>(event.place)] - shown.dot(state);
      gain_[e] = spread / innovation_variance_[e];
      state += gain_[e] * innovation_[e];
      P -= gain_[e] * spread.transpose();
      P = (0.5 * (P + P.transpose())).eval();
      likelihood -= 0.5 * (std::log(innovation_variance_[e]) +
                           innovation_[e] * innovation_[e] / innovation_variance_[e]);
    }
    State r = State::Zero();
    Matrix N = Matrix::Zero();
    double sum = 0.0, places = 0.0;
    for (std::size_t e = count; e-- > 0;) {
      const Event& event = events_[e];
      if (event.place >= 0) {
        const Matrix L = Matrix::Identity() - gain_[e] * shown.transpose();
        r = shown * (innovation_[e] / innovation_variance_[e]) + L.transpose() * r;
        N = shown * shown.transpose() / innovation_variance_[e] + L.transpose() * N * L;
      } else {
        const auto node = static_cast<std::size_t>(event.node);
        score_[node] = turn.dot(r);
        information_[node] = std::max(turn.dot(N * turn), 0.0);
      }
      states_[e] = predicted_[e] + covariance_[e] * r;
      if (event.place >= 0 && places_.sigma_degc[static_cast<std::size_t>(event.place)] == 0.0) {
        const State spread = covariance_[e] * shown;
        const double left =
            places_.degc[static_cast<std::size_t>(event.place)] - shown.dot(states_[e]);
        sum += left * left + std::max(shown.dot(spread) - spread.dot(N * spread), 0.0);
        places += 1.0;
      }
      const Step& step = steps_[e];
      r[1] += step.length_s * r[0];
      r[2] *= step.decay;
      N.row(1) += step.length_s * N.row(0);
      N.col(1) += step.length_s * N.col(0);
      N.row(2) *= step.decay;
      N.col(2) *= step.decay;
    }
    square_ = sum / std::max(places, 1.0);
    return likelihood;
  }

  // Derivative of the state at a kink with respect to the chamber's slope. T and T' do not change.
  State Turn() const { return {-lag_s_, 1.0, lag_s_}; }

  const StepPlaces& places_;
  double lag_s_;
  double span_ = 0.0, rate_ = 0.0;
  std::vector<Event> events_;
  // The interval between two events; steps_[e] ends at events_[e].
  struct Step {
    double length_s, decay;
  };
  std::vector<Step> steps_;
  int node_count_ = 0;
  int kinks_ = 0;
  std::vector<bool> is_kink_;
  // Variances, in this order: of the temperature at a place; the least value of this variance; of a
  // step of the random walk; what a kink adds to the variance of its step.
  double variance_ = 0.0, least_variance_ = 0.0, walk_ = 0.0, kink_ = 0.0;
  // Results of the last pass.
  std::vector<State> predicted_, states_, gain_;
  std::vector<Matrix> covariance_;
  std::vector<double> innovation_, innovation_variance_, score_, information_;
  double square_ = 0.0;
};

// The lag and the pieces with the largest posterior.
struct Chamber {
  double lag_s = 0.0;
  std::vector<Piece> pieces;
};

Chamber LikeliestChamber(const StepPlaces& places, double begin_s, double end_s, double spacing_s) {
  Chamber best;
  double most = -std::numeric_limits<double>::infinity();
  const auto try_lag = [&](double lag_s, double price) {
    for (const bool stiff : {true, false}) {
      if (!stiff && lag_s > 0.0) break;
      LaggedChamber chamber(places, begin_s, end_s, spacing_s, lag_s);
      const double posterior = chamber.Solve(stiff) - price;
      if (!(posterior > most)) continue;
      most = posterior;
      best = {lag_s, chamber.Pieces()};
    }
  };
  const double node_s = LaggedChamber::NodeSpacing(places, begin_s, end_s);
  const double shortest = kShortestLagNodes * node_s;
  const double longest = kLongestLagShare * (end_s - begin_s);
  // A lag has the price of a kink: the log of the number of nodes.
  const double price = std::log((end_s - begin_s) / node_s);
  try_lag(0.0, 0.0);
  for (double lag_s = shortest; lag_s < longest; lag_s *= kLagRatio) try_lag(lag_s, price);
  if (!(best.lag_s > 0.0)) return best;
  for (double ratio = std::sqrt(kLagRatio); ratio > kFinestRatio; ratio = std::sqrt(ratio)) {
    const double middle_s = best.lag_s;
    for (const double factor : {1.0 / ratio, ratio}) try_lag(middle_s * factor, price);
  }
  return best;
}

}  // namespace

StepPlaces PlacesOfChange(const std::vector<double>& time_s,
                          const std::vector<double>& degc,
                          double step) {
  StepPlaces places;
  // In degC, readings need not be multiples of the step: a thermometer may read whole kelvins.
  double base = 0.0;
  for (std::size_t i = degc.size() - 1; i > 0; --i) {
    if (degc[i] == degc[i - 1]) base = degc[i];
  }
  // A cell with a change has a mean between two steps; the nearer step counts.
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
  const double in_step = step / std::sqrt(12.0);
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
      // All points share one reading's error, so the σ of each is that of the reading times
      // √number.
      places.Add(from + end + (p + 0.5) * (to - from - 2.0 * end) / points,
                 value,
                 in_step * std::sqrt(static_cast<double>(points)));
    }
  };
  double previous = time_s.front();
  for (std::size_t c = 0; c < changes.size();) {
    const std::size_t next = EndOfPassage(changes, c, usual);
    const double time = TimeOfPassage(changes, c, next);
    add_plateau(previous, time, previous == time_s.front());
    if (places.time_s.empty() || time > places.time_s.back()) {
      places.Add(time, changes[c].second, 0.0);
    }
    previous = time;
    c = next;
  }
  add_plateau(previous, time_s.back(), true);
  // Before the first change and after the last one, the line through the two nearest places is
  // continued, but kept within half a step of the reading there.
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
  if (places.time_s.back() + 0.5 * usual < time_s.back()) places.Add(time_s.back(), last, in_step);
  if (time_s.front() + 0.5 * usual < places.time_s.front()) {
    places.time_s.insert(places.time_s.begin(), time_s.front());
    places.degc.insert(places.degc.begin(), first);
    places.sigma_degc.insert(places.sigma_degc.begin(), in_step);
  }
  return places;
}

TemperatureTrack ThroughPlaces(const StepPlaces& places, const std::vector<double>& time_s) {
  const double begin_s = time_s.front(), end_s = time_s.back();
  const double spacing_s = (end_s - begin_s) / static_cast<double>(time_s.size() - 1);
  const auto [lag_s, pieces] = LikeliestChamber(places, begin_s, end_s, spacing_s);
  TemperatureTrack track;
  track.time_s = time_s;
  std::size_t at = 0;
  for (const double time : time_s) {
    while (at + 1 < pieces.size() && pieces[at + 1].time_s <= time) ++at;
    const auto& [piece_s, state] = pieces[at];
    const double since = time - piece_s;
    double value = state[0] + state[1] * since, rate = state[1];
    if (lag_s > 0.0) {
      const double settling = state[2] * Decay(since, lag_s);
      value += settling;
      rate -= settling / lag_s;
    }
    track.degc.push_back(value);
    track.rate_degcps.push_back(rate);
  }
  return track;
}

}  // namespace truetriad
