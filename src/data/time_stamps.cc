// SPDX-License-Identifier: Apache-2.0
#include "data/time_stamps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "data/repeats.h"
#include "math/distributions.h"

namespace truetriad {
namespace {

// Chosen: fewer stamps do not determine their kind.
constexpr std::size_t kFewestStamps = 64;
// Chosen: if 70 % of all steps differ from the usual step by 55 % or less, the interval is the mean
// of these steps; a lost sample makes a step 100 % longer.
constexpr double kNearUsual = 0.55, kShareOfUsual = 0.7;
// Chosen: otherwise the interval is the median slope over a number of steps. This is the smallest
// number with which slopes agree to 1 %, kBurstSamples at most. Most stretches this short have no
// lost sample.
constexpr double kSlopeScatter = 0.01;
// A sample waited in a buffer if the next one follows within half a period; the last sample of a
// burst came directly from the sensor.
constexpr double kSoon = 0.5;
// Chosen: stamps are in bursts if a quarter of the samples follow the one before within kTogether.
constexpr double kWaitingShare = 0.25;
// Chosen: in a burst the next sample follows within a quarter of a period.
constexpr double kTogether = 0.25;
// Each sample's offset, in periods, is lowered to the least later offset, to which this is added
// for each sample in between. So neither an error of the interval by 1/500 nor a burst of 200 (0.4
// of a period) looks like lost samples.
constexpr double kLeak = 0.002;
// Chosen: the mean interval over 256 samples hardly depends on bursts. It is taken over at most an
// eighth of all samples, so that few of these intervals contain a given gap.
constexpr std::size_t kBurstSamples = 256;
// Chosen: an offset above a running level shows lost samples. The level follows the drift of the
// clocks: after each sample it moves by 1/64 of the sample's distance from it.
constexpr double kLevelGain = 1.0 / 64.0;
// No gap is before a sample that is late by less than 6 σ; normal errors exceed 6 σ once in 10^9.
constexpr double kFarthestLate = 6.0;
// Chosen: the last eight samples are not judged, as only later ones show whether they are late.
constexpr std::size_t kTail = 8;
// The least half-width, in samples, of the straight lines that follow the drift of the clocks.
// Jitter is reduced to 1/25, and a step of the rate by 500 ppm leaves an error of 0.4 ms at 100 Hz.
constexpr std::size_t kHalfWidth = 512;
// Chosen: the half-width covers at least 16 bursts.
constexpr std::size_t kFewestBursts = 16;
// The half-width is doubled while the squared residuals grow by no more than jitter explains, plus
// 3 σ. Wider lines are better, since the error of a line is common to all turns in its range.
constexpr double kWiderSigmas = 3.0;
// With jitter the RMS about short and long lines is the same; if errors add up, as when each sample
// waits for the one before, the RMS grows with the root of the length, here by √(128/16) = 2.8.
constexpr std::size_t kShortPoints = 16, kLongPoints = 128;
// Errors add up if the RMS grows by more than this: near 1.7, the geometric mean of 1 and 2.8.
constexpr double kMostGrowth = 1.6;
// Chosen: number of samples that are enough to find a clock's ticks.
constexpr std::size_t kTickSamples = 4096;
// Chosen: stamps are on ticks if 95 % of the steps are within a tenth of whole numbers of ticks.
constexpr double kNearTick = 0.1, kShareOnTicks = 0.95;
// Jitter of stamps on ticks must be near that of rounding, 1 / √12 = 0.29 of a tick.
constexpr double kLeastOfTick = 0.15, kMostOfTick = 0.35;
// Chosen: ticks shorter than 5 % of the interval do not matter.
constexpr double kLeastTick = 0.05;
// Chosen: offsets from a line are clipped at 3 σ by their MAD, so that outliers do not pull it.
constexpr double kFarOff = 3.0;

// Chosen: a watched line needs eight stamps, which leave six degrees of freedom.
constexpr std::size_t kFewestOfLine = 8;
// Chosen: if more than 3 % of samples are missing, the clock may have jumped instead.
constexpr double kOftenLost = 0.03;
// Chosen: up to 1 % of stamps may be outliers of an even stream.
constexpr double kHiccups = 0.01;

double Slope(const Stamps& stamps, std::size_t from, std::size_t to) {
  return static_cast<double>(stamps[to] - stamps[from]) /
         static_cast<double>(stamps.Number(to) - stamps.Number(from));
}

// Whether a sample came from the sensor without waiting in a buffer for the next one.
bool IsOnTime(const Stamps& stamps, double period, std::size_t k) {
  if (stamps.are_windows()) return stamps.EndsWindow(k);
  return k + 1 == stamps.size() || static_cast<double>(stamps[k + 1] - stamps[k]) >= kSoon * period;
}

std::vector<std::size_t> OnTime(const Stamps& stamps, double period) {
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    if (IsOnTime(stamps, period, k)) places.push_back(k);
  }
  return places;
}

// The mean of the steps near the usual step; unset if few steps are near it. Unless jitter hides
// the interval, this is the interval, however many samples are lost.
std::optional<double> PeriodOfSteps(const Stamps& stamps, double usual) {
  double near = 0.0, sum = 0.0;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const double step = Slope(stamps, k - 1, k);
    if (std::abs(step - usual) > kNearUsual * usual) continue;
    ++near, sum += step;
  }
  if (near < kShareOfUsual * static_cast<double>(stamps.size())) return std::nullopt;
  return sum / near;
}

// The median slope over a number of samples that did not wait. The number is the smallest one, from
// `fewest` on, with which slopes agree.
double PeriodOfStretches(const Stamps& stamps, double usual, std::size_t fewest) {
  const std::vector<std::size_t> places = OnTime(stamps, usual);
  const double run = static_cast<double>(stamps.size()) / static_cast<double>(places.size());
  const auto widest = static_cast<std::size_t>(static_cast<double>(kBurstSamples) / run);
  double median = usual;
  for (std::size_t apart = fewest; apart <= widest && 4 * apart <= places.size(); apart *= 2) {
    std::vector<double> slopes;
    for (std::size_t i = apart; i < places.size(); ++i) {
      slopes.push_back(Slope(stamps, places[i - apart], places[i]));
    }
    median = Median(slopes);
    const auto near = std::count_if(slopes.begin(), slopes.end(), [median](double slope) {
      return std::abs(slope - median) < kSlopeScatter * median;
    });
    if (static_cast<double>(near) > kShareOfUsual * static_cast<double>(slopes.size())) break;
  }
  return median;
}

// Consecutive samples that are numbered together, as no long gap is between them.
struct Piece {
  std::size_t begin = 0, end = 0;
};

struct Numbers {
  std::vector<double> number;  // Number of each sample in its piece, lost ones included.
  std::vector<Piece> pieces;
  double steps = 0.0;  // Number of places with lost samples.
};

// stamp − period × number, in periods. Offsets of single early stamps are replaced by the lesser
// offset beside them, if at most kHiccups of all stamps are early.
std::vector<double> OffsOf(const Stamps& stamps, double period) {
  std::vector<double> offs;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    offs.push_back(static_cast<double>(stamps[i] - stamps[0]) / period -
                   static_cast<double>(stamps.Number(i) - stamps.Number(0)));
  }
  std::vector<std::size_t> early;
  for (std::size_t i = 1; i + 1 < offs.size(); ++i) {
    if (std::min(offs[i - 1], offs[i + 1]) - offs[i] > 0.5) early.push_back(i);
  }
  if (static_cast<double>(early.size()) > kHiccups * static_cast<double>(offs.size())) return offs;
  for (const std::size_t i : early) offs[i] = std::min(offs[i - 1], offs[i + 1]);
  return offs;
}

// σ of the lateness of samples that did not wait, in periods.
double ScatterOf(const Stamps& stamps, double period) {
  const std::vector<std::size_t> places = OnTime(stamps, period);
  std::vector<double> changes;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const auto numbers =
        static_cast<double>(stamps.Number(places[i]) - stamps.Number(places[i - 1]));
    changes.push_back(static_cast<double>(stamps[places[i]] - stamps[places[i - 1]]) / period -
                      numbers);
  }
  return MadSigma(std::move(changes)) / std::numbers::sqrt2;
}

// Numbers the samples; lost ones count. A lost sample shows as a lasting step by one period in
// stamp − period × number. The minimum of the later offsets distinguishes this step from a late
// sample. If `none_lost`, a step is a gap or a late sample.
Numbers Count(const Stamps& stamps, double period, double tick, bool none_lost) {
  const std::size_t count = stamps.size();
  std::vector<double> least = OffsOf(stamps, period);
  for (std::size_t i = count - 1; i-- > 0;) least[i] = std::min(least[i], least[i + 1] + kLeak);
  const double unit = static_cast<double>(stamps.window);
  const bool may_be_late = none_lost || stamps.are_windows();
  const double scatter = may_be_late ? kFarthestLate * ScatterOf(stamps, period) : 0.0;
  const double least_step = std::max(0.5, tick / period + 0.5) + scatter;
  // If more samples are lost at once, their number is uncertain, and a new piece begins.
  const double most_lost = kGapSpacings + scatter;
  Numbers counted;
  counted.number.resize(count);
  counted.pieces.push_back({0, count});
  double lost = 0.0, level = least[0], first = static_cast<double>(stamps.Number(0));
  for (std::size_t i = 0; i < count; ++i) {
    const double off = least[i] - lost - level;
    const bool is_known = i + kTail < count;
    double step = is_known && off > least_step ? unit * std::round(off / unit) : 0.0;
    const bool is_whole = !stamps.are_windows() ? step <= most_lost
                          : step > 0.0          ? std::abs(off - step) <= least_step
                                                : off <= most_lost;
    if (is_known && (!is_whole || off < -least_step - 1.0)) {
      counted.pieces.back().end = i;
      counted.pieces.push_back({i, count});
      lost = 0.0, level = least[i], first = static_cast<double>(stamps.Number(i)), step = 0.0;
    }
    if (none_lost) step = 0.0;
    counted.steps += step > 0.0 ? 1.0 : 0.0;
    lost += step;
    level += kLevelGain * (least[i] - lost - level);
    counted.number[i] = static_cast<double>(stamps.Number(i)) - first + lost;
  }
  return counted;
}

struct Point {
  double number = 0.0, off_ns = 0.0;  // stamp − period × number.
};

// Value at `number` of the weighted line through the points within `half_width` of it.
double LineAt(std::span<const Point> points, double number, double half_width) {
  const auto before = [](const Point& point, double value) { return point.number < value; };
  auto from = std::lower_bound(points.begin(), points.end(), number - half_width, before);
  auto to = std::lower_bound(from, points.end(), number + half_width, before);
  double s = 0.0, sx = 0.0, sxx = 0.0, sy = 0.0, sxy = 0.0;
  for (auto point = from; point != to; ++point) {
    const double x = (point->number - number) / half_width;
    const double weight = (1.0 - x * x) * (1.0 - x * x);
    s += weight, sx += weight * x, sxx += weight * x * x;
    sy += weight * point->off_ns, sxy += weight * x * point->off_ns;
  }
  const double determinant = s * sxx - sx * sx;
  if (determinant > 1e-9 * s * s) return (sxx * sy - sx * sxy) / determinant;
  return s > 0.0 ? sy / s : points[0].off_ns;
}

// The slow part of the points: local lines at knots, interpolated linearly between the knots.
std::vector<Point> SlowPart(std::span<const Point> points, double half_width) {
  const double last = points.back().number;
  const auto knots = static_cast<std::size_t>(std::ceil(last / (half_width / 4.0))) + 1;
  std::vector<Point> slow(std::max<std::size_t>(knots, 2));
  const double spacing = last > 0.0 ? last / static_cast<double>(slow.size() - 1) : 1.0;
  for (std::size_t i = 0; i < slow.size(); ++i) {
    slow[i].number = spacing * static_cast<double>(i);
    slow[i].off_ns = LineAt(points, slow[i].number, half_width);
  }
  return slow;
}

double ValueAt(std::span<const Point> slow, double number) {
  const double spacing = slow[1].number - slow[0].number;
  const auto left = static_cast<std::size_t>(
      std::clamp(std::floor(number / spacing), 0.0, static_cast<double>(slow.size() - 2)));
  return std::lerp(
      slow[left].off_ns, slow[left + 1].off_ns, number / spacing - static_cast<double>(left));
}

// Clips the distances of the points from the slow part.
void Clip(std::span<const Point> slow, double least_ns, std::vector<Point>* points) {
  std::vector<double> distances;
  for (const Point& point : *points) {
    distances.push_back(point.off_ns - ValueAt(slow, point.number));
  }
  const double most = std::max(kFarOff * MadSigma(std::move(distances)), least_ns);
  for (Point& point : *points) {
    const double value = ValueAt(slow, point.number);
    point.off_ns = std::clamp(point.off_ns, value - most, value + most);
  }
}

double SquaresAbout(std::span<const Point> slow, std::span<const Point> points) {
  double squares = 0.0;
  for (const Point& point : points) {
    squares += std::pow(point.off_ns - ValueAt(slow, point.number), 2);
  }
  return squares;
}

// The widest lines about which the points scatter by jitter only, and their residuals.
struct Lines {
  double half_width = 0.0;
  double points = 0.0, squares = 0.0;
  double freedom_taken = 0.0;
};

// One fit of even times, for one period.
class EvenFit {
 public:
  EvenFit(const Stamps& stamps, double period, bool none_lost)
      : stamps_(stamps), period_(period), none_lost_(none_lost) {}

  EvenTimes Run();
  // BIC: n ln(mean square) + k ln(n), for n points and k fitted parameters.
  double Bic() const;

 private:
  std::vector<Point> PointsOf(const Piece& piece) const;
  void FindTick();
  bool Waits() const;
  double LeastHalfWidth() const;
  Lines WidestLines(std::span<const std::vector<Point>> points) const;
  void Fit(EvenTimes* even);
  void FitPieces(EvenTimes* even);
  bool ErrorsAddUp() const;
  double Jitter(const EvenTimes& even, double left_out) const;
  StampKind KindOf(const EvenTimes& even) const;

  Stamps stamps_;
  double period_ = 0.0;
  bool none_lost_ = false;
  double tick_ = 0.0;       // Tick of the stamps' clock, ns; 0: none.
  bool in_bursts_ = false;  // Whether only samples that did not wait are used.
  double run_ = 1.0;        // Number of samples per sample that did not wait.
  Numbers counted_;
  Lines lines_;
};

bool EvenFit::Waits() const {
  std::size_t together = 0;
  for (std::size_t k = 1; k < stamps_.size(); ++k) {
    together += static_cast<double>(stamps_[k] - stamps_[k - 1]) < kTogether * period_ ? 1 : 0;
  }
  return static_cast<double>(together) > kWaitingShare * static_cast<double>(stamps_.size());
}

void EvenFit::FindTick() {
  std::vector<double> steps;
  for (std::size_t k = 1; k < std::min(stamps_.size(), kTickSamples); ++k) {
    if (stamps_[k] > stamps_[k - 1]) steps.push_back(Slope(stamps_, k - 1, k));
  }
  if (steps.size() < kFewestBursts) return;
  // The smallest step, or difference of two steps if that is less; the outer 1 % are left out.
  std::sort(steps.begin(), steps.end());
  const std::size_t few = steps.size() / 100;
  double tick = steps[few];
  for (std::size_t i = few + 1; i + few < steps.size(); ++i) {
    const double difference = steps[i] - steps[i - 1];
    if (difference > kLeastTick * period_) tick = std::min(tick, difference);
  }
  const auto on_ticks = std::count_if(steps.begin(), steps.end(), [tick](double step) {
    return std::abs(step / tick - std::round(step / tick)) < kNearTick;
  });
  if (static_cast<double>(on_ticks) < kShareOnTicks * static_cast<double>(steps.size())) return;
  tick_ = tick;
}

std::vector<Point> EvenFit::PointsOf(const Piece& piece) const {
  std::vector<Point> points;
  for (std::size_t k = piece.begin; k < piece.end; ++k) {
    const bool is_only = k + 1 == piece.end && points.empty();
    if (in_bursts_ && !is_only && !IsOnTime(stamps_, period_, k)) continue;
    points.push_back(
        {counted_.number[k],
         static_cast<double>(stamps_[k] - stamps_[piece.begin]) - period_ * counted_.number[k]});
  }
  return points;
}

double EvenFit::LeastHalfWidth() const {
  return std::max(static_cast<double>(kHalfWidth), static_cast<double>(kFewestBursts) * run_);
}

// `points[i]` are those of piece i.
Lines EvenFit::WidestLines(std::span<const std::vector<Point>> points) const {
  // A local fit with weights w = (1 − x²)² on [−1, 1] takes tr(2S − SSᵀ) of the squares' degrees of
  // freedom: 2 w(0) / ∫w − ∫w² / (∫w)² for each half-width, and two at its ends.
  constexpr double kFreedomTaken = 1.161;
  double count = 0.0, longest = 0.0;
  for (const std::vector<Point>& piece : points) {
    count += static_cast<double>(piece.size());
    longest = std::max(longest, piece.back().number);
  }
  const auto squares_at = [&](double half_width) {
    double squares = 0.0;
    for (const std::vector<Point>& piece : points) {
      squares += SquaresAbout(SlowPart(piece, half_width), piece);
    }
    return squares;
  };
  const auto freedom_taken = [&](double half_width) {
    double taken = 0.0;
    for (const std::vector<Point>& piece : points) {
      const double most = static_cast<double>(piece.size());
      taken += std::min(most, 2.0 + kFreedomTaken * piece.back().number / half_width);
    }
    return taken;
  };
  double half_width = LeastHalfWidth();
  double squares = squares_at(half_width);
  // Above twice the longest piece, wider lines do not differ: each piece then has one line.
  while (half_width < 2.0 * longest) {
    const double taken = freedom_taken(half_width);
    const double variance = squares / std::max(1.0, count - taken);
    const double wider_squares = squares_at(2.0 * half_width);
    const double freed = std::max(0.0, taken - freedom_taken(2.0 * half_width));
    const double most = variance * (freed + kWiderSigmas * std::sqrt(2.0 * freed));
    if (wider_squares - squares > most) break;
    half_width *= 2.0;
    squares = wider_squares;
  }
  return {half_width, count, squares, freedom_taken(half_width)};
}

void EvenFit::FitPieces(EvenTimes* even) {
  std::vector<std::vector<Point>> points;
  for (const Piece& piece : counted_.pieces) {
    points.push_back(PointsOf(piece));
    Clip(SlowPart(points.back(), LeastHalfWidth()), 0.5 * period_, &points.back());
  }
  lines_ = WidestLines(points);
  constexpr double kLongestNs = 4.6e18;  // 2^62: times are nearer to zero.
  std::int64_t last_ns =
      stamps_.front() - static_cast<std::int64_t>(std::min(1e3 * period_, kLongestNs));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Piece& piece = counted_.pieces[i];
    const std::vector<Point> slow = SlowPart(points[i], lines_.half_width);
    for (std::size_t k = piece.begin; k < piece.end; ++k) {
      const double number = counted_.number[k];
      const std::int64_t time_ns =
          stamps_[piece.begin] + std::llround(period_ * number + ValueAt(slow, number));
      last_ns = std::max(time_ns, last_ns);
      even->time_ns.push_back(last_ns);
    }
  }
  even->jitter_ns = Jitter(*even, 0.0);
}

// Whether the RMS of the stamps about a line grows with the line's length.
bool EvenFit::ErrorsAddUp() const {
  double long_squares = 0.0, short_squares = 0.0;
  const double long_width = run_ * static_cast<double>(kLongPoints);
  const double short_width = run_ * static_cast<double>(kShortPoints);
  for (const Piece& piece : counted_.pieces) {
    const std::vector<Point> points = PointsOf(piece);
    if (points.size() < 2 * kShortPoints) continue;
    long_squares += SquaresAbout(SlowPart(points, long_width), points);
    short_squares += SquaresAbout(SlowPart(points, short_width), points);
  }
  // For stamps in bursts, growth by less than a tenth of an interval is ignored.
  const double least = in_bursts_ ? 0.01 * period_ * period_ : 0.0;
  return long_squares >
         kMostGrowth * kMostGrowth * (short_squares + least * static_cast<double>(stamps_.size()));
}

// RMS of stamp − time, ns, without the share `left_out` of the largest errors.
double EvenFit::Jitter(const EvenTimes& even, double left_out) const {
  std::vector<double> squares;
  for (std::size_t k = 0; k < stamps_.size(); ++k) {
    if (!stamps_.IsStamped(k)) continue;
    squares.push_back(std::pow(static_cast<double>(stamps_[k] - even.time_ns[k]), 2));
  }
  const auto kept =
      static_cast<std::size_t>((1.0 - left_out) * static_cast<double>(squares.size()));
  std::nth_element(
      squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(kept), squares.end());
  double sum = 0.0;
  for (std::size_t k = 0; k < kept; ++k) sum += squares[k];
  return std::sqrt(sum / static_cast<double>(kept));
}

StampKind EvenFit::KindOf(const EvenTimes& even) const {
  // All samples of a window share one error, so averaging within the window does not reduce it.
  const double matters =
      kJitterThatMatters * period_ / std::sqrt(static_cast<double>(stamps_.window));
  // Outliers of a logger, up to kHiccups of the stamps, are left out.
  if (Jitter(even, kHiccups) < matters) return StampKind::kRegular;
  // Checked before ErrorsAddUp: if the interval is nearly whole ticks, rounding errors drift.
  if (tick_ > 0.0) return StampKind::kOnTicks;
  if (ErrorsAddUp()) return StampKind::kIrregular;
  return in_bursts_ ? StampKind::kInBursts : StampKind::kJittered;
}

double EvenFit::Bic() const {
  // Adds a σ of a thousandth of an interval to each stamp: a perfect fit must not give log 0.
  const double least = lines_.points * std::pow(1e-3 * period_, 2);
  const double fitted = counted_.steps + lines_.freedom_taken;
  return lines_.points * std::log((lines_.squares + least) / lines_.points) +
         fitted * std::log(lines_.points);
}

void EvenFit::Fit(EvenTimes* even) {
  even->time_ns.clear();
  counted_ = Count(stamps_, period_, tick_, none_lost_);
  FitPieces(even);
}

EvenTimes EvenFit::Run() {
  EvenTimes even;
  even.period_ns = period_;
  if (!(period_ > 0.0)) return even;
  in_bursts_ = stamps_.are_windows();
  run_ = static_cast<double>(stamps_.window);
  if (!in_bursts_) FindTick();
  Fit(&even);
  const bool is_tick =
      tick_ > 0.0 && even.jitter_ns > kLeastOfTick * tick_ && even.jitter_ns < kMostOfTick * tick_;
  if (!in_bursts_ && !is_tick && (tick_ > 0.0 || Waits())) {
    tick_ = 0.0;
    in_bursts_ = Waits();
    if (in_bursts_) {
      run_ = static_cast<double>(stamps_.size()) /
             static_cast<double>(OnTime(stamps_, period_).size());
    }
    Fit(&even);
  }
  even.kind = KindOf(even);
  double lost = 0.0;
  for (const Piece& piece : counted_.pieces) {
    lost += counted_.number[piece.end - 1] + 1.0 - static_cast<double>(piece.end - piece.begin);
  }
  even.lost = lost;
  even.are_many_lost =
      !stamps_.are_windows() && lost > kOftenLost * static_cast<double>(stamps_.size());
  return even;
}

}  // namespace

std::string_view StampKindName(StampKind kind) {
  switch (kind) {
    case StampKind::kRegular:
      return "regular";
    case StampKind::kJittered:
      return "jittered";
    case StampKind::kInBursts:
      return "in bursts";
    case StampKind::kOnTicks:
      return "on ticks";
    case StampKind::kIrregular:
      return "irregular";
  }
  return "";
}

double UsualSpacing(std::span<const std::int64_t> stamps_ns) {
  const std::size_t steps = stamps_ns.size() - 1;
  const auto median_over = [&](std::size_t lag) {
    std::vector<double> slopes;
    const Stamps stamps{stamps_ns};
    for (std::size_t k = lag; k <= steps; ++k) slopes.push_back(Slope(stamps, k - lag, k));
    return Median(std::move(slopes));
  };
  const double single = median_over(1);
  const double several = median_over(std::clamp<std::size_t>(steps / 8, 1, kBurstSamples));
  // Chosen: groups with a longer mean interval are not bursts of a sensor's memory, but of a logger
  // that sleeps in between.
  constexpr double kLongestIntervalNs = 2e8;
  return single < kTogether * several && several < kLongestIntervalNs ? several : single;
}

EvenTimes FitEvenTimes(const Stamps& stamps, bool none_lost) {
  if (stamps.size() < kFewestStamps) return {};
  const double usual = UsualSpacing(stamps.time_ns);
  const auto fit_all = [&] {
    return EvenFit(stamps, PeriodOfStretches(stamps, usual, kBurstSamples / 4), true);
  };
  if (none_lost && !stamps.are_windows()) return fit_all().Run();
  const std::optional<double> period =
      stamps.are_windows() ? std::nullopt : PeriodOfSteps(stamps, usual);
  EvenFit fit(stamps, period ? *period : PeriodOfStretches(stamps, usual, 1), false);
  EvenTimes even = fit.Run();
  if (stamps.are_windows() || even.lost == 0.0 || even.kind == StampKind::kRegular) return even;
  // If jitter hides the period, or bursts are late, samples may seem lost although they are not. So
  // a fit without lost samples is made as well, and the fit with the lesser BIC is used.
  EvenFit of_all = fit_all();
  EvenTimes of_all_even = of_all.Run();
  return of_all.Bic() < fit.Bic() ? of_all_even : even;
}

bool StampWatch::AreEven(std::span<const std::int64_t> stamps_ns) {
  if (stamps_ns.empty()) return true;
  if (period_ns_ == 0.0) {
    if (stamps_ns.size() >= 2) period_ns_ = UsualSpacing(stamps_ns);
    if (!(period_ns_ > 0.0)) return stamps_ns.size() < 2;
    last_ns_ = stamps_ns.front();
  }
  const double squares_before = squares_ns2_, freedom_before = freedom_;
  const std::int64_t soon_ns = std::llround(kSoon * period_ns_);
  const std::int64_t late_ns = std::llround((1.0 + kSoon) * period_ns_);
  std::size_t begin = 0, soons = 0;
  double missing = 0.0;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    const std::int64_t step_ns = stamps_ns[i] - std::exchange(last_ns_, stamps_ns[i]);
    soons += step_ns < soon_ns ? 1 : 0;
    if (step_ns <= late_ns) continue;
    missing += std::min(static_cast<double>(step_ns) / period_ns_ - 1.0, kGapSpacings);
    Extend(stamps_ns.subspan(begin, i - begin));
    CloseLine();
    begin = i;
  }
  Extend(stamps_ns.subspan(begin));
  const double squares = squares_ns2_ - squares_before, freedom = freedom_ - freedom_before;
  const double most = kJitterThatMatters * period_ns_;
  const auto count = static_cast<double>(stamps_ns.size());
  return static_cast<double>(soons) <= 1.0 + kHiccups * count &&
         missing <= kGapSpacings + kOftenLost * count && squares <= most * most * freedom;
}

void StampWatch::Extend(std::span<const std::int64_t> stamps_ns) {
  while (!stamps_ns.empty()) {
    if (line_.count == 0) line_.first_ns = stamps_ns.front();
    const std::size_t taken = std::min(kBurstSamples - line_.count, stamps_ns.size());
    // Sums in local variables stay in registers.
    double number = static_cast<double>(line_.count), off_sum = 0.0, offs = 0.0, product = 0.0;
    for (const std::int64_t stamp : stamps_ns.first(taken)) {
      const double off = static_cast<double>(stamp - line_.first_ns) - period_ns_ * number;
      off_sum += off, offs += off * off, product += number * off;
      number += 1.0;
    }
    line_.off += off_sum, line_.offs += offs, line_.product += product;
    line_.count += taken;
    stamps_ns = stamps_ns.subspan(taken);
    if (line_.count == kBurstSamples) CloseLine();
  }
}

void StampWatch::CloseLine() {
  const Line line = std::exchange(line_, Line{});
  if (line.count < kFewestOfLine) return;
  const auto count = static_cast<double>(line.count);
  // Mean of 0, 1, …, count - 1, and the sum of squares about it.
  const double mean = 0.5 * (count - 1.0), numbers = count * (count * count - 1.0) / 12.0;
  const double product = line.product - mean * line.off;
  const double offs = line.offs - line.off * line.off / count;
  squares_ns2_ += std::max(0.0, offs - product * product / numbers);
  freedom_ += count - 2.0;
  period_ns_ += product / numbers;
}

double StampWatch::jitter_s() const {
  return freedom_ > 0.0 ? 1e-9 * std::sqrt(squares_ns2_ / freedom_) : 0.0;
}

StampShare ShareOfStamps(std::span<const std::int64_t> stamps_ns,
                         std::span<const double> x,
                         std::span<const double> y,
                         std::span<const double> z,
                         double period_ns) {
  // The instrumental variable is the slope between readings k - 3 and k + 3. Its noise is
  // independent of that of readings k - 1 to k + 1.
  constexpr std::size_t kFurther = 3;
  double zd = 0.0, zx = 0.0, zd_zd = 0.0, zd_zx = 0.0, zx_zx = 0.0;
  for (std::size_t k = kFurther; k + kFurther < stamps_ns.size(); ++k) {
    const auto span = static_cast<double>(stamps_ns[k + 1] - stamps_ns[k - 1]);
    const auto around = static_cast<double>(stamps_ns[k + kFurther] - stamps_ns[k - kFurther]);
    const auto repeats = [&](std::size_t i) {
      return x[i] == x[k] && y[i] == y[k] && z[i] == z[k];
    };
    if (!(span > 0.0) || around > 4.0 * kFurther * period_ns) continue;
    if (repeats(k - 1) || repeats(k + 1)) continue;  // A repeat is older than its stamp.
    const double share = static_cast<double>(stamps_ns[k] - stamps_ns[k - 1]) / span - 0.5;
    for (const std::span<const double>& axis : {x, y, z}) {
      const double off = axis[k] - 0.5 * (axis[k - 1] + axis[k + 1]);
      const double instrument =
          share * (axis[k + kFurther] - axis[k - kFurther]) / static_cast<double>(kFurther);
      const double by_off = instrument * off;
      const double by_slope = instrument * share * (axis[k + 1] - axis[k - 1]);
      zd += by_off, zx += by_slope;
      zd_zd += by_off * by_off, zd_zx += by_off * by_slope, zx_zx += by_slope * by_slope;
    }
  }
  if (!(std::abs(zx) > 0.0)) return {};
  const double beta = zd / zx;
  // This variance allows for errors of unequal size, as readings are noisier in motion (White
  // 1980). It is taken about the tested share of 1/2: about their own share, a few readings that
  // agree by chance would have no variance.
  const double variance = zd_zd - zd_zx + 0.25 * zx_zx;
  return {beta, std::sqrt(std::max(0.0, variance)) / std::abs(zx)};
}

}  // namespace truetriad
