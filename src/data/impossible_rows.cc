// SPDX-License-Identifier: Apache-2.0
#include "data/impossible_rows.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "base/messages.h"
#include "base/rounded_text.h"
#include "data/held_samples.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Chosen: eight rows before an error word and eight after it give the expected reading.
constexpr std::size_t kAbout = 8;
// Number of rows after an error word that are searched for eight good ones: two of three rows may
// have error words.
constexpr std::size_t kAhead = 24;
// The largest number of rows held back while error words continue: eight seconds at 1 kHz.
constexpr std::size_t kMostHeld = 8192;
// Chosen: a word is suspected if it differs from the reading before by more steps than this.
constexpr double kFewSteps = 5.0;
// The smallest error word except zero.
constexpr double kLeastWord = 999.0;
// Chosen: at least six readings, of which trimming leaves four, determine their spread.
constexpr std::size_t kFewestAbout = 6;
// The most extreme reading on each side is left out of the spread, as it may be a word itself.
constexpr std::size_t kTrimmed = 1;
// The 14 readings left of 16 span 2.6 σ; this determines σ as well as 12 degrees of freedom do.
constexpr double kSpreadSigmas = 2.6, kDof = 12.0;
// Chosen: a word is no reading if it is outside the range of its 16 neighbours by more than five
// times their spread. If the unit moves, readings go on by one spread at most.
constexpr double kFarSpreads = 5.0;
// A row less likely than this is no reading: to lose one good row in a million is no loss.
constexpr double kUnlikely = 1e-6;
// A zero is no reading if it is less likely as a reading than a third of the share of zero words.
// The probability that it is a reading is then below (1/3) / (1/3 + 1) = 1/4.
constexpr double kZeroShare = 1.0 / 3.0;
// Chosen: up to three consecutive words are judged as single errors. More may be a rest with this
// reading, and then only noise and distance count.
constexpr std::size_t kFewInARow = 3;
// Chosen: a row in which all axes read the same nonzero word is no reading if, on an axis, the word
// is outside the range of its neighbours by over half a spread.
constexpr double kApartSpreads = 0.5;
// Chosen: if the readings around a word spread over fewer steps, the unit rests, and a reading may
// lie half a spread outside by chance.
constexpr double kSomeSteps = 20.0;

// Whether drivers or file formats write this value in place of a missing reading: zero, the limits
// of 16 and 32 bits, numbers of nines.
bool IsWord(double value) {
  const double size = std::abs(value);
  if (size < kLeastWord) return size == 0.0;
  if (size < 32767.0) return size == 999.0 || size == 9999.0;
  if (size <= 65535.0) return size == 32767.0 || size == 32768.0 || size == 65535.0;
  return size == 99999.0 || size == 2147483647.0 || size == 2147483648.0 || size >= kNoSensorReads;
}

// Whether all axes read the same.
bool IsOneWord(const Eigen::Vector3d& reading) {
  return reading.x() == reading.y() && reading.y() == reading.z();
}

// Readings before and after a word, and properties of their stream.
struct AboutWord {
  std::vector<Eigen::Vector3d> readings;  // Good readings before and after the word.
  Eigen::Vector3d step;                   // Smallest change of readings, per axis.
  std::size_t in_a_row = 1;               // Number of consecutive suspected rows.
  double zero_share = 0.0;                // Share of the rows so far that were zero words.
};

struct Spread {
  double low, high, step;
  double width() const { return std::max(high - low, step); }
  // Distance of a value from the range, in widths; 0 inside the range.
  double Off(double value) const { return std::max({low - value, value - high, 0.0}) / width(); }
  // The chance of a value among readings of this spread is TailOf times StepShare. TailOf is
  // Student's density at the value relative to its maximum, StepShare the chance of the most
  // frequent step.
  double sigma() const { return std::max((high - low) / kSpreadSigmas, 0.5 * step); }
  double TailOf(double value) const {
    const double distance = (value - 0.5 * (low + high)) / sigma();
    return std::pow(1.0 + distance * distance / kDof, -0.5 * (kDof + 1.0));
  }
  double StepShare() const { return std::min(1.0, 0.4 * step / sigma()); }
};

Spread SpreadOf(const AboutWord& about, int axis) {
  std::vector<double> values;
  values.reserve(about.readings.size());
  for (const Eigen::Vector3d& reading : about.readings) values.push_back(reading[axis]);
  std::sort(values.begin(), values.end());
  return {values[kTrimmed], values[values.size() - 1 - kTrimmed], about.step[axis]};
}

// Whether a suspected row cannot be a reading. An axis of `reading` is a word, or all axes are
// equal. This alone proves nothing: a gyroscope at rest may read 0, 0, 0.
bool IsNoReading(const Eigen::Vector3d& reading, const AboutWord& about) {
  // StreamMonitor refuses readings that are not finite.
  if (!reading.allFinite()) return false;
  if (reading.cwiseAbs().maxCoeff() >= kNoSensorReads) return true;
  if (about.readings.size() < kFewestAbout) return false;
  const bool one_word = IsOneWord(reading);
  const bool few = about.in_a_row <= kFewInARow;
  bool has_noise = false;
  double chance = 1.0, farthest = 0.0, apart = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const Spread spread = SpreadOf(about, axis);
    has_noise = has_noise || spread.high > spread.low;
    const double off = spread.Off(reading[axis]);
    if (one_word || IsWord(reading[axis])) farthest = std::max(farthest, off);
    if (one_word && spread.width() >= kSomeSteps * spread.step) apart = std::max(apart, off);
    chance *= spread.TailOf(reading[axis]) * (few ? spread.StepShare() : 1.0);
  }
  // Many suspected rows among readings without noise are a simulated rest between constant rates.
  if (!has_noise && !few) return false;
  if (farthest > kFarSpreads) return true;
  if (!one_word) return false;
  if (reading.x() == 0.0) return chance < std::max(kUnlikely, kZeroShare * about.zero_share);
  return few && IsWord(reading.x()) && apart > kApartSpreads;
}

// Stands for the reading before the first: far from all, so that every word is suspected.
Eigen::Vector3d Nowhere() { return Eigen::Vector3d::Constant(2.0 * kNoSensorReads); }

}  // namespace

void RowScreen::WatchSteps(const SampleBlock& block) {
  const std::array<std::span<const double>, 3> axes = {block.x, block.y, block.z};
  for (int axis = 0; axis < 3; ++axis) {
    const std::span<const double> values = axes[static_cast<std::size_t>(axis)];
    double most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value));
    if (most > largest_[axis]) {
      for (const double value : values) {
        if (!IsWord(value)) largest_[axis] = std::max(largest_[axis], std::abs(value));
      }
    }
    if (rows_seen_ >= kStepReadings) continue;
    const double before = last_ ? (*last_)[axis] : values.front();
    step_[axis] = SmallestStep(values, before, largest_[axis], step_[axis]);
  }
  rows_seen_ += static_cast<std::int64_t>(block.x.size());
}

// Whether any row may have a word. There are no branches, for speed, as most blocks have none.
bool RowScreen::MayHaveSuspects(const SampleBlock& block) const {
  int found = 0;
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    found |=
        static_cast<int>(block.x[i] == block.y[i]) & static_cast<int>(block.y[i] == block.z[i]);
  }
  const std::array<std::span<const double>, 3> axes = {block.x, block.y, block.z};
  for (int axis = 0; axis < 3; ++axis) {
    const std::span<const double> values = axes[static_cast<std::size_t>(axis)];
    for (const double value : values) {
      found |= static_cast<int>(value == 0.0) | static_cast<int>(std::abs(value) >= kLeastWord);
    }
  }
  return found != 0;
}

bool RowScreen::IsSuspect(const Eigen::Vector3d& reading, const Eigen::Vector3d& before) const {
  const bool one_word = IsOneWord(reading);
  for (int axis = 0; axis < 3; ++axis) {
    if (!one_word && !IsWord(reading[axis])) continue;
    if (!(std::abs(reading[axis] - before[axis]) <= kFewSteps * step_[axis])) return true;
  }
  return false;
}

bool RowScreen::IsClean(const SampleBlock& block) {
  if (block.x.empty()) return is_empty();
  WatchSteps(block);
  const std::size_t count = block.x.size();
  bool is_clean = is_empty();
  const bool look = is_clean && MayHaveSuspects(block);
  for (std::size_t i = 0; look && is_clean && i < count; ++i) {
    const Eigen::Vector3d reading(block.x[i], block.y[i], block.z[i]);
    // The first reading of the recording has none before it.
    const Eigen::Vector3d before = last_.value_or(Nowhere());
    is_clean = !IsSuspect(reading, before);
    last_ = reading;
  }
  last_ = Eigen::Vector3d(block.x[count - 1], block.y[count - 1], block.z[count - 1]);
  return is_clean;
}

void RowScreen::Accept(const SampleBlock& block) {
  const std::size_t count = block.x.size();
  for (std::size_t i = count > kAbout ? count - kAbout : 0; i < count; ++i) {
    Remember({block.x[i], block.y[i], block.z[i]});
  }
}

// Keeps a good reading for comparison; repeats of one reading count once.
void RowScreen::Remember(const Eigen::Vector3d& reading) {
  if (!history_.empty() && history_.back() == reading) return;
  if (history_.size() == kAbout) history_.erase(history_.begin());
  history_.push_back(reading);
}

// Good readings about a word: those kept before it, and unsuspected ones from `begin` on.
// `is_enough` is set if later rows will add no more.
std::vector<Eigen::Vector3d> RowScreen::ReadingsAbout(std::size_t begin, bool* is_enough) const {
  std::vector<Eigen::Vector3d> about = history_;
  const Eigen::Vector3d before = history_.empty() ? Nowhere() : history_.back();
  const std::size_t end = std::min(rows_.size(), begin + kAhead);
  std::size_t after = 0;
  for (std::size_t i = begin; i < end && after < kAbout; ++i) {
    if (IsSuspect(rows_.reading(i), before)) continue;
    if (!about.empty() && about.back() == rows_.reading(i)) continue;
    about.push_back(rows_.reading(i));
    ++after;
  }
  *is_enough = after == kAbout || end == begin + kAhead;
  return about;
}

// Whether a suspected row differs by a few steps from the row before. The readings of a coarse
// sensor at rest do so; error words do not.
bool RowScreen::IsCoarseRest(std::size_t begin, std::size_t end) const {
  for (std::size_t i = begin + 1; i < end; ++i) {
    const Eigen::Array3d change = (rows_.reading(i) - rows_.reading(i - 1)).cwiseAbs();
    if (change.maxCoeff() > 0.0 && (change <= kFewSteps * step_.array()).all()) return true;
  }
  return false;
}

bool RowScreen::LeaveOut(const Eigen::Vector3d& reading, std::int64_t row) {
  const Kind kind = reading.isZero(0.0) ? kZero : kWord;
  if (!Acts(kind == kZero ? Mechanism::kZeroRows : Mechanism::kErrorWords)) return false;
  if (first_row_ < 0) {
    first_row_ = row;
    example_ = reading;
  }
  ++left_[kind];
  return true;
}

SampleBlock RowScreen::Judge(bool at_end) {
  std::size_t kept = 0;
  for (std::size_t i = handed_; i < rows_.size(); ++i) rows_.Move(i, i - handed_);
  rows_.Resize(rows_.size() - std::exchange(handed_, 0));
  const auto keep = [&](std::size_t i) {
    Remember(rows_.reading(i));
    rows_.Move(i, kept++);
  };
  const std::size_t count = rows_.size();
  std::size_t i = 0;
  while (i < count) {
    const bool must_judge = at_end || count - i >= kMostHeld;
    const Eigen::Vector3d before = history_.empty() ? Nowhere() : history_.back();
    if (!IsSuspect(rows_.reading(i), before)) {
      keep(i++);
      continue;
    }
    std::size_t end = i;
    while (end < count && IsSuspect(rows_.reading(end), before)) ++end;
    bool is_enough = false;
    AboutWord about{ReadingsAbout(end, &is_enough), step_, end - i, 0.0};
    if (!is_enough && !must_judge) break;
    if (IsCoarseRest(i, end)) {
      while (i < end) keep(i++);
    }
    for (; i < end; ++i) {
      about.zero_share = static_cast<double>(left_[kZero]) / static_cast<double>(rows_seen_);
      const Eigen::Vector3d reading = rows_.reading(i);
      if (!IsNoReading(reading, about) || !LeaveOut(reading, rows_.row[i])) keep(i);
    }
  }
  handed_ = kept;
  for (; i < count; ++i) rows_.Move(i, kept++);
  rows_.Resize(kept);
  return rows_.View(triad_, 0, handed_);
}

std::optional<Finding> RowScreen::Left() const {
  std::int64_t total = 0;
  std::string kinds;
  const std::array<std::string, kKinds> words = {"read 0, 0, 0", "hold an error code"};
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    if (left_[kind] == 0) continue;
    total += left_[kind];
    kinds += (kinds.empty() ? "" : "; ") + std::to_string(left_[kind]) + " " + words[kind];
  }
  if (total == 0) return std::nullopt;
  const auto number = [&](int axis) { return RoundedText(example_[axis], 6); };
  return Finding(FindingCode::kImpossibleRows,
                 std::string(TriadName(triad_)) + ": " + Counted(total, "row") +
                     " cannot be readings and are left out (" + kinds +
                     "); the first is data row " + std::to_string(first_row_) + ": " + number(0) +
                     ", " + number(1) + ", " + number(2),
                 "check the bus and the driver")
      .About(triad_)
      .With("rows", static_cast<double>(total))
      .With("share", static_cast<double>(total) / static_cast<double>(rows_seen_));
}

void ImpossibleRows::Apply(std::vector<SampleBlock>* blocks) {
  for (const Triad triad : kTriads) {
    std::vector<SampleBlock*> own;
    for (SampleBlock& block : *blocks) {
      if (block.triad == triad) own.push_back(&block);
    }
    if (own.empty()) continue;
    RowScreen& screen = screens_[triad];
    bool is_clean = true;
    for (const SampleBlock* block : own) is_clean = screen.IsClean(*block) && is_clean;
    for (SampleBlock* block : own) {
      if (is_clean) {
        screen.Accept(*block);
      } else {
        screen.Hold(*block);
        block->x = {};
      }
    }
    if (!is_clean) *own.front() = screen.Judge(/*at_end=*/false);
  }
  std::erase_if(*blocks, [](const SampleBlock& block) { return block.x.empty(); });
}

void ImpossibleRows::Flush(std::vector<SampleBlock>* blocks) {
  blocks->clear();
  for (RowScreen& screen : screens_) {
    const SampleBlock rest = screen.Judge(/*at_end=*/true);
    if (!rest.x.empty()) blocks->push_back(rest);
  }
}

Findings ImpossibleRows::Left() const {
  Findings findings;
  for (const RowScreen& screen : screens_) {
    if (auto left = screen.Left()) findings.push_back(*std::move(left));
  }
  return findings;
}

}  // namespace truetriad
