// SPDX-License-Identifier: Apache-2.0
#include "data/given_poses.h"

#include <algorithm>
#include <utility>

#include <glog/logging.h>

#include "base/messages.h"
#include "data/rows_in_time.h"

namespace truetriad {
namespace {

// Chosen: a window of ten samples has a variance of nine degrees of freedom and hardly any drift.
constexpr std::int64_t kWindowSamples = 10;

std::string SecondsText(std::int64_t time_ns) {
  return Format("%.3f", 1e-9 * static_cast<double>(time_ns));
}

}  // namespace

GivenPoses::GivenPoses(const PoseSelection& selection,
                       const RecordingInfo& info,
                       Triad leading,
                       const StreamMonitor& monitor,
                       std::string key,
                       std::vector<RangeOrigin> origins)
    : selection_(selection),
      info_(info),
      leading_(leading),
      key_(std::move(key)),
      origins_(std::move(origins)),
      monitor_(monitor),
      range_used_(selection.ranges.size(), false) {}

Status GivenPoses::Validate() const {
  if (selection_.kind == PoseSelectionKind::kEveryN && selection_.every < 1) {
    return Error(ErrorCode::kInvalidValue,
                 "poses: { every: " + std::to_string(selection_.every) +
                     " }: expected a number of rows of at least 1");
  }
  if (selection_.kind == PoseSelectionKind::kColumn && !info_.Find(leading_)->has_pose_column) {
    return Error(ErrorCode::kMissingColumn,
                 {info_.path},
                 "has no column with pose numbers; expected a column `pose` (0 = "
                 "moving), or name yours with `poses: { column: NAME }`");
  }
  if (selection_.kind != PoseSelectionKind::kRanges) return {};
  for (std::size_t i = 0; i < selection_.ranges.size(); ++i) {
    const bool follows = i > 0 ? Begin(i) > End(i - 1) : IsByTime() || Begin(i) >= 0;
    if (follows && End(i) >= Begin(i)) continue;
    if (IsByTime()) {
      return Error(ErrorCode::kInvalidValue,
                   Spoken(i) + " does not begin after the end of " + Spoken(i - 1) +
                       "; expected times without overlap");
    }
    return Error(ErrorCode::kInvalidValue,
                 Spoken(i) + " is not a range" +
                     (i == 0 ? "" : " that begins after row " + std::to_string(End(i - 1))) +
                     "; expected first <= last, both 0-based, in file order, without overlap");
  }
  return {};
}

std::int64_t GivenPoses::Begin(std::size_t range) const {
  return IsByTime() ? origins_[range].times.start_ns : selection_.ranges[range].first;
}

std::int64_t GivenPoses::End(std::size_t range) const {
  return IsByTime() ? origins_[range].times.end_ns : selection_.ranges[range].last;
}

std::string GivenPoses::Spoken(std::size_t range) const {
  const bool has_origin = !origins_.empty() && !origins_[range].stated_in.empty();
  std::string spoken =
      has_origin ? origins_[range].stated_in : key_ + ": range " + std::to_string(range + 1);
  if (IsByTime()) {
    return spoken + " (" + SecondsText(Begin(range)) + " to " + SecondsText(End(range)) + " s)";
  }
  return spoken + " (rows " + std::to_string(Begin(range)) + " to " + std::to_string(End(range)) +
         ")";
}

// Label of the pose that row `i` belongs to; unset: none. Neighbouring rows with the same label
// form one pose.
std::optional<std::int64_t> GivenPoses::Label(const SampleBlock& block, std::size_t i) {
  const std::int64_t row = block.row[i];
  switch (selection_.kind) {
    case PoseSelectionKind::kEveryRow:
      return row;
    case PoseSelectionKind::kEveryN:
      return row / selection_.every;
    case PoseSelectionKind::kColumn:
      if (block.pose.empty() || block.pose[i] == 0) return std::nullopt;
      return block.pose[i];
    case PoseSelectionKind::kRanges: {
      const std::size_t count = selection_.ranges.size();
      const std::int64_t at = IsByTime() ? block.time_ns[i] : row;
      while (range_ < count && End(range_) < at) ++range_;
      if (range_ == count || at < Begin(range_)) return std::nullopt;
      range_used_[range_] = true;
      return static_cast<std::int64_t>(range_);
    }
    case PoseSelectionKind::kDetect:
    case PoseSelectionKind::kMotion:
    case PoseSelectionKind::kSweep:
      break;
  }
  LOG(FATAL) << "not a given selection";
  return std::nullopt;
}

void GivenPoses::AddSamples(const SampleBlock& block,
                            std::size_t begin,
                            std::size_t end,
                            OpenPose* pose) {
  TriadWindow& window = pose->window[block.triad];
  while (begin < end) {
    const auto room = static_cast<std::size_t>(kWindowSamples - window.count);
    const std::size_t stop = std::min(end, begin + room);
    window.Merge(Summarize(block, begin, stop));
    begin = stop;
    if (window.count == kWindowSamples) {
      pose->accumulator.Add(block.triad, window);
      window = TriadWindow();
    }
  }
}

void GivenPoses::AddLeading(const SampleBlock& block) {
  for (std::size_t begin = 0; begin < block.x.size();) {
    const std::optional<std::int64_t> label = Label(block, begin);
    std::size_t end = begin + 1;
    while (end < block.x.size() && Label(block, end) == label) ++end;
    if (!open_.empty() && open_.back().label != label) open_.back().closed = true;
    if (label) {
      if (open_.empty() || open_.back().closed) {
        OpenPose& pose = open_.emplace_back();
        pose.label = *label;
        pose.first_row = block.row[begin], pose.first_ns = block.time_ns[begin];
      }
      OpenPose& pose = open_.back();
      pose.last_row = block.row[end - 1], pose.last_ns = block.time_ns[end - 1];
      AddSamples(block, begin, end, &pose);
    }
    begin = end;
  }
  if (block.x.empty()) return;
  last_row_ = block.row.back(), last_ns_ = block.time_ns.back();
}

void GivenPoses::AddWaiting(Triad triad, bool at_end) {
  Waiting& waiting = waiting_[triad];
  const bool by_row = IsByRow(triad);
  const std::int64_t reach = Reach(by_row);
  const std::vector<std::int64_t>& keys = by_row ? waiting.samples.row : waiting.samples.time_ns;
  const std::int64_t passed = by_row ? last_row_ : last_ns_ - reach;
  const SampleBlock block = waiting.samples.View(triad, 0, waiting.samples.size());
  std::size_t i = 0;
  for (; i < keys.size() && (at_end || keys[i] <= passed);) {
    waiting.current = std::max(waiting.current, finished_);
    const auto at = static_cast<std::size_t>(waiting.current - finished_);
    if (at == open_.size()) {
      ++i;  // No pose has this sample, and the leading stream has passed it.
      continue;
    }
    OpenPose& pose = open_[at];
    const std::int64_t first = (by_row ? pose.first_row : pose.first_ns) - reach;
    const std::int64_t last = (by_row ? pose.last_row : pose.last_ns) + reach;
    if (keys[i] > last && pose.closed) {
      ++waiting.current;
      continue;
    }
    std::size_t end = i;
    while (end < keys.size() && keys[end] >= first && keys[end] <= last &&
           (at_end || keys[end] <= passed)) {
      ++end;
    }
    if (end > i) AddSamples(block, i, end, &pose);
    i = std::max(end, i + 1);
  }
  waiting.samples.EraseFront(i);
}

// A gyroscope needs rests and the turns between them; the single rows of a log are neither.
Status GivenPoses::CheckRowsAreRests() const {
  if (selection_.kind != PoseSelectionKind::kEveryRow || !selection_.moves || !info_.has_time ||
      poses_.size() <= kMostRowsAsRests) {
    return {};
  }
  return Error(ErrorCode::kTooMany,
               {info_.path},
               "`poses: every_row` gives more than " + std::to_string(kMostRowsAsRests) +
                   " rests, with no turns between them for the gyroscope; state `poses: { "
                   "detect: auto }` if the unit rests now and then, `poses: { motion: { "
                   "spacing_s: 0.1 } }` if it is tumbled, or disable the gyroscope");
}

Status GivenPoses::Add(const std::vector<SampleBlock>& blocks) {
  for (const SampleBlock& block : blocks) {
    if (block.triad == leading_) {
      AddLeading(block);
      continue;
    }
    Waiting& waiting = waiting_[block.triad];
    waiting.samples.Append(block);
    if (block.row.empty()) continue;
    waiting.latest_key = IsByRow(block.triad) ? block.row.back() : block.time_ns.back();
  }
  for (const StreamInfo& stream : info_.streams) {
    if (stream.triad != leading_) AddWaiting(stream.triad, false);
  }
  while (!open_.empty() && IsOver(open_.front())) FinishFirst();
  return CheckRowsAreRests();
}

// True when no stream can add to the pose any more.
bool GivenPoses::IsOver(const OpenPose& pose) const {
  if (!pose.closed) return false;
  return std::all_of(info_.streams.begin(), info_.streams.end(), [&](const StreamInfo& stream) {
    if (stream.triad == leading_) return true;
    const Waiting& waiting = waiting_[stream.triad];
    const bool by_row = IsByRow(stream.triad);
    const std::int64_t last = by_row ? pose.last_row : pose.last_ns + Reach(by_row);
    const auto& keys = by_row ? waiting.samples.row : waiting.samples.time_ns;
    return (keys.empty() ? waiting.latest_key : keys.front()) > last;
  });
}

bool GivenPoses::IsByRow(Triad triad) const {
  return info_.Find(triad)->file == info_.Find(leading_)->file;
}

std::int64_t GivenPoses::Reach(bool by_row) const {
  return by_row ? 0 : static_cast<std::int64_t>(0.5 * monitor_.spacing_ns());
}

void GivenPoses::FinishFirst() {
  OpenPose& open = open_.front();
  for (const Triad triad : kTriads) open.accumulator.Add(triad, open.window[triad]);
  CollectedPose& done = poses_.emplace_back();
  done.pose = open.accumulator.Finish(leading_, &done.moments);
  if (selection_.kind == PoseSelectionKind::kColumn) done.pose.id = std::to_string(open.label);
  if (selection_.kind == PoseSelectionKind::kRanges) {
    const PoseRange& range = selection_.ranges[static_cast<std::size_t>(open.label)];
    done.pose.id = range.id;
    done.pose.face_up = range.face_up;
  }
  last_block_rows_ = open.last_row - open.first_row + 1;
  open_.pop_front();
  ++finished_;
}

std::optional<std::int64_t> GivenPoses::judged_before_ns() const {
  if (last_row_ < 0) return std::nullopt;
  // A closed pose still waits for streams that lag behind.
  for (const OpenPose& pose : open_) {
    if (pose.closed) return std::min(last_ns_, pose.first_ns);
  }
  return last_ns_;
}

Result<std::vector<CollectedPose>> GivenPoses::Finish(Findings* findings) {
  if (!open_.empty()) open_.back().closed = true;
  for (const StreamInfo& stream : info_.streams) {
    if (stream.triad != leading_) AddWaiting(stream.triad, true);
  }
  while (!open_.empty()) FinishFirst();
  for (std::size_t i = 0; i < range_used_.size(); ++i) {
    // If a range lies mostly beyond the end, it is meant for another recording. If it lies a bit
    // beyond, a slow sensor may have ended early.
    const std::int64_t last = IsByTime() ? last_ns_ : last_row_;
    if (range_used_[i] && End(i) - last <= last - Begin(i)) continue;
    return Error(
        ErrorCode::kNotInRecording,
        Spoken(i) + (range_used_[i] ? " lies mostly beyond the last reading" : " has no reading") +
            " of the " + std::string(TriadName(leading_)) + "; " + info_.Find(leading_)->file +
            (IsByTime() ? " ends at " + SecondsText(last) + " s"
                        : " has data rows 0 to " + std::to_string(last)));
  }
  // If the last block has less than half of the rows, it is no pose: its mean would be less exact.
  if (selection_.kind == PoseSelectionKind::kEveryN && poses_.size() > 1 &&
      2 * last_block_rows_ < selection_.every) {
    poses_.pop_back();
    findings->push_back(Finding(FindingCode::kRowsLeftOver,
                                "the last " + Counted(last_block_rows_, "row") +
                                    " fill less than half a pose of " +
                                    std::to_string(selection_.every) + " rows and are skipped")
                            .With("rows", static_cast<double>(last_block_rows_)));
  }
  return std::move(poses_);
}

Error GivenPoses::NoPose(const PoseSet& set) const {
  return NotEnoughError(
      Finding(FindingCode::kNoPose, set.source + ": no row belongs to a pose (" + set.how + ")"));
}

}  // namespace truetriad
