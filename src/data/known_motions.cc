// SPDX-License-Identifier: Apache-2.0
#include "data/known_motions.h"

#include <algorithm>
#include <string>
#include <utility>

namespace truetriad {
namespace {

std::vector<StaticPose>::iterator FindPose(int number, std::vector<StaticPose>* poses) {
  return std::find_if(
      poses->begin(), poses->end(), [&](const StaticPose& pose) { return pose.number == number; });
}

Error NoSuchPose(const std::string& key, int number, const PoseSet& set) {
  return BadInputError(set.source + ": " + key + " name pose " + std::to_string(number) +
                       ", which is none of the " + std::to_string(set.poses.size()) + " rests (" +
                       set.how + "; `truetriad inspect` lists them); give a pose of the list, or " +
                       "its rows as `first` and `last`");
}

bool Overlap(const StaticPose& pose, const StaticPose& other) {
  return pose.first_row <= other.last_row && other.first_row <= pose.last_row;
}

}  // namespace

RateMeans::RateMeans(const std::vector<StatedRate>& rates, const RecordingInfo& info, Triad leading)
    : rates_(rates) {
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    if (!rates_[i].at.rows.empty()) by_row_.push_back(i);
  }
  std::sort(by_row_.begin(), by_row_.end(), [this](std::size_t a, std::size_t b) {
    return rates_[a].at.rows.first < rates_[b].at.rows.first;
  });
  if (by_row_.empty()) return;
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  for (const std::size_t i : by_row_) {
    const StatedRate& rate = rates_[i];
    selection.ranges.push_back({rate.at.rows.first, rate.at.rows.last, rate.id, {}});
  }
  means_.emplace(selection, info, leading, "rates");
}

Status RateMeans::Validate() const { return means_ ? means_->Validate() : Status(); }

void RateMeans::Add(const std::vector<SampleBlock>& blocks, double spacing_ns) {
  if (means_) means_->Add(blocks, spacing_ns);
}

Status RateMeans::Finish(const PerTriad<Eigen::Vector3d>& resolution_raw,
                         std::vector<PerTriad<TriadPoseMoments>>* moments,
                         PoseSet* set) {
  if (rates_.empty()) return {};
  set->rates.resize(rates_.size());
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    set->rates[i].stated = rates_[i];
    if (!rates_[i].at.rows.empty()) continue;
    const auto pose = FindPose(rates_[i].at.pose, &set->poses);
    if (pose == set->poses.end()) return NoSuchPose("rates", rates_[i].at.pose, *set);
    set->rates[i].means = *pose;
  }
  PoseSet turning;
  turning.streams = set->streams;
  if (means_) {
    auto collected = means_->Finish(&set->warnings);
    TRUETRIAD_RETURN_IF_ERROR(collected);
    // Their noise by itself: a table that turns shakes the unit more than one that rests.
    std::vector<PerTriad<TriadPoseMoments>> turning_moments;
    for (CollectedPose& mean : *collected) {
      turning.poses.push_back(std::move(mean.pose));
      turning_moments.push_back(std::move(mean.moments));
    }
    FillCovariances(turning_moments, resolution_raw, &turning);
    for (std::size_t i = 0; i < by_row_.size(); ++i) {
      set->rates[by_row_[i]].means = turning.poses[i];
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < set->poses.size(); ++i) {
    const StaticPose& pose = set->poses[i];
    if (std::any_of(set->rates.begin(), set->rates.end(), [&](const KnownRate& rate) {
          return Overlap(pose, rate.means);
        })) {
      continue;
    }
    if (kept != i) {
      set->poses[kept] = std::move(set->poses[i]);
      (*moments)[kept] = std::move((*moments)[i]);
    }
    ++kept;
  }
  set->poses.resize(kept);
  moments->resize(kept);
  if (kept > 0) {
    FillCovariances(*moments, resolution_raw, set);
  } else {
    set->streams = turning.streams;
  }
  return {};
}

Status TakeRates(const std::vector<StatedRate>& rates, PoseSet* set) {
  for (const StatedRate& rate : rates) {
    if (!rate.at.rows.empty()) {
      return BadInputError(set->source + ": is a table of means, but a rate is stated for rows " +
                           std::to_string(rate.at.rows.first) + " to " +
                           std::to_string(rate.at.rows.last) +
                           "; state each for one row of it, as `pose: N` from 1 on");
    }
    const auto pose = FindPose(rate.at.pose, &set->poses);
    if (pose == set->poses.end()) return NoSuchPose("rates", rate.at.pose, *set);
    set->rates.push_back({rate, std::move(*pose)});
    set->poses.erase(pose);
  }
  return {};
}

std::vector<RowSpan> SpansToKeep(const PoseSelection& selection) {
  std::vector<RowSpan> spans;
  for (const StatedTurn& turn : selection.turns) {
    if (!turn.at.rows.empty()) spans.push_back(turn.at.rows);
  }
  for (const StatedRate& rate : selection.rates) {
    if (!rate.at.rows.empty()) spans.push_back(rate.at.rows);
  }
  return spans;
}

Status FinishTurns(const PoseSelection& selection, const MoveRecorder& recorder, PoseSet* set) {
  std::vector<RecordedMove> spans = recorder.Spans(*set);
  std::size_t span = 0;
  for (const StatedTurn& stated : selection.turns) {
    KnownTurn& turn = set->turns.emplace_back();
    turn.stated = stated;
    if (!stated.at.rows.empty()) {
      if (stated.at.rows.last > recorder.last_row()) {
        return BadInputError(
            set->source + ": turns name rows " + std::to_string(stated.at.rows.first) + " to " +
            std::to_string(stated.at.rows.last) + ", but the last row with readings is " +
            std::to_string(recorder.last_row()) + "; rows count from 0 and without the header");
      }
      if (span < spans.size()) turn.move = std::move(spans[span++]);
      continue;
    }
    const auto pose = FindPose(stated.at.pose, &set->poses);
    const auto from = static_cast<std::size_t>(pose - set->poses.begin());
    if (from + 1 >= set->poses.size()) return NoSuchPose("turns", stated.at.pose, *set);
    if (from < set->moves.size()) turn.move = set->moves[from];
  }
  for (RecordedMove& move : set->moves) {
    const StaticPose& before = set->poses[move.from];
    const StaticPose& after = set->poses[move.from + 1];
    for (const KnownRate& rate : set->rates) {
      if (rate.means.first_row <= before.last_row || rate.means.last_row >= after.first_row) {
        continue;
      }
      move.fault = "a known rate was held during it, whose readings count once";
    }
  }
  return {};
}

}  // namespace truetriad
