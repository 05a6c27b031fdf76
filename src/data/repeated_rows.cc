// SPDX-License-Identifier: Apache-2.0
#include "data/repeated_rows.h"

#include <algorithm>
#include <bit>
#include <set>
#include <string>
#include <tuple>

#include "base/messages.h"
#include "data/block_piece.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Of kRun readings so many must differ. If two readings are equal with probability c, so many of 32
// differ only for c < 0.3 or so, and the 5e11 pairs of a million rows have an equal run of 32 by
// chance with 5e11 c^32 < 1e-5.
constexpr std::size_t kFewestDifferent = 16;
// So many of those must turn back against the one before: of white noise 20 of 30 do on a single
// axis, of a motion without noise, which may repeat exactly, hardly any. (Two values that alternate
// do as well: but only two of them differ.)
constexpr std::size_t kFewestReversals = 10;
// One run in eight is remembered, chosen by its hash, so that a repeat chooses the same: a repeat
// of kRun + 32 readings is missed in one of 70 cases, one of twice that never.
constexpr int kRunBits = 3;
// Eleven hours at 100 Hz: what bounds the memory. Later repeats are not looked for.
constexpr std::size_t kMostRemembered = 4'000'000;
constexpr std::uint64_t kBase = 0x9E3779B97F4A7C15U;  // odd, for a polynomial hash
// As many as people read.
constexpr std::size_t kMostTold = 3;

// The finaliser of splitmix64 (Steele, Lea, Flood 2014).
std::uint64_t Mixed(std::uint64_t value) {
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9U;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBU;
  return value ^ (value >> 31U);
}

std::uint64_t HashOf(const Eigen::Vector3d& reading) {
  std::uint64_t hash = 0;
  for (const double value : reading) {
    hash = Mixed(hash + kBase + std::bit_cast<std::uint64_t>(value + 0.0));  // -0 is 0
  }
  return hash;
}

constexpr std::uint64_t Power(std::uint64_t base, std::size_t exponent) {
  std::uint64_t power = 1;
  for (std::size_t i = 0; i < exponent; ++i) power *= base;
  return power;
}

}  // namespace

void RepeatFinder::Remember(const Eigen::Vector3d& reading, std::uint64_t hash, std::int64_t row) {
  constexpr std::uint64_t kOldest = Power(kBase, kRun);
  hashes_.push_back(hash);
  rows_.push_back(row);
  run_hash_ = run_hash_ * kBase + hash;
  if (run_.size() < kRun) {
    run_.push_back(reading);
    return;
  }
  run_hash_ -= kOldest * hashes_[hashes_.size() - 1 - kRun];
  run_[run_begin_] = reading;
  run_begin_ = (run_begin_ + 1) % kRun;
}

bool RepeatFinder::IsNoise() const {
  std::set<std::tuple<double, double, double>> different;
  std::size_t reversals = 0;
  const auto at = [this](std::size_t i) -> const Eigen::Vector3d& {
    return run_[(run_begin_ + i) % kRun];
  };
  for (std::size_t i = 0; i < kRun; ++i) {
    const bool is_new = different.emplace(at(i).x(), at(i).y(), at(i).z()).second;
    if (i < 2 || !is_new) continue;
    const Eigen::Array3d step = at(i) - at(i - 1), before = at(i - 1) - at(i - 2);
    reversals += (step * before < 0.0).any() ? 1 : 0;
  }
  return different.size() >= kFewestDifferent && reversals >= kFewestReversals;
}

std::optional<std::size_t> RepeatFinder::EarlierRun() {
  if (run_.size() < kRun || (run_hash_ >> (64 - kRunBits)) != 0) return std::nullopt;
  const std::size_t last = hashes_.size() - 1;
  const auto [known, is_new] = runs_.try_emplace(run_hash_, last);
  if (is_new) return std::nullopt;
  const std::size_t source = known->second;
  // Readings that were forgotten since, or that this run itself holds.
  if (source + kRun > last) {
    known->second = last;
    return std::nullopt;
  }
  const auto at = [this](std::size_t end) {
    return hashes_.begin() + static_cast<std::ptrdiff_t>(end + 1);
  };
  const bool is_equal = std::equal(at(source) - kRun, at(source), at(last) - kRun);
  return is_equal && IsNoise() ? std::optional(source) : std::nullopt;
}

std::int64_t RepeatFinder::BeginRepeat(std::size_t source) {
  source_ = source;
  std::size_t first = hashes_.size() - 1;
  std::size_t of = source;
  while (of > 0 && first - 1 > source && hashes_[first - 1] == hashes_[of - 1]) --first, --of;
  const std::int64_t first_row = rows_[first];
  stretches_.push_back({first_row, first_row, 0, 0, rows_[of]});
  hashes_.resize(first);
  rows_.resize(first);
  run_.clear();
  run_begin_ = 0;
  run_hash_ = 0;
  return first_row;
}

std::vector<std::pair<std::size_t, std::size_t>> RepeatFinder::Repeats(const SampleBlock& block) {
  std::vector<std::pair<std::size_t, std::size_t>> repeats;
  if (source_) repeats.emplace_back(0, 0);
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    const Eigen::Vector3d reading(block.x[i], block.y[i], block.z[i]);
    const bool is_same = last_ && *last_ == reading;
    last_ = reading;
    const std::uint64_t hash = is_same ? 0 : HashOf(reading);
    if (source_ && !is_same) {
      if (*source_ + 1 < hashes_.size() && hashes_[*source_ + 1] == hash) {
        ++*source_;
      } else {
        source_.reset();
      }
    }
    if (!source_) {
      if (is_same || hashes_.size() >= kMostRemembered) continue;
      Remember(reading, hash, block.row[i]);
      const std::optional<std::size_t> source = EarlierRun();
      if (!source || !Acts(Mechanism::kRepeatedRows)) continue;
      const std::int64_t first_row = BeginRepeat(*source);
      const auto first = static_cast<std::size_t>(
          std::lower_bound(block.row.begin(), block.row.end(), first_row) - block.row.begin());
      stretches_.back().first_ns = block.time_ns[first];
      repeats.emplace_back(first, i + 1);
    }
    repeats.back().second = i + 1;
    stretches_.back().last_row = block.row[i];
    stretches_.back().last_ns = block.time_ns[i];
  }
  std::erase_if(repeats, [](const auto& repeat) { return repeat.first == repeat.second; });
  return repeats;
}

void RepeatedRows::Apply(std::vector<SampleBlock>* blocks) {
  std::vector<SampleBlock> pieces;
  for (const SampleBlock& block : *blocks) {
    std::size_t begin = 0;
    for (const auto& [first, last] : finders_[block.triad].Repeats(block)) {
      if (begin < first) pieces.push_back(PieceOf(block, begin, first));
      begin = last;
    }
    if (begin < block.x.size()) pieces.push_back(PieceOf(block, begin, block.x.size()));
  }
  *blocks = std::move(pieces);
}

std::vector<RepeatedStretch> RepeatedRows::Stretches() const {
  std::vector<RepeatedStretch> all;
  for (const RepeatFinder& finder : finders_) {
    all.insert(all.end(), finder.stretches().begin(), finder.stretches().end());
  }
  std::stable_sort(
      all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first_ns < b.first_ns; });
  std::vector<RepeatedStretch> merged;
  for (const RepeatedStretch& stretch : all) {
    if (merged.empty() || stretch.first_ns > merged.back().last_ns) {
      merged.push_back(stretch);
    } else {
      merged.back().last_ns = std::max(merged.back().last_ns, stretch.last_ns);
    }
  }
  return merged;
}

Findings FindingsOf(const std::vector<RepeatedStretch>& stretches, std::int64_t origin_ns) {
  Findings findings;
  const auto seconds = [origin_ns](std::int64_t time_ns) {
    return 1e-9 * static_cast<double>(time_ns - origin_ns);
  };
  for (std::size_t i = 0; i < std::min(stretches.size(), kMostTold); ++i) {
    const RepeatedStretch& stretch = stretches[i];
    const double from_s = seconds(stretch.first_ns), to_s = seconds(stretch.last_ns);
    findings.push_back(Finding(FindingCode::kRepeatedRows,
                               "data rows " + std::to_string(stretch.first_row) + " to " +
                                   std::to_string(stretch.last_row) + Format(" (%.2f s", from_s) +
                                   Format(" to %.2f s) repeat the rows from ", to_s) +
                                   std::to_string(stretch.of_row) +
                                   " on to the last digit, which noise does not: they count once")
                           .With("from", from_s, "s")
                           .With("to", to_s, "s")
                           .With("first_row", static_cast<double>(stretch.first_row))
                           .With("last_row", static_cast<double>(stretch.last_row))
                           .With("of_row", static_cast<double>(stretch.of_row)));
  }
  if (stretches.size() > kMostTold) {
    const std::size_t more = stretches.size() - kMostTold;
    findings.push_back(Finding(FindingCode::kRepeatedRows,
                               std::to_string(more) + " more stretches of rows repeat others")
                           .With("stretches", static_cast<double>(more)));
  }
  return findings;
}

}  // namespace truetriad
