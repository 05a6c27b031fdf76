// SPDX-License-Identifier: Apache-2.0
#include "data/even_source.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "base/messages.h"
#include "base/rounded_text.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Chosen: this many samples at the end of a batch wait for the next batch, and this many samples
// that were handed over are kept, so that the line through the stamps continues into the next
// batch.
constexpr std::size_t kOverlap = 8192;

}  // namespace

ExcludedTime::ExcludedTime(const std::vector<ExcludedRange>& ranges)
    : ranges_(ranges), readings_(ranges.size(), 0) {}

void ExcludedTime::Apply(std::vector<SampleBlock>* blocks) {
  if (ranges_.empty()) return;
  std::vector<SampleBlock> pieces;
  for (const SampleBlock& block : *blocks) {
    const std::size_t size = block.time_ns.size();
    if (size > 0) {
      first_ns_ = std::min(first_ns_, block.time_ns.front());
      last_ns_ = std::max(last_ns_, block.time_ns.back());
    }
    std::size_t begin = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::int64_t time_ns = block.time_ns[i];
      const auto range =
          std::find_if(ranges_.begin(), ranges_.end(), [time_ns](const ExcludedRange& each) {
            return each.times.start_ns <= time_ns && time_ns <= each.times.end_ns;
          });
      if (range == ranges_.end()) continue;
      if (begin < i) pieces.push_back(PieceOf(block, begin, i));
      begin = i + 1;
      ++readings_[static_cast<std::size_t>(std::distance(ranges_.begin(), range))];
    }
    if (begin < size) pieces.push_back(PieceOf(block, begin, size));
  }
  *blocks = std::move(pieces);
}

std::vector<TimeRange> ExcludedTime::Left() const {
  std::vector<TimeRange> left;
  for (const ExcludedRange& range : ranges_) {
    left.push_back(
        {std::max(range.times.start_ns, first_ns_), std::min(range.times.end_ns, last_ns_)});
  }
  return left;
}

Status ExcludedTime::Tell(const RecordingInfo& info, Findings* findings) const {
  if (ranges_.empty()) return {};
  double readings = 0.0, seconds = 0.0;
  const std::vector<TimeRange> left = Left();
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const TimeRange& times = left[i];
    readings += static_cast<double>(readings_[i]);
    seconds += 1e-9 * static_cast<double>(times.end_ns - times.start_ns);
    if (readings_[i] > 0) continue;
    return ErrorIn(ErrorCode::kNotInRecording,
                   ranges_[i].stated_in,
                   "this range leaves out no reading of " + info.path +
                       ": none lies in it, or other ranges leave out all that do; "
                       "expected seconds from the recording's first sample");
  }
  findings->push_back(Finding(FindingCode::kExcluded,
                              Format("%.0f readings", readings) + Format(" in %.6g s", seconds) +
                                  " are left out, as `exclude:` asks")
                          .With("readings", readings)
                          .With("duration", seconds, "s"));
  return {};
}

Result<bool> EvenSource::Next(std::vector<SampleBlock>* blocks) {
  while (true) {
    blocks->clear();
    if (HandOver(blocks)) return true;
    if (at_end_) return false;
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source_->Next(blocks));
    if (more) excluded_->Apply(blocks);
    at_end_ = !more;
    if (more && !MustHold(*blocks)) {
      for (const SampleBlock& block : *blocks) {
        if (!block.time_ns.empty()) streams_[block.triad].last_ns = block.time_ns.back();
      }
      return true;
    }
    for (const SampleBlock& block : *blocks) streams_[block.triad].held.Append(block);
    std::size_t waiting = 0;
    for (const Stream& stream : streams_) waiting += stream.waiting();
    if (at_end_ || waiting >= kMostHeldSamples) Settle(at_end_);
  }
}

bool EvenSource::MustHold(const std::vector<SampleBlock>& blocks) {
  if (!source_->info().has_time) return false;
  for (const SampleBlock& block : blocks) {
    Stream& stream = streams_[block.triad];
    if (stream.clock.judgement != Judgement::kOpen) continue;
    // Stamps that were interpolated within a FIFO window always look even, which shows nothing.
    if (WindowOf(block.triad) > 1 || !stream.watch.AreEven(block.time_ns)) {
      stream.clock.looks_even = false;
    }
    holds_ = holds_ || !stream.clock.looks_even || how_ == TimeStamps::kRegular;
  }
  return holds_;
}

std::int64_t EvenSource::WindowOf(Triad triad) const {
  const StreamInfo* const info = source_->info().Find(triad);
  return info == nullptr ? 1 : info->window_samples;
}

// ShareOfStamps, pooled over all sensors that have these stamps, such as the columns of one file.
StampShare EvenSource::ShareOf(std::span<const std::int64_t> stamps_ns, double period_ns) const {
  double weights = 0.0, sum = 0.0;
  for (const Stream& stream : streams_) {
    const HeldSamples& held = stream.held;
    if (!std::ranges::equal(held.time_ns, stamps_ns)) continue;
    const StampShare own = ShareOfStamps(held.time_ns, held.x, held.y, held.z, period_ns);
    if (!(own.sigma > 0.0)) continue;
    weights += 1.0 / (own.sigma * own.sigma);
    sum += own.beta / (own.sigma * own.sigma);
  }
  return weights > 0.0 ? StampShare{sum / weights, 1.0 / std::sqrt(weights)} : StampShare{};
}

// Judges the stamps of a stream from its held samples; false if they need no judgement.
bool EvenSource::Judge(Triad triad) {
  Stream* const stream = &streams_[triad];
  Clock* const clock = &stream->clock;
  const bool is_open = clock->judgement == Judgement::kOpen;
  const bool may_be_even = is_open ? !clock->looks_even || how_ == TimeStamps::kRegular
                                   : clock->judgement == Judgement::kEven;
  clock->even_ns.clear();
  const HeldSamples& held = stream->held;
  // StreamMonitor reports times that go back.
  if (!may_be_even || !std::is_sorted(held.time_ns.begin(), held.time_ns.end())) return false;
  const Stamps stamps{held.time_ns, held.row, WindowOf(triad)};
  EvenTimes even = FitEvenTimes(stamps);
  if (even.time_ns.empty()) return false;
  const StampShare share = ShareOf(held.time_ns, even.period_ns);
  if (even.kind == StampKind::kRegular && even.are_many_lost && share.ReadingsAreEven() &&
      Acts(Mechanism::kNoRowLost)) {
    even = FitEvenTimes(stamps, /*none_lost=*/true);
  }
  if (is_open) {
    clock->kind = even.kind;
    clock->are_true = share.StampsAreTrue();
    const bool is_even =
        how_ == TimeStamps::kRegular ||
        (how_ == TimeStamps::kAuto && even.AreEvident() &&
         !(clock->are_true && Acts(Mechanism::kTrueStamps)) && Acts(Mechanism::kEvenTimes));
    clock->judgement = is_even ? Judgement::kEven : Judgement::kAsStamped;
  }
  for (std::size_t i = stream->handed; i < held.size(); ++i) {
    if (!stamps.IsStamped(i)) continue;
    const auto off = static_cast<double>(held.time_ns[i] - even.time_ns[i]);
    clock->squares_ns2 += off * off;
    ++clock->judged;
  }
  // A batch with irregular stamps keeps its stamps, unless even times are asked for.
  const bool can_be_even = how_ == TimeStamps::kRegular || even.kind != StampKind::kIrregular;
  if (clock->judgement != Judgement::kEven) return true;
  clock->even_ns = can_be_even ? std::move(even.time_ns) : held.time_ns;
  std::int64_t last_ns = stream->last_ns;
  for (std::size_t i = stream->handed; i < held.size(); ++i) {
    clock->even_ns[i] = last_ns = std::max(last_ns, clock->even_ns[i]);
  }
  return true;
}

void EvenSource::Settle(bool at_end) {
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
  holds_ = false;
  std::vector<const Stream*> judged;
  for (const Triad triad : kTriads) {
    Stream& stream = streams_[triad];
    if (stream.held.size() == 0) continue;
    const auto same = std::find_if(judged.begin(), judged.end(), [&](const Stream* other) {
      return stream.SharesStampsWith(*other);
    });
    if (same != judged.end()) {
      stream.clock = (*same)->clock;
    } else if (Judge(triad)) {
      judged.push_back(&stream);
    }
    if (stream.clock.judgement != Judgement::kEven) continue;
    holds_ = true;
    if (at_end || stream.waiting() == 0) continue;
    const std::size_t kept = std::min(kOverlap, stream.waiting() / 2);
    until_ns = std::min(until_ns, stream.held.time_ns[stream.held.size() - 1 - kept]);
  }
  for (Stream& stream : streams_) {
    const std::vector<std::int64_t>& stamps = stream.held.time_ns;
    stream.ready = static_cast<std::size_t>(
        std::upper_bound(
            stamps.begin() + static_cast<std::ptrdiff_t>(stream.handed), stamps.end(), until_ns) -
        stamps.begin());
  }
}

bool EvenSource::HandOver(std::vector<SampleBlock>* blocks) {
  const Stream* lagging = nullptr;
  Triad triad = Triad::kAccelerometer;
  for (const Triad each : kTriads) {
    const Stream& stream = streams_[each];
    if (stream.handed >= stream.ready) continue;
    const auto next_ns = [](const Stream& of) { return of.times_ns()[of.handed]; };
    if (lagging != nullptr && next_ns(*lagging) <= next_ns(stream)) continue;
    lagging = &stream, triad = each;
  }
  if (lagging == nullptr) {
    for (Stream& stream : streams_) {
      if (stream.ready == 0) continue;
      const std::size_t stays = holds_ ? std::min(kOverlap, stream.handed) : 0;
      stream.held.EraseFront(stream.handed - stays);
      stream.handed = stays;
      stream.ready = 0;
    }
    return false;
  }
  Stream& stream = streams_[triad];
  const std::size_t end = std::min(stream.ready, stream.handed + kBlockSamples);
  SampleBlock& block = blocks->emplace_back(stream.held.View(triad, stream.handed, end));
  block.time_ns = stream.times_ns().subspan(stream.handed, end - stream.handed);
  stream.last_ns = block.time_ns.back();
  stream.handed = end;
  return true;
}

void EvenSource::Describe(StreamSummary* summary, Findings* findings) const {
  const Stream& stream = streams_[summary->triad];
  const Clock& clock = stream.clock;
  summary->stamps = clock.kind;
  summary->jitter_s = clock.judged > 0.0 ? 1e-9 * std::sqrt(clock.squares_ns2 / clock.judged)
                                         : stream.watch.jitter_s();
  summary->are_stamps_even = clock.judgement == Judgement::kEven;
  if (clock.kind == StampKind::kRegular && !summary->are_stamps_even) return;
  if (!summary->are_stamps_even && clock.are_true) return;
  const std::string what =
      std::string(TriadName(summary->triad)) + ": time stamps are " +
      std::string(StampKindName(clock.kind)) + " (" + RoundedText(1e3 * summary->jitter_s, 3) +
      " ms RMS from even spacing at " + RoundedText(summary->rate_hz, 5) + " Hz)";
  Finding finding = summary->are_stamps_even
                        ? Finding(FindingCode::kEvenTimes,
                                  what + "; samples are treated as evenly spaced instead")
                        : Finding(FindingCode::kUnevenTimes,
                                  what + ", and are used as they are",
                                  "stamp samples by the sensor's own clock");
  findings->push_back(finding.About(summary->triad)
                          .With("jitter", summary->jitter_s, "s")
                          .With("rate", summary->rate_hz, "Hz"));
}

}  // namespace truetriad
