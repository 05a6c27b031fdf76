// SPDX-License-Identifier: Apache-2.0
#include "data/known_motions.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/messages.h"
#include "data/stream_checks.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

std::vector<StaticPose>::iterator FindPose(int number, std::vector<StaticPose>* poses) {
  return std::find_if(
      poses->begin(), poses->end(), [&](const StaticPose& pose) { return pose.number == number; });
}

Error NoSuchPose(const std::string& key, const MotionPlace& at, const PoseSet& set) {
  return ErrorIn(ErrorCode::kNotInRecording,
                 (at.stated_in.empty() ? "" : at.stated_in + ": ") + set.source,
                 key + " name pose " + std::to_string(at.pose) + ", which is not among the " +
                     std::to_string(set.poses.size()) + " rests (" + set.how +
                     "; `truetriad inspect` lists them); give a listed pose, or " +
                     "rows as `first` and `last`, or a time as `start_s` and `end_s`");
}

Error NoRestAfter(const MotionPlace& at, const PoseSet& set) {
  return ErrorIn(ErrorCode::kNotInRecording,
                 (at.stated_in.empty() ? "" : at.stated_in + ": ") + set.source,
                 "a turn is stated after pose " + std::to_string(at.pose) +
                     ", but no rest follows that pose (" + set.how +
                     "; `truetriad inspect` lists the rests); give the pose before the turn, or "
                     "the turn's rows as `first` and `last`, or its time as `start_s` and `end_s`");
}

// Error: the log does not contain the whole turn.
Status CheckIsInLog(const MotionPlace& at, const MoveRecorder& recorder, const PoseSet& set) {
  const std::string where = at.stated_in.empty() ? "turns" : at.stated_in;
  if (at.times.empty()) {
    if (at.rows.last <= recorder.last_row()) return {};
    return ErrorIn(ErrorCode::kNotInRecording,
                   where,
                   "a turn is stated for rows " + std::to_string(at.rows.first) + " to " +
                       std::to_string(at.rows.last) + ", but the last row with readings of " +
                       set.source + " is " + std::to_string(recorder.last_row()) +
                       "; rows count from 0, without the header");
  }
  if (at.times.start_ns >= recorder.first_ns() && at.times.end_ns <= recorder.last_ns()) return {};
  const auto seconds = [](std::int64_t time_ns) {
    return std::to_string(1e-9 * static_cast<double>(time_ns));
  };
  return ErrorIn(ErrorCode::kNotInRecording,
                 where,
                 "a turn is stated for " + seconds(at.times.start_ns) + " to " +
                     seconds(at.times.end_ns) + " s, but " + set.source + " has readings from " +
                     seconds(recorder.first_ns()) + " to " + seconds(recorder.last_ns()) + " s");
}

bool Overlap(const StaticPose& pose, const StaticPose& other) {
  return pose.first_row <= other.last_row && other.first_row <= pose.last_row;
}

Eigen::Vector3d MeanOf(const std::vector<Eigen::Vector3d>& vectors) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vector : vectors) sum += vector;
  return sum / static_cast<double>(vectors.size());
}

// A held rate is as large in the first and last eighth of its interval as in the middle. If the
// difference is over 0.1 %, and over kClearFactor times both the noise of an eighth and the drift
// of the middle, the table accelerates; the eighth would change the mean by 1/8 of the difference.
constexpr double kRampShare = 0.001;

std::string WhereOf(const StatedRate& rate, const PoseSet& set) {
  return (rate.at.stated_in.empty() ? "rates" : rate.at.stated_in) + ": " + set.source + ": rate" +
         (rate.id.empty() ? "" : " " + rate.id);
}

Status CheckIsHeld(const StatedRate& rate, const TriadPoseMoments& moments, const PoseSet& set) {
  const std::vector<Eigen::Vector3d>& eighths = moments.eighths_raw;
  const double stated = rate.rate_radps.norm();
  if (eighths.size() != kEighths || stated == 0.0) return {};
  const Eigen::Vector3d middle = MeanOfMiddleHalf(eighths);
  double wander = NoiseOfEighth(moments).matrix().norm();
  for (std::size_t part = 2; part < 6; ++part) {
    wander = std::max(wander, (eighths[part] - middle).norm());
  }
  const double held = (moments.mean_raw + middle).norm();
  for (const bool is_first : {true, false}) {
    const Eigen::Vector3d end = is_first ? eighths.front() : eighths.back();
    const double missed = (end - middle).norm();
    if (missed <= std::max(kRampShare * held, kClearFactor * wander)) continue;
    return ErrorIn(ErrorCode::kNotInRecording,
                   WhereOf(rate, set),
                   std::string("the readings in the ") + (is_first ? "first" : "last") +
                       Format(" eighth of its time differ from the middle by %.2g %% of the rate, "
                              "so the table is not at constant speed there; ",
                              100.0 * missed / held) +
                       (is_first ? "begin its interval later" : "end its interval earlier"));
  }
  return {};
}

// Checks the ends of all intervals together. An acceleration of the table, or a low-pass, makes the
// ends of all intervals differ from their middles by the same share of the rate. A regression on
// the rate finds this share; bias and drift do not change it.
Status CheckRamps(const std::vector<PerTriad<TriadPoseMoments>>& turning, const PoseSet& set) {
  for (const bool is_first : {true, false}) {
    std::vector<Eigen::Vector3d> rates, missing;
    for (const PerTriad<TriadPoseMoments>& moments : turning) {
      const std::vector<Eigen::Vector3d>& eighths = moments[Triad::kGyroscope].eighths_raw;
      if (eighths.size() != kEighths) continue;
      const Eigen::Vector3d middle = MeanOfMiddleHalf(eighths);
      rates.emplace_back(moments[Triad::kGyroscope].mean_raw + middle);
      missing.emplace_back((is_first ? eighths.front() : eighths.back()) - middle);
    }
    if (rates.size() < 3) return {};
    const Eigen::Vector3d rate = MeanOf(rates), missed = MeanOf(missing);
    double product = 0.0, held = 0.0, square = 0.0;
    for (std::size_t i = 0; i < rates.size(); ++i) {
      product += (missing[i] - missed).dot(rates[i] - rate);
      held += (rates[i] - rate).squaredNorm();
      square += (missing[i] - missed).squaredNorm();
    }
    if (!(held > 0.0)) return {};
    const double share = product / held;
    const double dof = 3.0 * static_cast<double>(rates.size()) - 4.0;
    const double sigma = std::sqrt(std::max(square - share * product, 0.0) / (dof * held));
    if (std::abs(share) <= std::max(kRampShare, kClearFactor * sigma)) continue;
    return Error(
        ErrorCode::kDoesNotMatch,
        {set.source},
        std::string("rates: the readings in the ") + (is_first ? "first" : "last") +
            Format(" eighth of the intervals differ from the middle by %.2g %% of the rate, ",
                   100.0 * std::abs(share)) +
            "so the table is not at constant speed there, or the sensor has not settled; " +
            (is_first ? "begin the intervals later" : "end the intervals earlier"));
  }
  return {};
}

}  // namespace

RateMeans::RateMeans(const std::vector<StatedRate>& rates,
                     const RecordingInfo& info,
                     Triad leading,
                     const StreamMonitor& monitor)
    : rates_(rates) {
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    if (!rates_[i].at.is_pose()) stretches_.push_back(i);
  }
  // All rates have rows or all have times, which Validate() checks.
  std::sort(stretches_.begin(), stretches_.end(), [this](std::size_t a, std::size_t b) {
    return std::pair(rates_[a].at.rows.first, rates_[a].at.times.start_ns) <
           std::pair(rates_[b].at.rows.first, rates_[b].at.times.start_ns);
  });
  if (stretches_.empty()) return;
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  std::vector<RangeOrigin> origins;
  for (const std::size_t i : stretches_) {
    const StatedRate& rate = rates_[i];
    selection.ranges.push_back({rate.at.rows.first, rate.at.rows.last, rate.id, {}});
    origins.push_back({rate.at.times, rate.at.stated_in});
  }
  means_.emplace(selection, info, leading, monitor, "rates", std::move(origins));
}

Status RateMeans::Validate() const {
  if (!means_) return {};
  const MotionPlace* by_rows = nullptr;
  const MotionPlace* by_time = nullptr;
  for (const std::size_t i : stretches_) {
    (rates_[i].at.times.empty() ? by_rows : by_time) = &rates_[i].at;
  }
  if (by_rows != nullptr && by_time != nullptr) {
    return ErrorIn(ErrorCode::kDoesNotMatch,
                   by_time->stated_in,
                   "is stated by time, but " +
                       (by_rows->stated_in.empty() ? "another rate" : by_rows->stated_in) +
                       " is stated by rows; state all rates the same way");
  }
  return means_->Validate();
}

Status RateMeans::Add(const std::vector<SampleBlock>& blocks) {
  return means_ ? means_->Add(blocks) : Status();
}

Status RateMeans::Finish(const PerTriad<Eigen::Vector3d>& resolution_raw,
                         std::vector<PerTriad<TriadPoseMoments>>* moments,
                         PoseSet* set) {
  if (rates_.empty()) return {};
  set->rates.resize(rates_.size());
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    set->rates[i].stated = rates_[i];
    if (!rates_[i].at.is_pose()) continue;
    const auto pose = FindPose(rates_[i].at.pose, &set->poses);
    if (pose == set->poses.end()) return NoSuchPose("rates", rates_[i].at, *set);
    set->rates[i].means = *pose;
  }
  PoseSet turning;
  turning.streams = set->streams;
  if (means_) {
    TRUETRIAD_ASSIGN_OR_RETURN(auto collected, means_->Finish(&set->findings));
    // The noise of turning is estimated separately, as a turning table shakes the unit more.
    std::vector<PerTriad<TriadPoseMoments>> turning_moments;
    for (CollectedPose& mean : collected) {
      turning.poses.push_back(std::move(mean.pose));
      turning_moments.push_back(std::move(mean.moments));
    }
    for (std::size_t i = 0; i < stretches_.size(); ++i) {
      TRUETRIAD_RETURN_IF_ERROR(
          CheckIsHeld(rates_[stretches_[i]], turning_moments[i][Triad::kGyroscope], *set));
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckRamps(turning_moments, *set));
    for (const FlatPoses& flat : FindFlatPoses(resolution_raw, turning_moments, set->streams)) {
      return ErrorIn(
          ErrorCode::kStuckSensor,
          WhereOf(rates_[stretches_[flat.poses.front()]], *set),
          flat.words + " throughout; leave the rate out, or " +
              (flat.is_clipped ? "set a larger full-scale range" : "check the sensor and its bus") +
              " and record again");
    }
    FillCovariances(turning_moments, resolution_raw, &turning);
    for (std::size_t i = 0; i < stretches_.size(); ++i) {
      set->rates[stretches_[i]].means = turning.poses[i];
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
    // Rests and rates share one bound for the shift of their means, so the larger bound is kept.
    for (std::size_t i = 0; i < set->streams.size(); ++i) {
      Eigen::Vector3d& shift = set->streams[i].one_sided_raw;
      const Eigen::Vector3d& turned = turning.streams[i].one_sided_raw;
      if (turned.squaredNorm() > shift.squaredNorm()) shift = turned;
    }
  } else {
    set->streams = turning.streams;
  }
  return {};
}

Status TakeRates(const std::vector<StatedRate>& rates, PoseSet* set) {
  for (const StatedRate& rate : rates) {
    if (!rate.at.is_pose()) {
      const std::string where = rate.at.times.empty()
                                    ? "rows " + std::to_string(rate.at.rows.first) + " to " +
                                          std::to_string(rate.at.rows.last)
                                    : "a time";
      return ErrorIn(ErrorCode::kDoesNotMatch,
                     (rate.at.stated_in.empty() ? "" : rate.at.stated_in + ": ") + set->source,
                     "is a pose table, but a rate is stated for " + where +
                         "; state each rate for one row, as `pose: N`, counted from 1");
    }
    const auto pose = FindPose(rate.at.pose, &set->poses);
    if (pose == set->poses.end()) return NoSuchPose("rates", rate.at, *set);
    set->rates.push_back({rate, std::move(*pose)});
    set->poses.erase(pose);
  }
  return {};
}

std::vector<MotionPlace> SpansToKeep(const PoseSelection& selection) {
  std::vector<MotionPlace> spans;
  for (const StatedTurn& turn : selection.turns) {
    if (!turn.at.is_pose()) spans.push_back(turn.at);
  }
  for (const StatedRate& rate : selection.rates) {
    if (!rate.at.is_pose()) spans.push_back(rate.at);
  }
  return spans;
}

Status FinishTurns(const PoseSelection& selection, const MoveRecorder& recorder, PoseSet* set) {
  std::vector<RecordedMove> spans = recorder.Spans(*set);
  std::size_t span = 0;
  for (const StatedTurn& stated : selection.turns) {
    KnownTurn& turn = set->turns.emplace_back();
    turn.stated = stated;
    if (!stated.at.is_pose()) {
      TRUETRIAD_RETURN_IF_ERROR(CheckIsInLog(stated.at, recorder, *set));
      if (span < spans.size()) turn.move = std::move(spans[span++]);
      continue;
    }
    const auto pose = FindPose(stated.at.pose, &set->poses);
    const auto from = static_cast<std::size_t>(pose - set->poses.begin());
    if (pose == set->poses.end()) return NoSuchPose("turns", stated.at, *set);
    if (from + 1 >= set->poses.size()) return NoRestAfter(stated.at, *set);
    if (from < set->moves.size()) turn.move = set->moves[from];
  }
  RejectCutTurns(set);
  for (RecordedMove& move : set->moves) {
    const StaticPose& before = set->poses[move.from];
    const StaticPose& after = set->poses[move.from + 1];
    for (const KnownRate& rate : set->rates) {
      if (rate.means.first_row <= before.last_row || rate.means.last_row >= after.first_row) {
        continue;
      }
      if (!Acts(Mechanism::kTurnAtKnownRate)) continue;
      move.fault = Finding(
          FindingCode::kTurnAtKnownRate,
          "a known rate was held during the turn, and its readings are used for that rate instead");
    }
  }
  return {};
}

}  // namespace truetriad
