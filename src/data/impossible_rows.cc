// SPDX-License-Identifier: Apache-2.0
#include "data/impossible_rows.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "base/messages.h"
#include "base/rounded_text.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Rows kept before a word, and rows after it, that say where it should be.
constexpr std::size_t kAbout = 8;
// Rows that are searched for those after it: every third of them may be a word as well.
constexpr std::size_t kAhead = 24;
// Rows held back while a word lasts: eight seconds at 1 kHz.
constexpr std::size_t kMostHeld = 8192;
// A word this many steps off the reading before is looked at.
constexpr double kFewSteps = 5.0;
// The smallest step shows long before.
constexpr std::int64_t kStepRows = 20000;

// A register that runs over jumps from one end of the range to the other, of which readings near
// the jump are this share; ...
constexpr double kNearEnd = 0.8;
// ... by this many times what readings changed before; ...
constexpr double kJumpSteps = 8.0;
// ... it was on its way outward, over all rows kept by this many times what it bends and scatters:
// a unit whose rests were joined, or a table that reverses, is not (1 in 1e5 by white noise); ...
constexpr double kOutward = 2.0;
// Where that has been seen before, less says it again.
constexpr double kOutwardAgain = 0.5;
// ... without the jump it is continuous, to some such changes and this share of the range; ...
constexpr double kContinuousSteps = 3.0;
constexpr double kContinuousShare = 0.05;
// ... and it comes back before it has got further from the other end.
constexpr double kStaysNear = 0.3;

// Far from all: nothing is known of what came before.
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
    if (rows_seen_ >= kStepRows) continue;
    const double rounding = 1e-9 * largest_[axis];
    double before = last_ ? (*last_)[axis] : values.front();
    for (const double value : values) {
      const double step = std::abs(value - std::exchange(before, value));
      if (step > rounding && step < step_[axis]) step_[axis] = step;
    }
  }
  rows_seen_ += static_cast<std::int64_t>(block.x.size());
}

// Whether a row may be a word or over the end: without a branch, as most blocks have neither.
bool RowScreen::MayHaveSuspects(const SampleBlock& block) const {
  int found = 0;
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    found |=
        static_cast<int>(block.x[i] == block.y[i]) & static_cast<int>(block.y[i] == block.z[i]);
  }
  const std::array<std::span<const double>, 3> axes = {block.x, block.y, block.z};
  for (int axis = 0; axis < 3; ++axis) {
    const std::span<const double> values = axes[static_cast<std::size_t>(axis)];
    const double near = kNearEnd * largest_[axis];
    for (const double value : values) {
      found |= static_cast<int>(value == 0.0) | static_cast<int>(std::abs(value) >= kLeastWord);
    }
    for (std::size_t i = 1; i < values.size(); ++i) {
      found |= static_cast<int>(values[i] * values[i - 1] < 0.0) &
               static_cast<int>(std::abs(values[i]) >= near) &
               static_cast<int>(std::abs(values[i - 1]) >= near);
    }
  }
  const Eigen::Vector3d first(block.x[0], block.y[0], block.z[0]);
  return found != 0 || !last_ || MayWrap(first, *last_);
}

bool RowScreen::IsSuspect(const Eigen::Vector3d& reading, const Eigen::Vector3d& before) const {
  const bool one_word = IsOneWord(reading);
  for (int axis = 0; axis < 3; ++axis) {
    if (!one_word && !IsWord(reading[axis])) continue;
    if (!(std::abs(reading[axis] - before[axis]) <= kFewSteps * step_[axis])) return true;
  }
  return false;
}

bool RowScreen::MayWrap(const Eigen::Vector3d& reading, const Eigen::Vector3d& before) const {
  for (int axis = 0; axis < 3; ++axis) {
    const double near = kNearEnd * largest_[axis];
    const bool crosses = reading[axis] * before[axis] < 0.0;
    if (crosses && std::abs(reading[axis]) >= near && std::abs(before[axis]) >= near) return true;
  }
  return false;
}

// The axis that runs over its end between the last row kept and this one; -1: none.
int RowScreen::WrappedAxis(const Eigen::Vector3d& reading) const {
  const std::size_t count = history_.size();
  if (count < kAbout) return -1;
  const double outward = left_[kWrapped] > 0 ? kOutwardAgain : kOutward;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = history_.back()[axis];
    const double side = last < 0.0 ? -1.0 : 1.0;
    const double near = kNearEnd * largest_[axis];
    if (side * last < near || side * reading[axis] > -near) continue;
    double change = 0.0, bend = 0.0;
    for (std::size_t k = 1; k < count; ++k) {
      const double step = history_[k][axis] - history_[k - 1][axis];
      change = std::max(change, std::abs(step));
      if (k + 1 == count) continue;
      bend = std::max(bend, std::abs(history_[k + 1][axis] - history_[k][axis] - step));
    }
    const double trend = side * (last - history_.front()[axis]);
    const double jump = std::abs(reading[axis] - last);
    if (jump > kJumpSteps * change && trend > outward * bend && trend > 0.0 &&
        std::abs(jump - 2.0 * largest_[axis]) <
            kContinuousSteps * change + kContinuousShare * largest_[axis]) {
      return axis;
    }
  }
  return -1;
}

bool RowScreen::IsClean(const SampleBlock& block) {
  if (block.x.empty()) return is_empty();
  WatchSteps(block);
  const std::size_t count = block.x.size();
  bool is_clean = is_empty();
  const bool look = is_clean && MayHaveSuspects(block);
  for (std::size_t i = 0; look && is_clean && i < count; ++i) {
    const Eigen::Vector3d reading(block.x[i], block.y[i], block.z[i]);
    // Of the first reading of all nothing is known.
    const Eigen::Vector3d before = last_.value_or(Nowhere());
    is_clean = is_clean && !IsSuspect(reading, before) && !(last_ && MayWrap(reading, before));
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

void RowScreen::Remember(const Eigen::Vector3d& reading) {
  if (history_.size() == kAbout) history_.erase(history_.begin());
  history_.push_back(reading);
}

// The rows kept before, and those from `begin` on that are no words.
std::vector<Eigen::Vector3d> RowScreen::ReadingsAbout(std::size_t begin, bool* is_enough) const {
  std::vector<Eigen::Vector3d> about = history_;
  const Eigen::Vector3d before = history_.empty() ? Nowhere() : history_.back();
  const std::size_t end = std::min(rows_.size(), begin + kAhead);
  std::size_t after = 0;
  for (std::size_t i = begin; i < end && after < kAbout; ++i) {
    if (IsSuspect(rows_.reading(i), before)) continue;
    about.push_back(rows_.reading(i));
    ++after;
  }
  *is_enough = after == kAbout || end == begin + kAhead;
  return about;
}

std::optional<RowScreen::Kind> RowScreen::WhyImpossible(const Eigen::Vector3d& reading,
                                                        const AboutWord& about) const {
  if (!IsNoReading(reading, about)) return std::nullopt;
  if (reading.cwiseAbs().maxCoeff() >= kNoSensorReads) return kAbsurd;
  return reading.isZero(0.0) ? kZero : kWord;
}

// The row that comes back over the end; `begin` where none does, rows_.size() where it is not
// known.
std::size_t RowScreen::EndOfWrap(std::size_t begin, int axis) const {
  const double side = rows_.reading(begin)[axis] < 0.0 ? -1.0 : 1.0;
  for (std::size_t i = begin + 1; i < rows_.size(); ++i) {
    const double reading = rows_.reading(i)[axis];
    if (side * reading < -kNearEnd * largest_[axis]) return i;
    if (side * reading < kStaysNear * largest_[axis]) return begin;
  }
  return rows_.size();
}

void RowScreen::Leave(Kind kind, std::size_t i) {
  if (first_row_ < 0) {
    first_row_ = rows_.row[i];
    example_ = rows_.reading(i);
  }
  ++left_[kind];
}

SampleBlock RowScreen::Judge(bool at_end) {
  constexpr std::array<Mechanism, kKinds> kActs = {Mechanism::kZeroRows,
                                                   Mechanism::kErrorWords,
                                                   Mechanism::kAbsurdRows,
                                                   Mechanism::kWrappedRows};
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
    if (!history_.empty() && MayWrap(rows_.reading(i), before)) {
      const int axis = WrappedAxis(rows_.reading(i));
      const std::size_t end = axis < 0 ? i : EndOfWrap(i, axis);
      if (end == count && !must_judge) break;
      if (end > i && end < count && Acts(Mechanism::kWrappedRows)) {
        for (; i < end; ++i) Leave(kWrapped, i);
        continue;
      }
    }
    if (!IsSuspect(rows_.reading(i), before)) {
      keep(i++);
      continue;
    }
    std::size_t end = i;
    while (end < count && IsSuspect(rows_.reading(end), before)) ++end;
    bool is_enough = false;
    AboutWord about{ReadingsAbout(end, &is_enough), step_, end - i, 0.0};
    if (!is_enough && !must_judge) break;
    for (; i < end; ++i) {
      about.zero_share = static_cast<double>(left_[kZero]) / static_cast<double>(rows_seen_);
      if (const auto kind = WhyImpossible(rows_.reading(i), about); kind && Acts(kActs[*kind])) {
        Leave(*kind, i);
      } else {
        keep(i);
      }
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
  const std::array<std::string, kKinds> words = {"read 0, 0, 0",
                                                 "hold a word that stands for no reading",
                                                 "are absurd",
                                                 "ran over the end of their range"};
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    if (left_[kind] == 0) continue;
    total += left_[kind];
    kinds += (kinds.empty() ? "" : ", ") + std::to_string(left_[kind]) + " " + words[kind];
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
    auto& screen = screens_[triad];
    if (!screen) screen.emplace(triad);
    bool is_clean = true;
    for (const SampleBlock* block : own) is_clean = screen->IsClean(*block) && is_clean;
    for (SampleBlock* block : own) {
      if (is_clean) {
        screen->Accept(*block);
      } else {
        screen->Hold(*block);
        block->x = {};
      }
    }
    if (!is_clean) *own.front() = screen->Judge(/*at_end=*/false);
  }
  std::erase_if(*blocks, [](const SampleBlock& block) { return block.x.empty(); });
}

void ImpossibleRows::Flush(std::vector<SampleBlock>* blocks) {
  blocks->clear();
  for (auto& screen : screens_) {
    if (!screen) continue;
    const SampleBlock rest = screen->Judge(/*at_end=*/true);
    if (!rest.x.empty()) blocks->push_back(rest);
  }
}

Findings ImpossibleRows::Left() const {
  Findings findings;
  for (const auto& screen : screens_) {
    if (!screen) continue;
    if (auto left = screen->Left()) findings.push_back(*std::move(left));
  }
  return findings;
}

}  // namespace truetriad
