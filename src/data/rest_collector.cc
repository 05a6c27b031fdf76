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
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace {

// Chosen: a share of a triad's range over all attitudes, which is 2 g for an accelerometer. The
// ends of a rest are at most this far, 0.6 deg, from its middle.
constexpr double kMovedShare = 0.005;
// Chosen: a share of the same range. Moving by 3 deg RMS, as in the hand, makes a rest's mean
// useless.
constexpr double kWanderShare = 0.03;
// Chosen: four rests determine by how much readings differ from attitude to attitude.
constexpr std::size_t kFewestRests = 4;

// How far a triad moves within one rest, per axis, raw unit.
struct Movement {
  Eigen::Array3d ends = Eigen::Array3d::Zero();    // Largest |outer eighth - middle half|.
  Eigen::Array3d wander = Eigen::Array3d::Zero();  // RMS within the middle half.
  Eigen::Array3d noise = Eigen::Array3d::Zero();   // White noise of an eighth.
};

std::optional<Movement> MovementOf(const TriadPoseMoments& moments) {
  const std::vector<Eigen::Vector3d>& eighths = moments.eighths_raw;
  if (eighths.size() != kEighths) return std::nullopt;
  Movement movement;
  const Eigen::Vector3d middle = MeanOfMiddleHalf(eighths);
  for (std::size_t part = 2; part < 6; ++part) {
    movement.wander += 0.25 * (eighths[part] - middle).array().square();
  }
  movement.wander = movement.wander.sqrt();
  for (const std::size_t part : {0, 1, 6, 7}) {
    movement.ends = movement.ends.max((eighths[part] - middle).array().abs());
  }
  movement.noise = NoiseOfEighth(moments);
  return movement;
}

// The largest range of the rests' means over the axes: the effect of turning the unit.
double RangeOf(Triad triad, const PoseSet& set) {
  Eigen::Array3d low = Eigen::Array3d::Zero(), high = Eigen::Array3d::Zero();
  bool first = true;
  for (const StaticPose& pose : set.poses) {
    if (!pose.triads[triad]) continue;
    const Eigen::Array3d mean = pose.triads[triad]->mean_raw.array();
    low = first ? mean : low.min(mean);
    high = first ? mean : high.max(mean);
    first = false;
  }
  return (high - low).maxCoeff();
}

struct MovingRests {
  std::vector<bool> moves;  // Whether the triad moves, by pose.
  std::size_t known = 0;
  double largest_raw = 0.0;
};

MovingRests FindMoving(Triad triad,
                       const std::vector<PerTriad<TriadPoseMoments>>& moments,
                       const PoseSet& set) {
  MovingRests found;
  found.moves.assign(moments.size(), false);
  std::vector<std::optional<Movement>> movements;
  for (const PerTriad<TriadPoseMoments>& pose : moments) {
    movements.push_back(MovementOf(pose[triad]));
    if (movements.back()) ++found.known;
  }
  if (found.known < kFewestRests) return found;
  const auto usual = [&movements](Eigen::Array3d Movement::*of) {
    Eigen::Array3d medians;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const auto& movement : movements) {
        if (movement) values.push_back(((*movement).*of)[axis]);
      }
      medians[axis] = Median(std::move(values));
    }
    return medians;
  };
  const double range = RangeOf(triad, set);
  // If noise is below a step, a reading changes to the next step by chance.
  const Eigen::Array3d step = set.Find(triad)->resolution_raw.array();
  const Eigen::Array3d noise = kClearFactor * usual(&Movement::wander).max(usual(&Movement::noise));
  const Eigen::Array3d limit = noise.max(kMovedShare * range).max(step);
  for (std::size_t i = 0; i < movements.size(); ++i) {
    if (!movements[i]) continue;
    const auto& [ends, wander, own_noise] = *movements[i];
    const Eigen::Array3d wander_limit =
        (kClearFactor * own_noise).max(kWanderShare * range).max(step);
    found.moves[i] = (ends > limit).any() || (wander > wander_limit).any();
    if (found.moves[i]) found.largest_raw = std::max(found.largest_raw, ends.maxCoeff());
  }
  return found;
}

// Removes a triad's readings from rests in which they change while those of the other triad do not.
// The unit is then still, but a clock is wrong by a part of a second, so that the end of one turn
// or the beginning of the next falls into the rest; or a magnet passes.
//
// A triad moves in a rest if an outer eighth (two on each side) differs from the middle half by
// over kMovedShare of the range over all rests, and by over kClearFactor times both the median
// drift of the rests' middles and their median noise. A triad also moves if the middle itself
// drifts by over kWanderShare of the range and kClearFactor times its noise. Differences of up to
// one step of the sensor do not count.
//
// Adds a finding that names the rests. If a triad moves in most rests, all its readings stay,
// without a finding. Returns whether any reading was removed. `moments[i]` belongs to
// set->poses[i]; the poses need their numbers.
bool RemoveMovingReadings(const std::vector<PerTriad<TriadPoseMoments>>& moments, PoseSet* set) {
  PerTriad<MovingRests> found;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (set->Find(triad) == nullptr) return false;
    found[triad] = FindMoving(triad, moments, *set);
    if (found[triad].known < kFewestRests) return false;
  }
  // If both triads move in a rest, clocks are not the reason.
  for (std::size_t i = 0; i < set->poses.size(); ++i) {
    auto accelerometer = found[Triad::kAccelerometer].moves[i];
    auto magnetometer = found[Triad::kMagnetometer].moves[i];
    if (!accelerometer || !magnetometer) continue;
    accelerometer = magnetometer = false;
  }
  bool removed = false;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const MovingRests& rests = found[triad];
    std::vector<StaticPose*> moving;
    for (std::size_t i = 0; i < set->poses.size(); ++i) {
      if (rests.moves[i]) moving.push_back(&set->poses[i]);
    }
    // If a sensor moves in most rests, it is unknown which of the two is right.
    if (moving.empty() || 2 * moving.size() > rests.known) continue;
    if (!Acts(Mechanism::kMovingReadings)) continue;
    const Triad still =
        triad == Triad::kAccelerometer ? Triad::kMagnetometer : Triad::kAccelerometer;
    const std::string& unit = set->Find(triad)->unit.name;
    set->findings.push_back(
        Finding(
            FindingCode::kMovingReadings,
            std::string(TriadName(triad)) + ": readings change within " +
                std::to_string(moving.size()) + " of " + std::to_string(rests.known) + " rests, " +
                Format("by up to %.2g ", rests.largest_raw) + unit + ", while those of the " +
                std::string(TriadName(still)) + " do not; the " + std::string(TriadName(triad)) +
                "'s readings in these poses are skipped (" +
                Named(moving.size(), [&](auto k) { return std::to_string(moving[k]->number); }) +
                ")")
            .About(triad)
            .With("moving", static_cast<double>(moving.size()))
            .With("rests", static_cast<double>(rests.known))
            .With("largest", rests.largest_raw, unit));
    for (StaticPose* pose : moving) pose->triads[triad].reset();
    removed = true;
  }
  return removed;
}

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
  if (RemoveMovingReadings(moments, set)) FillCovariances(moments, step_raw, set);
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
