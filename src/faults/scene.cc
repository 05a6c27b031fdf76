// SPDX-License-Identifier: Apache-2.0
#include "faults/scene.h"

#include <algorithm>
#include <cmath>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// A turn is stopping when its rate is below this share of its largest rate. A reading has moved if
// it changed by more than this share of the run's largest reading.
constexpr double kMoving = 0.1;

// Time between the two rates whose difference gives the angular acceleration, s. In a shorter time,
// the difference is noise; in a longer one, a hand's motion changes.
constexpr double kApartS = 0.1;
// Largest share of the gyroscope's noise in a column's mean square. With more, the test finds this
// noise again (each of 20 clean recordings of slow turns seemed to have a low-pass of 30 σ).
constexpr double kMostNoise = 0.1;

Eigen::Vector3d UnitOf(const Eigen::Vector3d& v) {
  const double length = v.norm();
  return length > 0.0 ? Eigen::Vector3d(v / length) : v;
}

// Adds K ⊗ v^T.
void AddSpread(const Eigen::Matrix3d& K,
               const Eigen::Vector3d& v,
               Eigen::Matrix<double, 3, 9>* sum) {
  for (Eigen::Index i = 0; i < 3; ++i) sum->middleCols<3>(3 * i) += K.col(i) * v.transpose();
}

// axes ⊗ v^T: column 3 i + j is v_j along axis i.
Eigen::MatrixXd Spread(const Eigen::Matrix3d& axes, const Eigen::Vector3d& v) {
  Eigen::Matrix<double, 3, 9> all = Eigen::Matrix<double, 3, 9>::Zero();
  AddSpread(axes, v, &all);
  return all;
}

constexpr std::size_t Index(FaultForm form) { return static_cast<std::size_t>(form); }

constexpr std::array kDiagonalForms = {FaultForm::kBias,
                                       FaultForm::kGain,
                                       FaultForm::kSize,
                                       FaultForm::kSquare,
                                       FaultForm::kCube,
                                       FaultForm::kGainByRate,
                                       FaultForm::kStill};

// Forms whose columns are computed from the gyroscope's readings along a turn.
constexpr std::array kOfRates = {FaultForm::kGain,
                                 FaultForm::kMatrix,
                                 FaultForm::kSize,
                                 FaultForm::kSquare,
                                 FaultForm::kCube,
                                 FaultForm::kGainByRate};

// The time for which a reading stands, s: half of the interval before it plus half of the interval
// after it; for mean rates, the whole interval before it.
double SpanOf(const std::vector<double>& time_s, std::size_t i, RateSampling sampling) {
  const double before = i > 0 ? time_s[i] - time_s[i - 1] : 0.0;
  const double after = i + 1 < time_s.size() ? time_s[i + 1] - time_s[i] : 0.0;
  return sampling == RateSampling::kMeanRate ? before : 0.5 * (before + after);
}

// The angle of a turn about each body axis, from readings that are not corrected for faults: in
// corrected readings, the correction of a fault would amplify the noise of the fault's own column.
Eigen::Vector3d AngleOf(const IncrementEdge& edge) {
  const TriadModel<double>& model = edge.at.triad;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < edge.move.time_s.size(); ++i) {
    const Eigen::Vector3d raw = edge.move.reading_raw[i] - model.bias;
    sum += SpanOf(edge.move.time_s, i, edge.sampling) * (edge.at.is_bent ? model.Felt(raw) : raw);
  }
  return model.Correction() * sum;
}

}  // namespace

FaultScene::FaultScene(const PoseGraph& graph) : graph_(&graph) {
  PlaceNodes();
  PlaceSwings();
  PlaceTurns();
  PlaceStretches();
}

void FaultScene::PlaceNodes() {
  Eigen::Index row = 0;
  const ReferenceVector reference = graph_->reference();
  const Eigen::Vector3d up = UnitOf(WorldVector(Triad::kAccelerometer, reference));
  const Eigen::Vector3d field = UnitOf(WorldVector(Triad::kMagnetometer, reference));
  for (const PoseNode& pose : graph_->nodes) {
    Node& node = nodes_.emplace_back();
    node.has_attitude = pose.kind != PoseKind::kDirection && pose.is_axis_known;
    node.is_moment = pose.role == PoseRole::kMoment;
    if (node.has_attitude) {
      node.body_from_world = pose.rotation().conjugate().toRotationMatrix();
      node.up = node.body_from_world * up;
      node.field = node.body_from_world * field;
    }
    for (std::size_t i = 0; i < pose.observations.size(); ++i) {
      const Triad triad = pose.observations[i].triad;
      Seen& seen = node.seen[triad];
      seen.is_there = true;
      seen.row = row + 3 * static_cast<Eigen::Index>(i);
      seen.turn = pose.observations[i].mean_turn;
      seen.x = seen.turn * pose.FieldInBody(graph_->layout, triad, reference, pose.state.data());
      seen.S = graph_->ModelAt(triad, pose).sensitivity;
      seen.u = seen.S * seen.x;
      largest_[triad] = std::max(largest_[triad], seen.u.cwiseAbs().maxCoeff());
    }
    row += pose.row_count();
  }
}

// Sums the angle about each body axis, and the time, up to each moment of a chain.
void FaultScene::PlaceSwings() {
  const std::vector<IncrementEdge>& turns = graph_->increments;
  if (turns.empty()) return;
  path_.resize(nodes_.size());
  for (const IncrementEdge& turn : turns) {
    const Path& from = path_[turn.from];
    path_[turn.from + 1] = {
        from.angle + AngleOf(turn), from.time_s + turn.increment.duration_s, from.turns + 1};
  }
  double duration_s = 0.0;
  for (const IncrementEdge& turn : turns) duration_s += turn.increment.duration_s;
  const double spacing_s = std::max(duration_s / static_cast<double>(turns.size()), 1e-9);
  apart_ = std::max<std::ptrdiff_t>(1, std::llround(kApartS / spacing_s));
  rate_variance_ = RateVariance();
  double power = 0.0, noise = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!nodes_[k].is_moment) continue;
    const auto at = static_cast<std::ptrdiff_t>(k);
    const auto into = RateOver(at - 2 * apart_, at), from = RateOver(at, at + 2 * apart_);
    if (!into || !from) continue;
    const double between_s = 0.5 * (path_[k + 2 * static_cast<std::size_t>(apart_)].time_s -
                                    path_[k - 2 * static_cast<std::size_t>(apart_)].time_s);
    nodes_[k].swing = Swing{0.5 * (*into + *from), (*from - *into) / between_s};
    power += nodes_[k].swing->acceleration.squaredNorm();
    noise += rate_variance_ / (between_s * between_s);  // difference of two rates over two spans
  }
  if (noise < kMostNoise * power) return;
  for (Node& node : nodes_) {
    if (node.swing) node.swing->acceleration.setZero();
  }
}

// The mean rate from one moment to another of the same chain, rad/s.
std::optional<Eigen::Vector3d> FaultScene::RateOver(std::ptrdiff_t begin,
                                                    std::ptrdiff_t end) const {
  if (begin < 0 || end >= std::ssize(path_)) return std::nullopt;
  const Path& from = path_[static_cast<std::size_t>(begin)];
  const Path& to = path_[static_cast<std::size_t>(end)];
  if (to.turns - from.turns != end - begin) return std::nullopt;
  return (to.angle - from.angle) / (to.time_s - from.time_s);
}

void FaultScene::PlaceTurns() {
  turn_into_.assign(nodes_.size(), -1);
  Eigen::Index row = 0;
  for (const PoseNode& pose : graph_->nodes) row += pose.row_count();
  double& largest = largest_[Triad::kGyroscope];
  for (const IncrementEdge& edge : graph_->increments) {
    turn_into_[edge.from + 1] = static_cast<int>(turn_rows_.size());
    turn_rows_.push_back(row);
    row += 3;
    // If the resolution step q hides the noise, σ is q / √12, and half a step is √3 σ.
    half_step_ = half_step_.max(std::sqrt(3.0) * edge.sigma_raw.array());
    for (const Eigen::Vector3d& raw : edge.move.reading_raw) {
      largest = std::max(largest, (raw - edge.at.triad.bias).cwiseAbs().maxCoeff());
    }
  }
}

const std::vector<TurnColumns>& FaultScene::turns() const {
  if (turns_.size() < graph_->increments.size()) SumTurns();
  return turns_;
}

void FaultScene::SumTurns() const {
  for (const IncrementEdge& edge : graph_->increments) {
    turns_.push_back(SumsOf(edge));
    largest_rate_ = std::max(largest_rate_, turns_.back().fastest);
  }
  double power = 0.0, noise = 0.0;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    StateInRows(graph_->increments[i], &turns_[i]);
    const auto bend = RateBendAt(i);
    if (!bend) continue;
    turns_[i].of[Index(FaultForm::kLowPass)] = bend->value;
    power += bend->value.squaredNorm();
    noise += bend->of_variance * rate_variance_;
  }
  if (noise < kMostNoise * power) return;
  for (TurnColumns& turn : turns_) turn.of[Index(FaultForm::kLowPass)].resize(0, 0);
}

// The variance that noise gives the mean rate over a span of apart_ turns, summed over the axes. In
// a smooth motion, the third difference of the mean rates of four consecutive spans is zero; noise
// gives it 20 times the variance of one mean rate (1 + 9 + 9 + 1).
double FaultScene::RateVariance() const {
  double sum = 0.0, count = 0.0;
  const auto rate_of = [&](std::ptrdiff_t k) { return RateOver(k, k + apart_); };
  for (std::ptrdiff_t k = 0; k + 4 * apart_ < std::ssize(path_); ++k) {
    const auto first = rate_of(k), second = rate_of(k + apart_), third = rate_of(k + 2 * apart_),
               fourth = rate_of(k + 3 * apart_);
    if (!first || !second || !third || !fourth) continue;
    sum += (*fourth - *first - 3.0 * (*third - *second)).squaredNorm() / 20.0;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

// Half the integral of the rate's second derivative over a turn in motion. It is computed from the
// mean rates f of four spans: the two before the turn end one moment before it, and the two after
// it begin one moment after it. The turn itself is left out: its residual has the same noise, so
// that the test would find this noise again. If the spans' middles are at ± a and ± b from the
// turn's middle,
//
//   f'' = (f(b) + f(-b) - f(a) - f(-a)) / (b^2 - a^2)
std::optional<FaultScene::RateBend> FaultScene::RateBendAt(std::size_t turn) const {
  const IncrementEdge& edge = graph_->increments[turn];
  if (!nodes_[edge.from].is_moment) return std::nullopt;
  const auto from = static_cast<std::ptrdiff_t>(edge.from);
  const auto before = RateOver(from - 1 - apart_, from - 1),
             after = RateOver(from + 2, from + 2 + apart_),
             long_before = RateOver(from - 1 - 2 * apart_, from - 1 - apart_),
             long_after = RateOver(from + 2 + apart_, from + 2 + 2 * apart_);
  if (!long_before || !long_after) return std::nullopt;
  const double spacing_s = edge.increment.duration_s, span = static_cast<double>(apart_);
  const double a = (1.5 + 0.5 * span) * spacing_s, b = (1.5 + 1.5 * span) * spacing_s;
  const double scale = 0.5 * spacing_s / (b * b - a * a);
  return RateBend{scale * (*long_after + *long_before - *after - *before), 4.0 * scale * scale};
}

void FaultScene::PlaceStretches() {
  const std::size_t count = nodes_.size(), most = std::min(count, kMostStretches);
  for (std::size_t g = 0; g <= most; ++g) stretch_begin_.push_back(g * count / most);
  const std::vector<PoseNode>& poses = graph_->nodes;
  const auto [first, last] =
      std::minmax_element(poses.begin(), poses.end(), [](const PoseNode& a, const PoseNode& b) {
        return a.time_s < b.time_s;
      });
  const double begin_s = first->time_s, duration_s = std::max(last->time_s - begin_s, 1e-9);
  tau_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(most));
  Eigen::VectorXd degc = tau_;
  for (std::size_t g = 0; g < most; ++g) {
    for (std::size_t k = stretch_begin_[g]; k < stretch_begin_[g + 1]; ++k) {
      stretch_of_.push_back(g);
      const auto at = static_cast<Eigen::Index>(g);
      tau_[at] += (2.0 * (poses[k].time_s - begin_s) / duration_s - 1.0) / PosesIn(g);
      degc[at] += poses[k].temperature_degc / PosesIn(g);
    }
  }
  // A constant temperature determines nothing.
  if (degc.maxCoeff() > degc.minCoeff()) temperature_ = degc;
}

// The sums over a turn's readings, in the body frame at the begin of the turn.
TurnColumns FaultScene::SumsOf(const IncrementEdge& edge) const {
  TurnColumns sums;
  std::array<Eigen::Matrix3d, kDiagonalForms.size()> diagonal;
  diagonal.fill(Eigen::Matrix3d::Zero());
  Eigen::Matrix<double, 3, 9> by_force = Eigen::Matrix<double, 3, 9>::Zero(), by_field = by_force,
                              by_rate = by_force;
  const TriadModel<double>& model = edge.at.triad;
  const Eigen::Matrix3d C = model.Correction();
  const Eigen::Vector3d gains = model.sensitivity.rowwise().norm();
  const Node& from = nodes_[edge.from];
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < edge.move.time_s.size(); ++i) {
    const Eigen::Vector3d raw = edge.move.reading_raw[i] - model.bias;
    const Eigen::Vector3d u = edge.at.is_bent ? model.Felt(raw) : raw;
    const Eigen::Vector3d rate = C * u;
    if (i > 0) {
      const double step_s = edge.move.time_s[i] - edge.move.time_s[i - 1];
      const double old = edge.sampling == RateSampling::kMeanRate ? 0.0 : 0.5;
      turned = turned * RotationExp(step_s * (old * before + (1.0 - old) * rate));
    }
    before = rate;
    const double span_s = SpanOf(edge.move.time_s, i, edge.sampling), speed = rate.norm();
    const Eigen::Matrix3d R = turned.toRotationMatrix();
    const Eigen::Matrix3d K = (span_s * R) * C;
    // In the order of kDiagonalForms.
    diagonal[0] += K;
    diagonal[1] += K * u.asDiagonal();
    diagonal[2] += K * u.cwiseAbs().asDiagonal();
    diagonal[3] += K * u.cwiseAbs2().asDiagonal();
    diagonal[4] += K * u.cwiseProduct(u.cwiseAbs2()).asDiagonal();
    diagonal[5] += K * (speed * u).asDiagonal();
    const Eigen::Array3d still = (u.array().abs() <= half_step_).cast<double>();
    if (!still.isZero(0.0)) diagonal[6] += K * still.matrix().asDiagonal();
    const Eigen::Vector3d step = R * (span_s * rate);
    sums.squared_steps += step * step.transpose();
    sums.fastest = std::max(sums.fastest, speed);
    if (speed >= kMoving * sums.fastest) sums.last_rate = rate;
    AddSpread(K * gains.asDiagonal(), rate, &by_rate);
    if (!from.has_attitude) continue;
    AddSpread(K, R.transpose() * from.up, &by_force);
    AddSpread(K, R.transpose() * from.field, &by_field);
  }
  for (std::size_t i = 0; i < diagonal.size(); ++i) sums.of[Index(kDiagonalForms[i])] = diagonal[i];
  sums.of[Index(FaultForm::kMatrix)] = by_rate;
  if (from.has_attitude) {
    sums.of[Index(FaultForm::kByForce)] = by_force;
    sums.of[Index(FaultForm::kByField)] = by_field;
  }
  if (!from.is_moment) sums.of[Index(FaultForm::kShortTurn)] = UnitOf(AngleOf(edge));
  sums.of[Index(FaultForm::kTurn)] = Eigen::Matrix3d::Identity();
  return sums;
}

// Transforms the sums into the body frame at the turn's end, and then into residual rows. A
// residual is the logarithm e of a rotation: J_l^-1(e), the inverse left Jacobian, multiplies the
// sums.
void FaultScene::StateInRows(const IncrementEdge& edge, TurnColumns* sums) const {
  const Eigen::Matrix3d to_end = edge.increment.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d left = edge.Residual(graph_->layout,
                                             graph_->shared.data(),
                                             graph_->nodes[edge.from].state.data(),
                                             graph_->nodes[edge.from + 1].state.data());
  const Eigen::Matrix3d to_rows = InverseRightJacobian(left).transpose() * to_end;
  for (std::size_t i = 0; i < kFaultForms; ++i) {
    const auto form = static_cast<FaultForm>(i);
    const bool is_in_rows = form == FaultForm::kTurn || form == FaultForm::kShortTurn;
    if (sums->of[i].size() == 0 || is_in_rows) continue;
    sums->of[i] = (ScaleOf(Triad::kGyroscope, form) * to_rows * sums->of[i]).eval();
  }
  sums->squared_steps = (to_end * sums->squared_steps * to_end.transpose()).eval();
  if (edge.stated_turn >= 0) sums->squared_steps.setZero();
}

// Makes powers of u relative to the largest |u|, and the rate relative to the largest rate.
double FaultScene::ScaleOf(Triad triad, FaultForm form) const {
  const double one = largest_[triad] > 0.0 ? 1.0 / largest_[triad] : 0.0;
  switch (form) {
    case FaultForm::kSize:
      return one;
    case FaultForm::kSquare:
      return one * one;
    case FaultForm::kCube:
      return one * one * one;
    case FaultForm::kGainByRate:
      return largest_rate_ > 0.0 ? one / largest_rate_ : 0.0;
    default:
      return 1.0;
  }
}

// The signs of the change of u as the unit came to rest: dx/dt = x × ω. Without a gyroscope, the
// signs of the difference from the previous pose. They are zero if u hardly changed, since noise
// has a sign, too.
Eigen::Vector3d FaultScene::MotionInto(Triad triad, std::size_t node) const {
  const Seen& seen = nodes_[node].seen[triad];
  if (turn_into_[node] >= 0) {
    const TurnColumns& sums = turns()[static_cast<std::size_t>(turn_into_[node])];
    return (seen.S * seen.x.cross(sums.last_rate)).array().sign();
  }
  if (node == 0 || !nodes_[node - 1].seen[triad].is_there) return Eigen::Vector3d::Zero();
  const Eigen::Array3d moved = seen.u - nodes_[node - 1].seen[triad].u;
  return (moved.abs() > kMoving * largest_[triad]).select(moved.sign(), 0.0);
}

Eigen::MatrixXd FaultScene::AtPose(Triad triad, FaultForm form, std::size_t k) const {
  const Node& node = nodes_[k];
  const Seen& seen = node.seen[triad];
  const bool needs_attitude = form == FaultForm::kWorld || form == FaultForm::kByForce ||
                              form == FaultForm::kByField || form == FaultForm::kByAttitude;
  const bool needs_rest = form == FaultForm::kPlay || form == FaultForm::kSettling;
  const bool needs_swing = form == FaultForm::kLowPass || form == FaultForm::kLeverArm;
  if (!seen.is_there || (needs_attitude && !node.has_attitude) || (needs_rest && node.is_moment) ||
      (needs_swing && !node.swing)) {
    return {};
  }
  const Eigen::Array3d u = seen.u.array();
  const double scale = ScaleOf(triad, form);
  const auto diagonal = [](const Eigen::Array3d& values) -> Eigen::MatrixXd {
    return values.matrix().asDiagonal();
  };
  switch (form) {
    case FaultForm::kBias:
    case FaultForm::kReading:
      return Eigen::Matrix3d::Identity();
    case FaultForm::kStill:
      return diagonal((u.abs() <= half_step_).cast<double>());
    case FaultForm::kGain:
      return diagonal(u);
    case FaultForm::kMatrix:
      return Spread(seen.S.rowwise().norm().asDiagonal().toDenseMatrix(), seen.x);
    case FaultForm::kTurned:
      return seen.S * Skew(seen.x);
    case FaultForm::kWorld:
      return seen.S * seen.turn * node.body_from_world;
    case FaultForm::kSquare:
      return diagonal(scale * u.square());
    case FaultForm::kCube:
      return diagonal(scale * u.cube());
    case FaultForm::kSize:
      return diagonal(scale * u.abs());
    case FaultForm::kByForce:
      return Spread(Eigen::Matrix3d::Identity(), node.up);
    case FaultForm::kByField:
      return Spread(Eigen::Matrix3d::Identity(), node.field);
    case FaultForm::kByAttitude:
      return Spread(seen.S * seen.turn * node.body_from_world, node.up);
    case FaultForm::kPlay:
      return diagonal(MotionInto(triad, k).array());
    case FaultForm::kSettling:
      if (k == 0 || !nodes_[k - 1].seen[triad].is_there) return {};
      return nodes_[k - 1].seen[triad].u - seen.u;
    case FaultForm::kLowPass: {
      const auto& [rate, acceleration] = *node.swing;
      return 0.5 * seen.S * (seen.x.cross(rate).cross(rate) + seen.x.cross(acceleration));
    }
    case FaultForm::kLeverArm: {
      const Eigen::Matrix3d W = Skew(node.swing->rate);
      return seen.S * (Skew(node.swing->acceleration) + W * W);
    }
    case FaultForm::kGainByRate:
    case FaultForm::kTurn:
    case FaultForm::kShortTurn:
      break;
  }
  return {};
}

std::vector<FaultColumn> FaultScene::ColumnsOf(Triad triad, FaultForm form) const {
  std::vector<FaultColumn> columns(stretches());
  Eigen::Index unknowns = 0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Eigen::MatrixXd at_pose = AtPose(triad, form, k);
    if (at_pose.cols() == 0) continue;
    columns[stretch_of_[k]].Add(nodes_[k].seen[triad].row, at_pose);
    unknowns = at_pose.cols();
  }
  const std::size_t turn_count = triad == Triad::kGyroscope ? turns().size() : 0;
  for (std::size_t i = 0; i < turn_count; ++i) {
    const Eigen::MatrixXd& at_turn = turns_[i].of[Index(form)];
    if (at_turn.cols() == 0) continue;
    const std::size_t from = graph_->increments[i].from;
    if (form == FaultForm::kTurn) {
      columns[stretch_of_[from]].Add(turn_rows_[i], at_turn);
    } else {
      columns[stretch_of_[from]].Add(turn_rows_[i], 0.5 * at_turn);
      columns[stretch_of_[from + 1]].Add(turn_rows_[i], 0.5 * at_turn);
    }
    unknowns = at_turn.cols();
  }
  if (unknowns == 0) return {};
  const bool is_of_rates = std::find(kOfRates.begin(), kOfRates.end(), form) != kOfRates.end();
  const bool is_noisy = turn_count > 0 && is_of_rates && nodes_.front().is_moment;
  for (FaultColumn& column : columns) {
    column.unknowns = unknowns;
    column.is_noisy = is_noisy;
  }
  return columns;
}

}  // namespace truetriad
