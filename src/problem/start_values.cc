// SPDX-License-Identifier: Apache-2.0
#include "problem/start_values.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "init/frame_alignment.h"
#include "init/six_position.h"
#include "math/distributions.h"
#include "truetriad/math/rotation.h"

namespace truetriad {

double WildFrom(std::vector<double> errors) {
  constexpr std::size_t kFewest = 12;    // chosen: the median of fewer errors is no reliable scale
  constexpr double kTimesMedian = 10.0;  // chosen: 15 σ of normal errors, whose median is 0.67 σ
  constexpr double kLeast = 0.02;        // share of the field; a rough start has such errors
  if (errors.size() < kFewest) return std::numeric_limits<double>::infinity();
  return std::max(kLeast, kTimesMedian * Median(std::move(errors)));
}

StartValues StartAt(const PoseGraph& graph) {
  StartValues start;
  start.reference = graph.reference();
  start.level_from_fixture = graph.level_from_fixture;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    start.models[triad] = {graph.sensitivity(triad), graph.bias(triad)};
  }
  return start;
}

std::vector<Eigen::Vector3d> ReadingsOf(const PoseSet& poses, Triad triad) {
  std::vector<Eigen::Vector3d> readings;
  for (const StaticPose& pose : poses.poses) {
    if (pose.triads[triad]) readings.push_back(pose.triads[triad]->mean_raw);
  }
  return readings;
}

Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad) {
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& reading : ReadingsOf(poses, triad)) values.push_back(reading[axis]);
    if (!values.empty()) median[axis] = Median(values);
  }
  return median;
}

namespace {

// Refuses a label that differs from the label of most rests with the same axis up. If all rests on
// a face have the label of another face, the cause is the mounting, and they are accepted.
Status CheckLabels(const PoseSet& poses, const std::vector<int>& faces) {
  std::vector<Eigen::Vector3d> readings;
  std::vector<std::size_t> labelled;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (faces[k] < 0) continue;
    readings.push_back(poses.poses[k].triads[Triad::kAccelerometer]->mean_raw);
    labelled.push_back(k);
  }
  const auto seen = AssignFaces(readings);
  if (!seen) return {};  // The readings do not show six separate faces, so the labels are used.
  std::array<std::array<int, kFaceCount>, kFaceCount> count{};  // [face of the reading][label]
  const auto place_of = [&](std::size_t i) { return static_cast<std::size_t>((*seen)[i]); };
  for (std::size_t i = 0; i < labelled.size(); ++i) {
    ++count[place_of(i)][static_cast<std::size_t>(faces[labelled[i]])];
  }
  for (std::size_t i = 0; i < labelled.size(); ++i) {
    const auto& labels = count[place_of(i)];
    const auto usual =
        static_cast<std::size_t>(std::max_element(labels.begin(), labels.end()) - labels.begin());
    const auto label = static_cast<std::size_t>(faces[labelled[i]]);
    if (label == usual) continue;
    const StaticPose& pose = poses.poses[labelled[i]];
    return Error(ErrorCode::kDoesNotMatch,
                 {poses.source},
                 "pose " + std::to_string(pose.number) + " is labelled " + kFaceNames[label] +
                     ", but others with the same axis up are labelled " + kFaceNames[usual] +
                     "; correct its label");
  }
  return {};
}

}  // namespace

Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, const TriadOptions& accelerometer) {
  std::vector<int> faces(poses.poses.size(), -1);
  std::vector<Eigen::Vector3d> readings;
  std::vector<std::size_t> unnamed;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    const StaticPose& pose = poses.poses[k];
    if (!pose.triads[Triad::kAccelerometer]) continue;
    const auto* name = std::find(kFaceNames.begin(), kFaceNames.end(), pose.face_up);
    if (name != kFaceNames.end()) {
      faces[k] = static_cast<int>(name - kFaceNames.begin());
      continue;
    }
    readings.push_back(pose.triads[Triad::kAccelerometer]->mean_raw);
    unnamed.push_back(k);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckLabels(poses, faces));
  if (unnamed.empty()) return faces;
  const Eigen::Matrix3d map = accelerometer.mounting.value_or(Eigen::Matrix3d::Identity());
  const auto assigned = AssignFaces(readings);
  if (!assigned) return assigned.error();
  for (std::size_t i = 0; i < unnamed.size(); ++i) {
    const int seen_axis = (*assigned)[i] / 2;
    const bool is_positive = (*assigned)[i] % 2 == 0;
    // A chip that reports gravity reads positive on the axis that points down.
    const bool reads_up = is_positive == (accelerometer.sign == AccelerometerSign::kSpecificForce);
    Eigen::Index axis = 0;
    map.row(seen_axis).cwiseAbs().maxCoeff(&axis);
    const bool up = reads_up == (map(seen_axis, axis) > 0.0);
    faces[unnamed[i]] = 2 * static_cast<int>(axis) + (up ? 0 : 1);
  }
  return faces;
}

void SetStartAttitudes(const StartValues& start, PoseGraph* graph) {
  const Eigen::Vector3d up_in_world = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d field_in_world =
      WorldVector(Triad::kMagnetometer, start.reference).normalized();
  for (PoseNode& node : graph->nodes) {
    if (node.kind == PoseKind::kHeld || node.has_attitude_prior) continue;
    if (!node.is_axis_known) {
      const Eigen::Vector3d axis = start.models[Triad::kGyroscope]
                                       ->TruthFromRaw(node.observations.front().mean_raw)
                                       .normalized();
      node.state = {axis.x(), axis.y(), axis.z(), 0.0};
      continue;
    }
    PerTriad<std::optional<Eigen::Vector3d>> seen;
    for (const Observation& observation : node.observations) {
      if (observation.triad == Triad::kGyroscope) continue;
      seen[observation.triad] =
          start.models[observation.triad]->TruthFromRaw(observation.mean_raw).normalized();
    }
    const auto& up = seen[Triad::kAccelerometer];
    const auto& field = seen[Triad::kMagnetometer];
    if (node.kind == PoseKind::kDirection) {
      const Eigen::Vector3d direction = up ? *up : *field;
      node.state = {direction.x(), direction.y(), direction.z(), 0.0};
    } else {
      const Eigen::Quaterniond q = up && field
                                       ? TriadAttitude(up_in_world, field_in_world, *up, *field)
                                   : up ? RotationBetween(*up, up_in_world)
                                        : RotationBetween(*field, field_in_world);
      node.state = {q.x(), q.y(), q.z(), q.w()};
    }
  }
}

void SetStartHeadings(PoseGraph* graph) {
  for (const IncrementEdge& edge : graph->increments) {
    const PoseNode& before = graph->nodes[edge.from];
    PoseNode& node = graph->nodes[edge.from + 1];
    if (node.TellsHeading() || node.kind != PoseKind::kRotation || node.has_attitude_prior)
      continue;
    const Eigen::Quaterniond predicted = before.rotation() * edge.increment.rotation;
    // North is the predicted one, up the measured one.
    const Eigen::Vector3d up = node.rotation().conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Quaterniond q = TriadAttitude(Eigen::Vector3d::UnitZ(),
                                               Eigen::Vector3d::UnitX(),
                                               up,
                                               predicted.conjugate() * Eigen::Vector3d::UnitX());
    node.state = {q.x(), q.y(), q.z(), q.w()};
  }
  for (PoseNode& node : graph->nodes) node.held_world_from_body = node.rotation();
}

}  // namespace truetriad
