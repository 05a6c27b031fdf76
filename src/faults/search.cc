// SPDX-License-Identifier: Apache-2.0
#include "faults/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "faults/fault_test.h"
#include "faults/log_tail.h"
#include "faults/scan.h"
#include "faults/scene.h"
#include "faults/taken_model.h"
#include "math/dense/cholesky.h"
#include "math/dense/products.h"
#include "noise/deletion.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// The only significance level: a clean run has a finding with a probability of 1 %.
constexpr double kLevelOfRun = 0.01;
// Chosen: the most faults that are accepted. If more are significant, has_more_faults is set.
constexpr std::size_t kMostFaults = 8;
// The significance level of a fault that is only noted: that of a single test.
constexpr double kNoteLevel = kLevelOfRun;
// Largest κ of a fault whose column is computed from noisy readings. If other unknowns explain most
// of such a column, its remainder is noise, and the test finds this noise: in each of 20 clean
// recordings of motion, the gyroscope's gains seemed to change by 130 %, with κ = 14.
constexpr double kHardlyTold = 12.0;
// Prior σ of each unknown over the rms of the determined ones: the axes of a sensor are alike.
constexpr double kUnseenOverSeen = 1.0;
// log 1000: of two rival explanations, neither is more than a thousand times as likely.
const double kRivalLogOdds = 3.0 * std::numbers::ln10;
// Prior σ of a tested fault over its σ by the readings: the prior adds 1e-8 of the information.
constexpr double kFree = 1e4;
// Number of a kind's positions that are tested in full: those with the smallest lower limit of p.
constexpr std::size_t kMostPositions = 3;
// Chosen: variances that need more REML steps count as not settled.
constexpr int kSettlingSteps = 40;
// A correction has converged if its last step is below this share of every parameter's σ.
constexpr double kSettledSigmas = 1e-3;
constexpr int kMostRounds = 8;  // most Gauss-Newton rounds; each squares the error
// The quick test uses the variances of the model without the fault. A full test follows if p of the
// quick test is below the fault's significance level to this power.
constexpr double kLookAgain = 0.6;
// If the excess of turns is below this share of their readings' noise, lost rows are not tested.
constexpr double kScatteredTurns = 0.5;
// Chosen: fewer turns are not tested for lost rows.
constexpr std::size_t kFewestTurns = 8;
constexpr double kMisfitLogP = -13.8;  // log 1e-6
// If an excess's σ exceeds the σ at rest by this ratio, it is a misfit: a variance ratio of 9.
constexpr double kMuchExcess = 3.0;

struct Candidate {
  const FaultKind* kind = nullptr;
  Triad triad = Triad::kAccelerometer;
  std::size_t form = 0;
  std::pair<int, int> position;
  double log_level = 0.0;
  bool is_active = true;
  FaultTest test;
  double kappa = 0.0;

  double Score() const { return test.log_p - log_level; }
};

// A form of one sensor. All candidates that have this form share its columns.
struct SensorForm {
  Triad triad = Triad::kAccelerometer;
  FaultForm form = FaultForm::kBias;
  bool is_whole = true;                     // none of its shapes varies over the run
  std::optional<ScannedForm> scanned = {};  // set at the first use
};

// An accepted fault: its candidate, prior σ of h, and its effects.
struct Taken {
  std::size_t candidate = 0;
  Eigen::VectorXd sigma;
  Eigen::MatrixXd per_unknown;  // change of the free coordinates by h = 1
  Eigen::VectorXd by_rival;     // further change if the most different rival is the true fault
  TakenFault fault;
};

// Solves component = s (1 - s) for the share s of lost rows, at most 1/2; unset above 1/4.
std::optional<double> ShareOf(double component) {
  if (component > 0.25) return std::nullopt;
  return 0.5 * (1.0 - std::sqrt(1.0 - 4.0 * component));
}

class FaultSearch {
 public:
  FaultSearch(const std::vector<StatedFault>& stated,
              const ReducedSystem& system,
              PoseGraph* graph,
              NoiseState* noise)
      : stated_(stated), graph_(graph), noise_(noise), model_(system, graph, noise) {}

  FaultFindings Run();
  // Solves until a further step is negligible; false if steps do not converge.
  bool Settle();
  // After Run: LogPrior() plus the log likelihood of all readings, in which each rejected reading
  // has a variance of its own.
  double log_evidence() const { return log_evidence_; }
  // Whether faults changed the graph that was given.
  bool HasChanged() const { return model_.added().size() > 0 || findings_.lost_rows.has_value(); }

 private:
  bool IsOfTemperature(const FaultKind& kind, Triad triad) const;
  void ListCandidates();
  void LookAtScene();
  const ScannedForm& FormOf(const Candidate& candidate);
  void StateColumns();
  std::size_t EndOfFault(std::size_t begin) const;
  void ShareBudget();
  void ProjectForms();
  void TestAll();
  void TestInFull(Candidate* candidate);
  double KappaOf(const FaultColumn& column, const Eigen::MatrixXd& T) const;
  Candidate* Clearest();
  double Confirmed(const Candidate& candidate);
  void TakeIn(Candidate* candidate);
  void TryWith(Candidate* candidate);
  double LikelihoodOfBest(const Eigen::VectorXd& v);
  bool TakeLostRows(double clearest_score);
  static Eigen::VectorXd SigmaOf(const Candidate& candidate) {
    const Eigen::VectorXd& h = candidate.test.h;
    const auto rank = static_cast<double>(candidate.test.rank);
    return Eigen::VectorXd::Constant(h.size(), kUnseenOverSeen * h.norm() / std::sqrt(rank));
  }
  StretchWeights WeightsOf(const Candidate& candidate) const {
    return truetriad::WeightsOf(candidate.kind->shape, candidate.position, *scene_);
  }
  FaultColumn ColumnOf(const Candidate& candidate) {
    return FormOf(candidate).Column(WeightsOf(candidate));
  }
  FaultPlace PlaceOf(const Candidate& candidate) const;
  Eigen::MatrixXd VariedBy(const FaultKind& kind, Triad triad) const;
  Eigen::MatrixXd SpreadOf(const Taken& taken, Eigen::Index at) const;
  void StateTaken();
  void StateCovariance();
  double LogPriorOf(const Taken& taken) const {
    return candidates_[taken.candidate].log_level - std::log(kLevelOfRun) - 1.0;
  }
  double LogPrior() const;
  void StateNotes();
  void StateWidening();
  void StateMisfit();
  void CountAsSystematic(const Eigen::MatrixXd& covariance);
  bool IsWhite(Triad triad) const;

  const std::vector<StatedFault>& stated_;
  PoseGraph* graph_;
  NoiseState* noise_;
  TakenModel model_;
  std::optional<FaultScene> scene_;
  std::vector<SensorForm> forms_;
  std::vector<Candidate> candidates_;
  std::vector<Taken> taken_;
  std::vector<Taken> left_in_;  // significant, but not to be corrected
  double lost_rows_level_ = 0.0;
  double log_evidence_ = 0.0;
  FaultFindings findings_;
};

// Whether a kind is not tested because of temperature terms: with them a sensor's bias and gain
// vary with the chamber's settings, and what terms do not explain is reported as drift between
// settings.
bool FaultSearch::IsOfTemperature(const FaultKind& kind, Triad triad) const {
  const bool varies = kind.varies == Varies::kBias || kind.varies == Varies::kGain;
  return varies && kind.shape != FaultShape::kTemperature &&
         graph_->layout.thermal[triad].size() > 0;
}

void FaultSearch::ListCandidates() {
  scene_.emplace(*graph_);
  std::vector<std::vector<FaultColumn>> columns;  // of each form
  for (const FaultKind& kind : FaultKinds()) {
    for (const Triad triad : kind.sensors) {
      if (!graph_->layout.Has(triad) || IsOfTemperature(kind, triad)) continue;
      const auto at = std::find_if(forms_.begin(), forms_.end(), [&](const SensorForm& one) {
        return one.triad == triad && one.form == kind.form;
      });
      const auto form = static_cast<std::size_t>(at - forms_.begin());
      if (at == forms_.end()) {
        forms_.push_back({triad, kind.form});
        columns.push_back(scene_->ColumnsOf(triad, kind.form));
      }
      const auto positions = PositionsOf(kind.shape, *scene_, columns[form]);
      if (positions.empty()) continue;
      if (truetriad::WeightsOf(kind.shape, positions.front(), *scene_).size() == 0) continue;
      if (kind.shape != FaultShape::kThroughout) forms_[form].is_whole = false;
      for (const auto& position : positions) {
        Candidate& candidate = candidates_.emplace_back();
        candidate.kind = &kind;
        candidate.triad = triad;
        candidate.form = form;
        candidate.position = position;
      }
    }
  }
  // Sorts candidates so that those of one form are adjacent.
  std::stable_sort(candidates_.begin(), candidates_.end(), [](const auto& a, const auto& b) {
    return a.form < b.form;
  });
  for (std::size_t f = 0; f < forms_.size(); ++f) {
    if (columns[f].empty()) continue;
    forms_[f].scanned.emplace(std::move(columns[f]), forms_[f].is_whole);
  }
}

void FaultSearch::LookAtScene() {
  scene_.emplace(*graph_);
  for (SensorForm& form : forms_) form.scanned.reset();
}

const ScannedForm& FaultSearch::FormOf(const Candidate& candidate) {
  SensorForm& form = forms_[candidate.form];
  if (!form.scanned) {
    form.scanned.emplace(scene_->ColumnsOf(form.triad, form.form), form.is_whole);
  }
  return *form.scanned;
}

// Sets the columns of stated and accepted faults, at the present solution.
void FaultSearch::StateColumns() {
  AddedColumns added;
  const Eigen::Index rows = model_.system().residual().size();
  for (const StatedFault& stated : stated_) {
    added.Append(stated.column, stated.sigma, rows);
    if (stated.mean.size() > 0) added.mean.tail(stated.mean.size()) = stated.mean;
  }
  for (const Taken& taken : taken_) {
    added.Append(ColumnOf(candidates_[taken.candidate]), taken.sigma, rows);
  }
  const Eigen::VectorXd before = model_.added().at;
  if (before.size() > 0) added.at.head(before.size()) = before;
  model_.SetColumns(std::move(added));
}

// The end of the adjacent candidates (one for each position) of the fault that starts at `begin`.
std::size_t FaultSearch::EndOfFault(std::size_t begin) const {
  std::size_t end = begin;
  while (end < candidates_.size() && candidates_[end].form == candidates_[begin].form &&
         candidates_[end].kind == candidates_[begin].kind) {
    ++end;
  }
  return end;
}

// Divides the significance level equally among the faults that the poses determine, and a fault's
// part among its positions. Whether poses determine a fault is tested at its middle position.
void FaultSearch::ShareBudget() {
  double faults = 1.0;  // the test of lost rows
  for (std::size_t begin = 0, end = 0; begin < candidates_.size(); begin = end) {
    end = EndOfFault(begin);
    const Candidate& middle = candidates_[begin + (end - begin) / 2];
    const bool is_seen = SeenDirections(FormOf(middle).SumsOf(WeightsOf(middle))).cols() > 0;
    if (is_seen) faults += 1.0;
    const double log_positions = std::log(static_cast<double>(end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      candidates_[i].is_active = is_seen;
      candidates_[i].log_level = std::log(kLevelOfRun) - log_positions;
    }
  }
  for (Candidate& candidate : candidates_) candidate.log_level -= std::log(faults);
  lost_rows_level_ = std::log(kLevelOfRun / faults);
  findings_.looked_for = static_cast<int>(faults);
}

void FaultSearch::ProjectForms() {
  for (const Candidate& candidate : candidates_) FormOf(candidate);
  for (SensorForm& form : forms_) {
    if (form.scanned) form.scanned->Project(model_.system());
  }
}

void FaultSearch::TestAll() {
  FirstLook look(model_.system(), model_.excess());
  for (std::size_t begin = 0, end = 0; begin < candidates_.size(); begin = end) {
    end = EndOfFault(begin);
    std::vector<std::pair<double, Candidate*>> promising;
    for (std::size_t i = begin; i < end; ++i) {
      Candidate& candidate = candidates_[i];
      candidate.test = {};
      if (!candidate.is_active) continue;
      double log_p = kLookAgain * candidate.log_level;
      if (!IsScan(candidate.kind->shape)) log_p = std::max(log_p, std::log(kNoteLevel));
      const QuickTest quick = QuickTestOf(FormOf(candidate).SumsOf(WeightsOf(candidate)));
      if (!look.MayBeBelow(log_p, quick)) continue;
      promising.emplace_back(look.LeastLogP(quick), &candidate);
    }
    const std::size_t most = std::min(promising.size(), kMostPositions);
    std::partial_sort(
        promising.begin(), promising.begin() + static_cast<std::ptrdiff_t>(most), promising.end());
    for (std::size_t i = 0; i < most; ++i) TestInFull(promising[i].second);
  }
}

void FaultSearch::TestInFull(Candidate* candidate) {
  const FaultColumn column = ColumnOf(*candidate);
  const StackedRows Y = model_.system().Projected(column);
  const ColumnSums sums = FormOf(*candidate).SumsOf(WeightsOf(*candidate));
  candidate->test = TestOf(model_.system(), model_.excess(), Y, sums);
  candidate->kappa = KappaOf(column, candidate->test.T);
  if (column.is_noisy && candidate->kappa > kHardlyTold) candidate->test = {};
}

double FaultSearch::KappaOf(const FaultColumn& column, const Eigen::MatrixXd& T) const {
  return LargestInSigmas(graph_->layout,
                         model_.system().SharedCovariance(),
                         Times(model_.system().SharedShift(column), T));
}

// log p of a candidate, with the variances v that are optimal if the fault is included. v and F¹
// are of a model in which the determined directions of h are free; X is of the model without it.
double FaultSearch::Confirmed(const Candidate& candidate) {
  const FaultColumn column = ColumnOf(candidate);
  FaultColumn seen;
  for (const FaultColumn::Block& block : column.blocks) {
    seen.Add(block.row, block.value * candidate.test.T);
  }
  const Eigen::VectorXd v = model_.excess().v;
  const AddedColumns before = model_.added();
  AddedColumns with = before;
  with.Append(
      seen, Eigen::VectorXd::Constant(seen.unknowns, kFree), model_.system().residual().size());
  model_.SetColumns(with);
  model_.SettleExcess(kSettlingSteps);
  const Eigen::MatrixXd fisher = model_.system().fisher();
  model_.SetColumns(before);
  const FaultSystem& system = model_.system();
  const StackedRows Y = system.Projected(seen);
  const ColumnSums sums{
      seen.Transposed(Y), seen.TransposedVector(system.q()), system.Squares(seen)};
  const Eigen::MatrixXd T = SeenDirections(sums);
  const double X = TransposeTimesVector(T, sums.gradient).squaredNorm();
  const auto rank = static_cast<double>(T.cols());
  const std::vector<Eigen::MatrixXd> E = system.ComponentSquares(StackedRows(Y * T));
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(T.cols(), T.cols());
  const double dof = DegreesOfFreedom(E, M, fisher, model_.excess(), model_.excess().v);
  model_.SetExcess(v);
  return rank > 0.0 ? LogFisherUpper(X / rank, rank, dof) : 0.0;
}

// The most significant candidate after confirmation; null if none is significant.
Candidate* FaultSearch::Clearest() {
  std::set<Candidate*> confirmed;
  while (true) {
    Candidate* best = nullptr;
    for (Candidate& candidate : candidates_) {
      if (!candidate.is_active || candidate.test.rank == 0) continue;
      if (best == nullptr || candidate.Score() < best->Score()) best = &candidate;
    }
    if (best == nullptr || best->Score() >= 0.0) return nullptr;
    if (!confirmed.insert(best).second) return best;
    best->test.log_p = std::max(best->test.log_p, Confirmed(*best));
  }
}

FaultPlace FaultSearch::PlaceOf(const Candidate& candidate) const {
  FaultPlace place{candidate.kind, candidate.triad, 0, 0};
  if (!IsScan(candidate.kind->shape)) return place;
  const auto number = [&](int stretch) {
    return graph_->nodes[scene_->FirstPose(static_cast<std::size_t>(stretch))].number;
  };
  place.first_pose = number(candidate.position.first);
  if (candidate.kind->shape == FaultShape::kWindow) {
    place.last_pose =
        graph_->nodes[scene_->FirstPose(static_cast<std::size_t>(candidate.position.second)) - 1]
            .number;
  }
  return place;
}

void FaultSearch::TakeIn(Candidate* candidate) {
  Taken taken;
  taken.candidate = static_cast<std::size_t>(candidate - candidates_.data());
  const Eigen::VectorXd& h = candidate->test.h;
  taken.sigma = SigmaOf(*candidate);
  taken.per_unknown = model_.system().SharedShift(ColumnOf(*candidate));
  TakenFault& fault = taken.fault;
  fault.place = PlaceOf(*candidate);
  fault.log_p = candidate->test.log_p;
  fault.kappa = candidate->kappa;
  const Eigen::VectorXd moved = Times(taken.per_unknown, h);
  const Eigen::MatrixXd covariance = model_.system().SharedCovariance();
  fault.shift_sigmas = LargestInSigmas(graph_->layout, covariance, moved);
  // Rivals are the most significant candidates of other kinds, not steps at other positions.
  std::set<std::pair<const FaultKind*, Triad>> named = {{candidate->kind, candidate->triad}};
  std::vector<const Candidate*> others;
  for (const Candidate& other : candidates_) {
    if (other.is_active && other.test.rank > 0) others.push_back(&other);
  }
  std::sort(others.begin(), others.end(), [](const Candidate* a, const Candidate* b) {
    return a->Score() < b->Score();
  });
  double furthest = 0.0;
  for (const Candidate* other : others) {
    if (other->Score() >= std::min(0.0, candidate->Score() + kRivalLogOdds)) break;
    if (!named.insert({other->kind, other->triad}).second) continue;
    fault.rivals.push_back(PlaceOf(*other));
    const Eigen::VectorXd apart =
        Times(model_.system().SharedShift(ColumnOf(*other)), other->test.h) - moved;
    const double sigmas = LargestInSigmas(graph_->layout, covariance, apart);
    if (sigmas <= furthest) continue;
    furthest = sigmas;
    taken.by_rival = apart;
  }
  candidate->is_active = false;
  taken_.push_back(std::move(taken));
}

// The log likelihood of the model without lost rows and with the fault of smallest p, significant
// or not. The excess starts from `v`.
double FaultSearch::LikelihoodOfBest(const Eigen::VectorXd& v) {
  const auto best = std::min_element(
      candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
        return (a.is_active ? a.test.log_p : 0.0) < (b.is_active ? b.test.log_p : 0.0);
      });
  if (best == candidates_.end() || !best->is_active || best->test.rank == 0) {
    return -std::numeric_limits<double>::infinity();
  }
  const TakenModel before = model_;
  model_.SetTurnVariances({});
  model_.SetExcess(v);
  AddedColumns with = model_.added();
  with.Append(ColumnOf(*best), SigmaOf(*best), model_.system().residual().size());
  model_.SetColumns(with);
  model_.SettleExcess(kSettlingSteps);
  const double likelihood = model_.system().LogLikelihood();
  model_ = before;
  model_.SetExcess(before.excess().v);
  return likelihood;
}

// Tests for lost rows, and returns true if they are significant, and more so than any fault. There
// are two tests. The first is of the directions of turn errors: lost rows cause errors along the
// turns, a few outliers do not. The second is the likelihood ratio for a variance that may be zero
// (half of χ² with one degree of freedom). It is omitted if P is not formed, or if the turns' noise
// is not estimated and may contain lost rows.
bool FaultSearch::TakeLostRows(double clearest_score) {
  const auto& names = noise_->estimated;
  const auto turns = std::find(names.begin(), names.end(), NoiseComponent::kTurn) - names.begin();
  const bool is_estimated = turns < std::ssize(names);
  if (findings_.lost_rows) return false;
  const Eigen::VectorXd v = model_.excess().v;
  if (is_estimated && v[turns] <= kScatteredTurns * model_.excess().rest[turns]) return false;
  TurnVariances unit;
  std::size_t turned = 0;
  for (const TurnColumns& sums : scene_->turns()) {
    unit.push_back(sums.squared_steps);
    if (!sums.squared_steps.isZero(0.0)) ++turned;
  }
  if (turned < kFewestTurns) return false;
  const FaultSystem::Alignment aligned = model_.system().AlignmentOf(unit);
  if (aligned.log_p > std::log(kLevelOfRun)) return false;
  if (!is_estimated || !model_.system().is_dense()) {
    const auto share = ShareOf(aligned.component);
    if (!share || aligned.log_p - lost_rows_level_ >= std::min(clearest_score, 0.0)) return false;
    findings_.lost_rows = LostRowsFound{*share, aligned.log_p};
    return true;
  }
  const double without = model_.system().LogLikelihood();
  model_.SetTurnVariances(std::move(unit));
  model_.SettleExcess(kSettlingSteps);
  const double with_rows = model_.system().LogLikelihood();
  const double ratio = 2.0 * (with_rows - without);
  const double log_p = std::log(0.5) + LogChiSquareUpper(std::max(ratio, 0.0), 1.0);
  const auto share = ShareOf(model_.excess().v.tail<1>()[0]);
  if (share && log_p - lost_rows_level_ < std::min(clearest_score, 0.0) &&
      with_rows > LikelihoodOfBest(v)) {
    findings_.lost_rows = LostRowsFound{*share, log_p};
    return true;
  }
  model_.SetTurnVariances({});
  model_.SetExcess(v);
  return false;
}

// By how much the true free coordinates change by each unknown h = 1 while the fault lasts.
Eigen::MatrixXd FaultSearch::VariedBy(const FaultKind& kind, Triad triad) const {
  const SharedLayout& layout = graph_->layout;
  const Eigen::Index unknowns = kind.varies == Varies::kMatrix ? 9 : 3;
  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(layout.size, unknowns);
  const Eigen::Matrix3d S = graph_->sensitivity(triad);
  const auto matrix = [&](Triad of, Eigen::Index i) {
    return Eigen::Map<Eigen::Matrix3d>(changes.col(i).data() + layout.sensitivity[of]);
  };
  const Eigen::Vector3d field = WorldVector(Triad::kMagnetometer, graph_->reference());
  const Eigen::Vector3d by_dip =
      WorldVectorJacobian(Triad::kMagnetometer, graph_->reference()).col(kDip);
  for (Eigen::Index i = 0; i < unknowns; ++i) {
    const Eigen::Matrix3d turned = S * Skew(Eigen::Vector3d::Unit(i % 3));
    switch (kind.varies) {
      case Varies::kNothing:
        break;
      case Varies::kBias:
        changes(layout.bias[triad] + i, i) = 1.0;
        break;
      case Varies::kGain:
        matrix(triad, i).row(i) = S.row(i);
        break;
      case Varies::kMatrix:
        matrix(triad, i)(i / 3, i % 3) = S.row(i / 3).norm();
        break;
      case Varies::kField:  // the part along the field changes the gain, the vertical part the dip
        matrix(triad, i) = field[i] / field.squaredNorm() * S;
        changes(layout.reference + kDip, i) = by_dip[i] / field.squaredNorm();
        break;
      case Varies::kMounting:
        // The accelerometer defines the body frame: if it slips, the other sensors seem to turn.
        for (const Triad other : kTriads) {
          if (!layout.Has(other)) continue;
          const bool is_leading = triad == Triad::kAccelerometer;
          if (is_leading ? other == triad : other != triad) continue;
          matrix(other, i) =
              is_leading ? graph_->sensitivity(other) * Skew(Eigen::Vector3d::Unit(i)) : turned;
        }
        break;
    }
  }
  return TransposeTimes(layout.basis, changes);
}

// The mean over all poses of d d^T, where d is the change of the free coordinates by the fault.
// E h h^T is h h^T + V_h, with the covariance V_h of h.
Eigen::MatrixXd FaultSearch::SpreadOf(const Taken& taken, Eigen::Index at) const {
  const Candidate& candidate = candidates_[taken.candidate];
  const Eigen::VectorXd& h = taken.fault.h;
  const Eigen::MatrixXd square =
      h * h.transpose() + model_.system().h_covariance().block(at, at, h.size(), h.size());
  const StretchWeights weights = WeightsOf(candidate);
  Eigen::VectorXd poses(weights.rows());
  for (Eigen::Index g = 0; g < poses.size(); ++g) {
    poses[g] = scene_->PosesIn(static_cast<std::size_t>(g));
  }
  const Eigen::MatrixXd of_functions =
      weights.transpose() * poses.asDiagonal() * weights / poses.sum();
  const Eigen::Index wide = h.size() / weights.cols();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(wide, wide);
  for (Eigen::Index f = 0; f < weights.cols(); ++f) {
    for (Eigen::Index g = 0; g < weights.cols(); ++g) {
      mean += of_functions(f, g) * square.block(f * wide, g * wide, wide, wide);
    }
  }
  Eigen::MatrixXd spread = Congruence(VariedBy(*candidate.kind, candidate.triad), mean);
  if (candidate.kind->varies == Varies::kField) {
    // The mean m of varying fields m_k is shorter than the fields:
    // |m|^2 = E |m_k|^2 - E |m_k - m|^2. The stated strength may be that of m or of the m_k.
    const double field = graph_->reference()[kField];
    const Eigen::Matrix3d gains =
        0.5 * mean.trace() / (field * field) * graph_->sensitivity(candidate.triad);
    Eigen::VectorXd shorter = Eigen::VectorXd::Zero(graph_->layout.size);
    shorter.segment<9>(graph_->layout.sensitivity[candidate.triad]) = gains.reshaped();
    const Eigen::VectorXd moved = graph_->layout.basis.transpose() * shorter;
    spread += moved * moved.transpose();
  }
  return spread;
}

void FaultSearch::StateTaken() {
  Eigen::Index at = 0;
  for (const StatedFault& stated : stated_) at += stated.column.unknowns;
  const Eigen::VectorXd sigma = model_.system().h_covariance().diagonal().cwiseSqrt();
  for (Taken& taken : taken_) {
    taken.fault.h = model_.system().h().segment(at, taken.sigma.size());
    taken.fault.sigma = sigma.segment(at, taken.sigma.size());
    at += taken.sigma.size();
    findings_.faults.push_back(taken.fault);
  }
  for (const Taken& taken : left_in_) findings_.faults.push_back(taken.fault);
  const bool is_in_model = model_.excess().v.size() > std::ssize(noise_->estimated);
  if (!is_in_model) return;
  findings_.lost_rows->share = ShareOf(model_.excess().v.tail<1>()[0]).value_or(0.5);
}

void FaultSearch::StateCovariance() {
  Eigen::MatrixXd spread =
      Eigen::MatrixXd::Zero(graph_->layout.free_size(), graph_->layout.free_size());
  const auto add = [&spread](const Eigen::VectorXd& d) { spread += d * d.transpose(); };
  Eigen::Index at = 0;
  for (const StatedFault& stated : stated_) at += stated.column.unknowns;
  for (const Taken& taken : taken_) {
    const FaultKind& kind = *candidates_[taken.candidate].kind;
    if (kind.varies != Varies::kNothing) spread += SpreadOf(taken, at);
    // If there are more significant faults than accepted ones, the accepted ones may be wrong.
    const bool is_told = taken.fault.is_trusted() && !findings_.misfit.has_more_faults;
    if (!is_told) add(taken.per_unknown * taken.fault.h);
    if (taken.by_rival.size() > 0) add(taken.by_rival);
    at += taken.fault.h.size();
  }
  for (const Taken& taken : left_in_) {
    add(taken.per_unknown * taken.fault.h);
    if (taken.by_rival.size() > 0) add(taken.by_rival);
  }
  if (findings_.lost_rows) {
    const double share = findings_.lost_rows->share;
    Eigen::VectorXd d = Eigen::VectorXd::Zero(graph_->layout.size);
    Eigen::Map<Eigen::Matrix3d>(d.data() + graph_->layout.sensitivity[Triad::kGyroscope]) =
        share / (1.0 - share) * graph_->sensitivity(Triad::kGyroscope);
    add(graph_->layout.basis.transpose() * d);
  }
  findings_.beyond = model_.system().BeyondGraph() + spread;
}

// Nonlinearities are reported with p and κ even if the quick test excluded them.
void FaultSearch::StateNotes() {
  for (const Candidate& candidate : candidates_) {
    if (!candidate.is_active || IsScan(candidate.kind->shape)) continue;
    FaultNote note{PlaceOf(candidate), candidate.test.log_p, candidate.kappa};
    if (candidate.test.rank > 0) {
      note.is_doubtful = note.log_p < std::log(kNoteLevel) && note.kappa > TakenFault::kTrusted;
    } else if (IsBend(*candidate.kind)) {
      const FaultColumn column = ColumnOf(candidate);
      const FaultTest test = TestOf(model_.system(),
                                    model_.excess(),
                                    model_.system().Projected(column),
                                    FormOf(candidate).SumsOf(WeightsOf(candidate)));
      note.log_p = test.log_p;
      note.kappa = KappaOf(column, test.T);
    }
    if (IsBend(*candidate.kind) || note.is_doubtful) findings_.notes.push_back(note);
  }
}

// C is the covariance with all stated faults but one. This fault widens C to C + G A^-1 G^T: G is
// the shift by its unknowns, and A the information of readings and prior on them.
void FaultSearch::StateWidening() {
  const Eigen::Index rows = model_.system().residual().size();
  for (const StatedFault& stated : stated_) {
    AddedColumns others;
    for (const StatedFault& other : stated_) {
      if (&other != &stated) others.Append(other.column, other.sigma, rows);
    }
    model_.SetColumns(std::move(others));
    const FaultSystem& system = model_.system();
    const Eigen::MatrixXd G = system.SharedShift(stated.column);
    Eigen::MatrixXd A = stated.column.Transposed(system.Projected(stated.column));
    A.diagonal() += stated.sigma.cwiseAbs2().cwiseInverse();
    const Eigen::MatrixXd root = Cholesky(A).SolveLower(Eigen::MatrixXd(G.transpose())).transpose();
    const double more = LargestInSigmas(graph_->layout, system.SharedCovariance(), root);
    findings_.widening.push_back(std::sqrt(1.0 + more * more));
  }
}

// The readings are corrected now, so that the graph's residuals are those that remain.
void FaultSearch::StateMisfit() {
  OverallMisfit& misfit = findings_.misfit;
  const Eigen::MatrixXd covariance = model_.system().covariance();
  if (misfit.has_more_faults) CountAsSystematic(covariance);
  for (const NoiseComponent component : noise_->estimated) {
    if (noise_->IsFromResiduals(component)) return;
  }
  for (Eigen::Index c = 0; c < std::ssize(noise_->estimated); ++c) {
    const double rest = model_.excess().rest[c];
    if (rest <= 0.0) continue;
    misfit.excess_ratio = std::max(misfit.excess_ratio, std::sqrt(model_.excess().v[c] / rest));
  }
  const double dof = ResidualDof(*graph_, model_.system());
  if (dof < 1.0) return;
  const double log_p = LogChiSquareUpper(model_.ChiSquareAtRest(), dof);
  misfit.is_unexplained =
      log_p < kMisfitLogP && misfit.excess_ratio > kMuchExcess && !findings_.lost_rows;
  if (misfit.is_unexplained && !misfit.has_more_faults) CountAsSystematic(covariance);
}

// If a noise component far exceeds its noise at rest, and its sensor has a fault with p < 1 %, the
// excess is treated as one error that all poses have in common; in runs of more than 64 poses, one
// error of each group of poses. The covariance that this error causes is added.
void FaultSearch::CountAsSystematic(const Eigen::MatrixXd& covariance) {
  for (std::size_t c = 0; c < noise_->estimated.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(c);
    const double v = model_.excess().v[at], rest = model_.excess().rest[at];
    const Triad triad = TriadOf(noise_->estimated[c]).value_or(Triad::kGyroscope);
    if (!(v > kMuchExcess * kMuchExcess * rest) || IsWhite(triad)) continue;
    findings_.misfit.is_systematic = true;
    double poses = 0.0;
    for (const FaultSystem::Part& part : model_.system().parts()) {
      if (part.component == at) poses += 1.0;
    }
    const auto stretches = static_cast<double>(scene_->stretches());
    const double shared = poses > FaultScene::kMostStretches ? poses / stretches : poses;
    findings_.beyond +=
        (shared - 1.0) * v * Congruence(covariance, noise_->estimate.sensitivities[c]);
  }
}

bool FaultSearch::IsWhite(Triad triad) const {
  return std::none_of(candidates_.begin(), candidates_.end(), [&](const Candidate& candidate) {
    return candidate.triad == triad && !IsScan(candidate.kind->shape) && candidate.test.rank > 0 &&
           candidate.test.log_p < std::log(kNoteLevel);
  });
}

bool FaultSearch::Settle() {
  for (int round = 0; round < kMostRounds; ++round) {
    model_.Relinearise();
    LookAtScene();
    StateColumns();
    model_.SettleExcess(kSettlingSteps);
    const FaultSystem& system = model_.system();
    if (LargestInSigmas(graph_->layout, system.covariance(), system.step()) < kSettledSigmas) {
      return true;
    }
  }
  return false;
}

// Adds a fault and corrects the readings for it. If the correction does not converge, or makes the
// recording less likely (as strong nonlinearity does), it is undone, and the σ of parameters are
// widened instead. If κ is above kTrusted, the fault's form determines how far parameters shift;
// the correction must then make the recording 1000 times more likely. Otherwise, one in a hundred
// clean recordings would have a parameter shifted by ten σ.
void FaultSearch::TryWith(Candidate* candidate) {
  const PoseGraph graph = *graph_;
  const NoiseState noise = *noise_;
  const TakenModel model = model_;
  const double before = model_.system().LogLikelihood();
  TakeIn(candidate);
  StateColumns();
  model_.SettleExcess(kSettlingSteps);
  const bool is_settled = Settle() && model_.is_settled();
  Taken& taken = taken_.back();
  const double gain = model_.system().LogLikelihood() - before;
  const bool is_told = taken.fault.kappa <= TakenFault::kTrusted
                           ? gain > 0.0
                           : gain + LogPriorOf(taken) > kRivalLogOdds;
  if (is_settled && is_told) return;
  const auto is_of = [&](const FaultPlace& place, const Candidate& other) {
    return other.kind == place.kind && other.triad == place.triad;
  };
  const std::vector<FaultPlace>& rivals = taken.fault.rivals;
  for (Candidate& other : candidates_) {
    const bool is_rival = std::any_of(
        rivals.begin(), rivals.end(), [&](const FaultPlace& rival) { return is_of(rival, other); });
    if (is_rival || is_of(taken.fault.place, other)) other.is_active = false;
  }
  taken.fault.is_corrected = false;
  taken.fault.h = candidate->test.h;
  taken.fault.sigma = candidate->test.T.rowwise().norm();
  left_in_.push_back(std::move(taken));
  taken_.pop_back();
  *graph_ = graph;
  *noise_ = noise;
  model_ = model;
  LookAtScene();
}

// Log of the prior probability of the accepted faults and the rejected readings. A fault has the
// probability 1 / (faults × its positions), a rejected reading 1 / readings; the fitted σ of either
// costs one more (Akaike 1974). A rejected reading has a small weight w. The likelihood treats 1/w
// as a variance and thus contains 1/2 rank log w, for the `rank` directions that others determine.
// This is replaced by the term of the most likely variance, |r|^2 / rank in units of the reading's
// noise.
double FaultSearch::LogPrior() const {
  double sum = 0.0;
  for (const Taken& taken : taken_) sum += LogPriorOf(taken);
  const FaultSystem& system = model_.system();
  const std::vector<VariancePart> parts = PartsOf(*graph_);
  const std::vector<DeletionTest> tests = DeletionTests(*graph_, system);
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const VariancePart& part = parts[i];
    const int rank = tests[i].rank;
    if (!part.rejected || rank == 0) continue;
    const Eigen::Index row = system.factors()[part.factor].row + part.row;
    const double own = std::max(system.WhitenedSquare(row) / part.weight / rank, 1.0);
    sum -= 0.5 * rank * (std::log(part.weight) + std::log(own) + 1.0);
    sum -= std::log(static_cast<double>(tests.size())) + 1.0;
  }
  return sum;
}

FaultFindings FaultSearch::Run() {
  ListCandidates();
  if (!stated_.empty()) {
    StateWidening();
    StateColumns();
    Settle();
  }
  ProjectForms();
  ShareBudget();
  while (!candidates_.empty()) {
    TestAll();
    Candidate* const clearest = taken_.size() < kMostFaults ? Clearest() : nullptr;
    if (!TakeLostRows(clearest != nullptr ? clearest->Score() : 0.0)) {
      if (clearest == nullptr) break;
      TryWith(clearest);
    }
    ProjectForms();
  }
  findings_.misfit.has_more_faults = taken_.size() == kMostFaults && Clearest() != nullptr;
  StateNotes();
  if (findings_.lost_rows) Settle();
  StateTaken();
  StateCovariance();
  if (HasChanged()) model_.StateEstimate();
  log_evidence_ = model_.system().LogLikelihood() + LogPrior();
  StateMisfit();
  return std::move(findings_);
}

// Numbers of poses with rejected readings, or before rejected turns.
std::vector<int> LeftOut(const PoseGraph& graph) {
  std::set<int> poses;
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& seen : node.observations) {
      if (seen.rejected) poses.insert(node.number);
    }
  }
  for (const IncrementEdge& edge : graph.increments) {
    if (edge.rejected) poses.insert(graph.nodes[edge.from].number);
  }
  return {poses.begin(), poses.end()};
}

// Readmits all rejected observations and turns, at full weight.
void Readmit(PoseGraph* graph) {
  const auto readmit = [](auto* one) {
    one->rejected = false;
    one->weight = 1.0;
  };
  for (PoseNode& node : graph->nodes) {
    for (Observation& seen : node.observations) readmit(&seen);
  }
  for (IncrementEdge& edge : graph->increments) readmit(&edge);
}

}  // namespace

FaultFindings FindFaults(const std::vector<StatedFault>& stated,
                         PoseGraph* graph,
                         NoiseState* noise,
                         ReducedSystem* system) {
  const std::vector<int> left_out = LeftOut(*graph);
  std::optional<PoseGraph> all;
  if (!left_out.empty()) all = *graph;
  NoiseState noise_of_all = *noise;
  FaultSearch search(stated, *system, graph, noise);
  FaultFindings found = search.Run();
  if (search.HasChanged()) system->Linearise(*graph);
  if (!all) return found;
  Readmit(&*all);
  FaultSearch of_all(stated, ReducedSystem(*all), &*all, &noise_of_all);
  if (!of_all.Settle()) return found;
  FaultFindings found_in_all = of_all.Run();
  // A fault of a single pose is equivalent to rejecting the pose.
  const auto is_more = [](const TakenFault& fault) {
    return fault.place.kind->shape != FaultShape::kOnce;
  };
  const double log_odds = of_all.log_evidence() - search.log_evidence();
  if (std::none_of(found_in_all.faults.begin(), found_in_all.faults.end(), is_more) ||
      !(log_odds > -kRivalLogOdds)) {
    return found;
  }
  if (log_odds > kRivalLogOdds) {
    *graph = *std::move(all);
    *noise = std::move(noise_of_all);
    system->Linearise(*graph);
    return found_in_all;
  }
  const Eigen::VectorXd apart = graph->layout.basis.transpose() * (all->shared - graph->shared);
  found.beyond += apart * apart.transpose();
  for (TakenFault& fault : found_in_all.faults) {
    if (!is_more(fault)) continue;
    fault.is_corrected = false;
    fault.left_out_instead = left_out;
    found.faults.push_back(std::move(fault));
  }
  return found;
}

}  // namespace truetriad
