// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "data/clock_lags.h"
#include "data/collector.h"
#include "data/known_motions.h"
#include "data/move_recorder.h"
#include "data/pose_statistics.h"
#include "data/repeats.h"
#include "data/stream_checks.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace {

// Adds findings for the turns with faults; turns with the same fault share one finding.
void AddFaultsOfMoves(PoseSet* set) {
  std::vector<std::pair<Finding, std::vector<const RecordedMove*>>> reasons;
  for (const RecordedMove& move : set->moves) {
    if (!move.fault) continue;
    const auto same = std::find_if(reasons.begin(), reasons.end(), [&move](const auto& reason) {
      return reason.first.text == move.fault->text;
    });
    if (same != reasons.end()) {
      same->second.push_back(&move);
    } else {
      reasons.push_back({*move.fault, {&move}});
    }
  }
  std::size_t unnamed = 0;
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    const auto& [fault, moves] = reasons[i];
    Finding finding = fault;
    finding.About(Triad::kGyroscope);
    if (i >= kMostPlacesNamed) {
      unnamed += moves.size();
      continue;
    }
    const auto number = [set](std::size_t pose) { return std::to_string(set->poses[pose].number); };
    if (moves.size() == 1) {
      const std::size_t from = moves.front()->from;
      finding.AtPose(set->poses[from].number);
      finding.text = "the turn from pose " + number(from) + " to pose " + number(from + 1) +
                     " is skipped: " + fault.text;
      set->findings.push_back(std::move(finding));
      continue;
    }
    const auto from = [&](std::size_t k) { return number(moves[k]->from); };
    finding.With("turns", static_cast<double>(moves.size())).text =
        std::to_string(moves.size()) + " turns are skipped, those starting at poses " +
        Named(moves.size(), from) + ": " + fault.text;
    set->findings.push_back(std::move(finding));
  }
  if (unnamed > 0) {
    set->findings.push_back(
        Finding(reasons[kMostPlacesNamed].first.code,
                std::to_string(unnamed) + " more turns are skipped for similar reasons")
            .About(Triad::kGyroscope)
            .With("turns", static_cast<double>(unnamed)));
  }
}

// Sets the share of the recording in which the unit rested.
void SetStaticShare(PoseSet* set) {
  double static_s = 0.0;
  for (StaticPose& pose : set->poses) {
    if (!set->has_time) pose.start_ns = pose.end_ns = 0;
    static_s += pose.duration_s();
  }
  if (set->duration_s > 0.0) set->static_share = std::min(1.0, static_s / set->duration_s);
}

// Collects detected or given rests, and the gyroscope's readings between them.
class RestCollector : public Collector {
 public:
  // `monitors` belong to the caller.
  RestCollector(std::unique_ptr<RestFinder> finder,
                const PoseSelection& selection,
                const RecordingInfo& info,
                const PerTriad<StreamMonitor*>& monitors,
                Triad leading)
      : finder_(std::move(finder)),
        selection_(selection),
        monitors_(monitors),
        rates_(selection.rates, info, leading, *monitors[leading]),
        records_moves_((selection.moves || !selection.turns.empty()) && info.has_time &&
                       info.Find(Triad::kGyroscope) != nullptr),
        moves_(leading, SpansToKeep(selection)),
        compares_clocks_(info.has_time && info.streams.size() > 1) {}

  Status Validate() const override;
  Status Add(const std::vector<SampleBlock>& blocks) override;
  Status Finish(PoseSet* set) override;

 private:
  std::unique_ptr<RestFinder> finder_;
  PoseSelection selection_;
  PerTriad<StreamMonitor*> monitors_;
  RateMeans rates_;
  bool records_moves_;
  MoveRecorder moves_;
  std::size_t rests_dropped_ = 0;
  bool compares_clocks_;
  ClockLagFinder clock_lags_;
};

Status RestCollector::Validate() const {
  TRUETRIAD_RETURN_IF_ERROR(finder_->Validate());
  return rates_.Validate();
}

Status RestCollector::Add(const std::vector<SampleBlock>& blocks) {
  for (const SampleBlock& block : blocks) {
    if (records_moves_) moves_.Add(block);
    if (compares_clocks_) clock_lags_.Add(block);
  }
  if (selection_.ignores_gyroscope) {
    std::vector<SampleBlock> of_rests = blocks;
    std::erase_if(of_rests, [&](const auto& block) { return selection_.Ignores(block.triad); });
    TRUETRIAD_RETURN_IF_ERROR(finder_->Add(of_rests));
  } else {
    TRUETRIAD_RETURN_IF_ERROR(finder_->Add(blocks));
  }
  TRUETRIAD_RETURN_IF_ERROR(rates_.Add(blocks));
  if (!records_moves_) return {};
  const std::vector<CollectedPose>& complete = finder_->poses();
  while (rests_dropped_ < complete.size()) moves_.DropRest(complete[rests_dropped_++].pose);
  if (const auto judged_ns = finder_->judged_before_ns()) moves_.DropLongMove(*judged_ns);
  return {};
}

Status RestCollector::Finish(PoseSet* set) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<CollectedPose> collected, finder_->Finish(&set->findings));
  std::vector<PerTriad<TriadPoseMoments>> moments;
  for (CollectedPose& pose : collected) {
    set->poses.push_back(std::move(pose.pose));
    moments.push_back(std::move(pose.moments));
  }
  if (set->poses.empty() && selection_.rates.empty()) return finder_->NoPose(*set);
  PerTriad<Eigen::Vector3d> step_raw;
  step_raw.items.fill(Eigen::Vector3d::Zero());
  for (StreamSummary& stream : set->streams) {
    step_raw[stream.triad] = monitors_[stream.triad]->rest_step_raw();
    if (selection_.kind != PoseSelectionKind::kEveryRow) continue;
    stream.resolution_raw.setConstant(StepOfRows(stream.triad, set->poses));
    step_raw[stream.triad] = stream.resolution_raw;
  }
  FillCovariances(moments, step_raw, set);
  TRUETRIAD_ASSIGN_OR_RETURN(const bool had_flat, RemoveFlatReadings(step_raw, &moments, set));
  if (had_flat) FillCovariances(moments, step_raw, set);

  for (std::size_t i = 0; i < set->poses.size(); ++i) {
    set->poses[i].number = static_cast<int>(i + 1);
  }
  if (compares_clocks_) {
    const Findings lags = FindClockLags(clock_lags_, set);
    set->findings.insert(set->findings.end(), lags.begin(), lags.end());
  }
  TRUETRIAD_RETURN_IF_ERROR(rates_.Finish(step_raw, &moments, set));
  if (records_moves_) set->moves = moves_.Moves(*set);
  BreakMovesAtJoints(set);
  if (records_moves_) TRUETRIAD_RETURN_IF_ERROR(FinishTurns(selection_, moves_, set));
  SetStaticShare(set);
  AddFaultsOfMoves(set);
  return {};
}

}  // namespace

std::unique_ptr<Collector> MakeRestCollector(std::unique_ptr<RestFinder> finder,
                                             const PoseSelection& selection,
                                             const RecordingInfo& info,
                                             const PerTriad<StreamMonitor*>& monitors,
                                             Triad leading) {
  return std::make_unique<RestCollector>(std::move(finder), selection, info, monitors, leading);
}

}  // namespace truetriad
