// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/constancy.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "math/dense/eigenvalues.h"
#include "solve/reduced_system.h"
#include "solve/solve_graph.h"
#include "verdict/observability.h"

namespace truetriad {
namespace {

constexpr Triad kMagnetometer = Triad::kMagnetometer;
// Poses on each side of a change that tell it from a disturbed pose.
constexpr std::size_t kFewestPoses = 2;
// And in all: with fewer every step is as good as another.
constexpr std::size_t kFewestInAll = 8;
constexpr std::size_t kMostPoses = 200;
// So many left out by the robust step may be one side of a change.
constexpr std::ptrdiff_t kManyRejected = 2;
// Of a step on one of its sides, and of that share on the other; more than this of all is no
// handful of poses beside a magnet.
constexpr double kLeftOutShare = 0.25;
// Of residuals that are all that tells the noise.
constexpr double kMostExplained = 0.9;
// One explanation is named when its log likelihood is better by this: odds of 20.
constexpr double kClearlyBetter = 6.0;
// Below this share of the largest eigenvalue a component of a step is not seen.
constexpr double kNotSeen = 1e-6;

struct Place {
  std::size_t node = 0;
  int row = 0;  // of the triad in the node's rows
  bool rejected = false;
};

// In the order of time.
std::vector<Place> PlacesOf(const PoseGraph& graph, Triad triad) {
  std::vector<Place> places;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& seen = graph.nodes[k].observations;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].triad != triad) continue;
      places.push_back({k, 3 * static_cast<int>(i), seen[i].rejected});
    }
  }
  // Stretches of known rates come after the rests.
  std::stable_sort(places.begin(), places.end(), [&graph](const Place& a, const Place& b) {
    return graph.nodes[a.node].time_s < graph.nodes[b.node].time_s;
  });
  return places;
}

// A step's test at one place.
struct StepTest {
  double statistic = 0.0;
  int rank = 0;
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, Eigen::Dynamic, 3> shared;  // J^T D Z
};

// The derivatives of the rows by a vector at each place, and what D makes of them.
struct Columns {
  std::vector<Eigen::Matrix3d> own;  // of the place's three rows
  std::vector<Eigen::Index> rows;    // where they are
  StackedRows projected;             // D Z, all places side by side
};

Columns ColumnsOf(const ReducedSystem& system,
                  const std::vector<Place>& places,
                  std::vector<Eigen::Matrix3d> own) {
  Columns columns{std::move(own), {}, {}};
  StackedRows Z =
      StackedRows::Zero(system.residual().size(), 3 * static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    columns.rows.push_back(system.factors()[places[i].node].row + places[i].row);
    Z.block<3, 3>(columns.rows[i], 3 * static_cast<Eigen::Index>(i)) = columns.own[i];
  }
  columns.projected = system.Project(std::move(Z));
  return columns;
}

// Z^T P Z without the shared parameters, J^T D Z and Z^T P r of a vector that is the same at some
// places.
struct VectorSums {
  explicit VectorSums(Eigen::Index shared_size)
      : shared(Eigen::Matrix<double, Eigen::Dynamic, 3>::Zero(shared_size, 3)) {}

  // With what the place has by itself.
  void Add(const ReducedSystem& system, const Columns& columns, std::size_t i) {
    const Eigen::Index row = columns.rows[i];
    shared += system.B().middleRows<3>(row).transpose() * columns.own[i];
    u += columns.own[i].transpose() * system.projected().segment<3>(row);
  }

  StepTest Test(const ReducedSystem& system) const {
    StepTest test;
    test.shared = shared;
    const Eigen::Matrix3d information = whole - shared.transpose() * (system.covariance() * shared);
    const SymmetricEigen3 solver = EigenOfSymmetric3(information);
    for (int axis = 0; axis < 3; ++axis) {
      const double eigenvalue = solver.values[axis];
      if (eigenvalue <= kNotSeen * solver.values[2]) continue;
      const Eigen::Vector3d direction = solver.vectors.col(axis);
      const double share = direction.dot(u) / eigenvalue;
      test.statistic += share * share * eigenvalue;
      test.step -= share * direction;
      test.covariance += direction * direction.transpose() / eigenvalue;
      ++test.rank;
    }
    return test;
  }

  Eigen::Matrix3d whole = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, Eigen::Dynamic, 3> shared;
  Eigen::Vector3d u = Eigen::Vector3d::Zero();
};

// The places that have a step, of those on both sides of it.
enum class Side { kBefore, kAfter };

// The tests of a step at every place, in their order: right before it.
std::vector<StepTest> TestSteps(const ReducedSystem& system, const Columns& columns, Side side) {
  const std::size_t count = columns.own.size();
  StackedRows projected = StackedRows::Zero(columns.projected.rows(), 3);
  VectorSums sums(system.size());
  std::vector<StepTest> tests(count);
  for (std::size_t done = 0; done < count; ++done) {
    const std::size_t i = side == Side::kAfter ? count - 1 - done : done;
    const auto own = columns.projected.middleCols<3>(3 * static_cast<Eigen::Index>(i));
    const Eigen::Matrix3d across =
        columns.own[i].transpose() * projected.middleRows<3>(columns.rows[i]);
    sums.whole += across + across.transpose() +
                  columns.own[i].transpose() * own.middleRows<3>(columns.rows[i]);
    projected += own;
    sums.Add(system, columns, i);
    if (side == Side::kAfter) tests[i] = sums.Test(system);
    if (side == Side::kBefore && i + 1 < count) tests[i + 1] = sums.Test(system);
  }
  return tests;
}

// Of what is there at places [first, end) alone.
StepTest TestTransient(const ReducedSystem& system,
                       const Columns& columns,
                       std::size_t first,
                       std::size_t end) {
  VectorSums sums(system.size());
  for (std::size_t i = first; i < end; ++i) {
    for (std::size_t k = first; k < end; ++k) {
      sums.whole +=
          columns.own[i].transpose() *
          columns.projected.block<3, 3>(columns.rows[i], 3 * static_cast<Eigen::Index>(k));
    }
    sums.Add(system, columns, i);
  }
  return sums.Test(system);
}

// The same poses with every reading of the magnetometer counting fully, solved again.
PoseGraph WithoutWeights(const PoseGraph& graph, const std::vector<Place>& places) {
  PoseGraph whole = graph;
  for (const Place& place : places) {
    Observation& seen =
        whole.nodes[place.node].observations[static_cast<std::size_t>(place.row / 3)];
    seen.rejected = false;
    seen.weight = 1.0;
  }
  SolveGraph(&whole, kRoundTolerance);
  return whole;
}

// A robust fit that takes the readings on one side of a step for disturbed leaves out a good part
// of them and hardly any of the other side; single poses beside a magnet do not lie so.
bool LooksLeftOut(const std::vector<Place>& places, std::size_t first) {
  const auto share = [](auto from, auto to) {
    const auto count = std::count_if(from, to, [](const Place& place) { return place.rejected; });
    return static_cast<double>(count) / static_cast<double>(to - from);
  };
  const auto step = places.begin() + static_cast<std::ptrdiff_t>(first);
  const double before = share(places.begin(), step), after = share(step, places.end());
  if (share(places.begin(), places.end()) >= kLeftOutShare) return true;
  return std::max(before, after) >= kLeftOutShare &&
         std::min(before, after) <= kLeftOutShare * std::max(before, after);
}

// A fit of the few poses that are left says nothing of the noise.
bool IsMostlyLeftOut(const PoseGraph& graph) {
  double rejected = 0.0, all = 0.0;
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& seen : node.observations) {
      all += 1.0;
      rejected += seen.rejected ? 1.0 : 0.0;
    }
  }
  return rejected > kLeftOutShare * all;
}

// How the free coordinates move by the step at `at`, for the poses before it and those from it on.
struct MovedByStep {
  double later_share = 0.0;
  Eigen::VectorXd before, after;
};

MovedByStep MovedBy(const std::vector<StepTest>& tests,
                    std::size_t at,
                    const ReducedSystem& system) {
  const auto count = static_cast<double>(tests.size());
  const StepTest& test = tests[at];
  return {(count - static_cast<double>(at)) / count,
          system.covariance() * (test.shared * test.step),
          system.covariance() * ((test.shared - tests[0].shared) * test.step)};
}

// By how many σ a parameter is off at most without the step.
double EffectOf(const MovedByStep& moved, const PoseGraph& graph, const ReducedSystem& system) {
  return std::max(LargestInSigmas(graph, system.covariance(), moved.before),
                  LargestInSigmas(graph, system.covariance(), moved.after));
}

// What was left out may be one side of a change, or a part of it: allows the places where it looks
// like that, and no others. Returns whether there are any.
bool AllowWhereLeftOut(const std::vector<Place>& places, std::vector<bool>* allowed) {
  const auto rejected = std::count_if(
      places.begin(), places.end(), [](const Place& place) { return place.rejected; });
  bool any = false;
  for (std::size_t first = kFewestPoses; first + kFewestPoses <= places.size(); ++first) {
    (*allowed)[first] = rejected >= kManyRejected && LooksLeftOut(places, first);
    any = any || (*allowed)[first];
  }
  return any;
}

// What a bias is seen through at each place.
std::vector<Eigen::Matrix3d> SensitivitiesAt(const PoseGraph& graph,
                                             const std::vector<Place>& places,
                                             Triad triad) {
  std::vector<Eigen::Matrix3d> sensitivities;
  for (const Place& place : places) {
    sensitivities.push_back(graph.ModelAt(triad, graph.nodes[place.node]).sensitivity);
  }
  return sensitivities;
}

// The likeliest step of the triad's bias among the allowed places, of which there is one. Turns
// know the bias on one side of it: then it may be on the other.
BiasStep LikeliestBiasStep(const PoseGraph& graph,
                           const ReducedSystem& system,
                           const std::vector<Place>& places,
                           const OwnResiduals& own,
                           Triad triad,
                           const std::vector<bool>& allowed) {
  const Columns columns = ColumnsOf(system, places, SensitivitiesAt(graph, places, triad));
  std::vector<Side> sides = {Side::kAfter};
  if (triad == Triad::kGyroscope && !graph.increments.empty()) sides.push_back(Side::kBefore);
  const auto count = static_cast<double>(places.size());
  std::optional<StepTest> best;
  std::size_t first = 0;  // after it
  double share = 0.0;     // of the places, that have it
  for (const Side side : sides) {
    const std::vector<StepTest> tests = TestSteps(system, columns, side);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!allowed[i] || (best && tests[i].statistic <= best->statistic)) continue;
      best = tests[i];
      first = i;
      share = static_cast<double>(side == Side::kAfter ? places.size() - i : i) / count;
    }
  }
  BiasStep step;
  step.node = places[first].node;
  step.p_value = std::min(
      1.0, static_cast<double>(sides.size()) * count * own.ChanceOf(best->statistic, best->rank));
  step.chi2 = best->statistic;
  step.size = best->step.norm();
  // About the mean bias of all places; turns have no such step.
  const int at = graph.layout.bias[triad];
  const Eigen::VectorXd bias_step =
      graph.layout.basis.middleRows<3>(at).transpose() * (graph.sensitivity(triad) * best->step);
  step.moved = system.covariance() * (best->shared * best->step) - share * bias_step;
  step.effect_sigmas = LargestInSigmas(graph, system.covariance(), step.moved);
  return step;
}

// The search for a change in one solution of the graph.
class ChangeSearch {
 public:
  ChangeSearch(const PoseGraph& graph,
               const ReducedSystem& system,
               const std::vector<Place>& places,
               const NoiseState& noise,
               bool counts_as_estimated)
      : graph_(graph),
        system_(system),
        places_(places),
        noise_(noise),
        own_(OwnResidualsOf(graph, system, noise, kMagnetometer, kChangeLevel)) {
    own_.is_estimated = own_.is_estimated || counts_as_estimated;
    std::vector<Eigen::Matrix3d> by_bias = SensitivitiesAt(graph, places, kMagnetometer), by_field;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const PoseNode& node = graph.nodes[places[i].node];
      by_field.push_back(
          node.kind == PoseKind::kDirection
              ? Eigen::Matrix3d::Zero()
              : Eigen::Matrix3d(by_bias[i] * node.rotation().toRotationMatrix().transpose()));
    }
    by_bias_ = ColumnsOf(system, places, std::move(by_bias));
    by_field_ = ColumnsOf(system, places, std::move(by_field));
    bias_ = TestSteps(system, by_bias_, Side::kAfter);
    field_ = TestSteps(system, by_field_, Side::kAfter);
  }

  // Of a change right before a place, the better of both kinds, shared out over all places.
  double PValueAt(std::size_t first) const {
    return std::min(1.0, Tests() * std::min(PValue(bias_[first]), PValue(field_[first])));
  }

  // Twice the log likelihood that a change there adds.
  double LikelihoodAt(std::size_t first) const {
    return std::max(Likelihood(bias_[first]), Likelihood(field_[first]));
  }

  // The likeliest change at those places that are `allowed`; unset where it may be chance.
  std::optional<MagnetometerChange> Find(const std::vector<bool>& allowed) const {
    std::optional<std::size_t> best;
    for (std::size_t first = 0; first < places_.size(); ++first) {
      if (!allowed[first]) continue;
      if (!best || LikelihoodAt(first) > LikelihoodAt(*best)) best = first;
    }
    if (!best || PValueAt(*best) > kChangeLevel) return std::nullopt;
    if (auto transient = TransientBeyond(LikelihoodAt(*best))) {
      return transient->p_value > kChangeLevel ? std::nullopt : transient;
    }
    MagnetometerChange found = At(*best);
    if (found.p_value > kChangeLevel) return std::nullopt;
    for (std::size_t first = 0; first < places_.size(); ++first) {
      if (!allowed[first] || LikelihoodAt(first) < LikelihoodAt(*best) - kClearlyBetter) continue;
      found.earliest = std::min(found.earliest, places_[first].node);
      found.latest = std::max(found.latest, places_[first].node);
    }
    return found;
  }

  MagnetometerChange At(std::size_t first) const {
    MagnetometerChange change = ChangeOf(bias_[first],
                                         field_[first],
                                         MovedBy(bias_, first, system_),
                                         MovedBy(field_, first, system_));
    change.node = change.earliest = change.latest = places_[first].node;
    change.p_value =
        std::min(1.0, Tests() * Chance(bias_[first], field_[first], first, places_.size()));
    return change;
  }

 private:
  // A quick look: what is left is taken to be less than it is.
  double PValue(const StepTest& test) const { return own_.ChanceOf(test.statistic, test.rank); }
  // The same of the likelier of two steps at places [first, end), with what is left beside it.
  double Chance(const StepTest& bias,
                const StepTest& field,
                std::size_t first,
                std::size_t end) const {
    const auto chance_of = [&](const StepTest& test, const Columns& columns) {
      FittedBeside beside{
          StackedRows::Zero(columns.projected.rows(), 3), test.covariance, test.step};
      for (std::size_t i = first; i < end; ++i) {
        beside.projected += columns.projected.middleCols<3>(3 * static_cast<Eigen::Index>(i));
      }
      beside.projected -= system_.B() * (system_.covariance() * test.shared);
      const OwnResiduals left = OwnResidualsOf(
          graph_, system_, noise_, kMagnetometer, kChangeLevel, /*of_poses=*/false, &beside);
      return own_.ChanceBeside(test.statistic, test.rank, left);
    };
    return std::min(chance_of(bias, by_bias_), chance_of(field, by_field_));
  }
  double Likelihood(const StepTest& test) const {
    return own_.LikelihoodOf(test.statistic, test.rank);
  }
  double Tests() const { return 2.0 * static_cast<double>(places_.size() - 2 * kFewestPoses + 1); }

  // The likeliest few poses in a row that are off alike, if more than `likelihood`.
  std::optional<MagnetometerChange> TransientBeyond(double likelihood) const {
    struct Transient {
      StepTest bias, field;
      std::size_t first = 0, end = 0;
    };
    std::optional<Transient> likeliest;
    for (std::size_t length = 1; length <= kLongestTransient; ++length) {
      for (std::size_t first = kFewestPoses; first + length + kFewestPoses <= places_.size();
           ++first) {
        const StepTest bias = TestTransient(system_, by_bias_, first, first + length);
        const StepTest field = TestTransient(system_, by_field_, first, first + length);
        if (std::max(Likelihood(bias), Likelihood(field)) <= likelihood) continue;
        likelihood = std::max(Likelihood(bias), Likelihood(field));
        likeliest = Transient{bias, field, first, first + length};
      }
    }
    if (!likeliest) return std::nullopt;
    const auto& [bias, field, first, end] = *likeliest;
    // The solution is off by that for all poses alike.
    const auto moved = [this](const StepTest& test) {
      const Eigen::VectorXd by = system_.covariance() * (test.shared * test.step);
      return MovedByStep{0.0, by, by};
    };
    MagnetometerChange found = ChangeOf(bias, field, moved(bias), moved(field));
    found.node = found.earliest = found.latest = places_[first].node;
    found.last = places_[end - 1].node;
    found.p_value =
        std::min(1.0, (1.0 + kLongestTransient) * Tests() * Chance(bias, field, first, end));
    return found;
  }

  // By both explanations and what each does to the parameters.
  MagnetometerChange ChangeOf(const StepTest& bias,
                              const StepTest& field,
                              const MovedByStep& moved_by_bias,
                              const MovedByStep& moved_by_field) const {
    const double better = Likelihood(bias) - Likelihood(field);
    const double by_bias = EffectOf(moved_by_bias, graph_, system_);
    const double by_field = EffectOf(moved_by_field, graph_, system_);
    const MovedByStep& moved = better < 0.0 ? moved_by_field : moved_by_bias;
    MagnetometerChange change;
    change.bias_ut = bias.step;
    change.field_ut = field.step;
    change.covariance = (1.0 - moved.later_share) * moved.before * moved.before.transpose() +
                        moved.later_share * moved.after * moved.after.transpose();
    change.explained_share = std::max(bias.statistic, field.statistic) / own_.chi2;
    if (better > kClearlyBetter) {
      change.kind = ChangeKind::kBias;
      change.effect_sigmas = by_bias;
    } else if (better < -kClearlyBetter) {
      change.kind = ChangeKind::kField;
      change.effect_sigmas = by_field;
    } else {
      change.kind = ChangeKind::kEither;
      change.effect_sigmas = std::min(by_bias, by_field);
    }
    return change;
  }

  const PoseGraph& graph_;
  const ReducedSystem& system_;
  const std::vector<Place>& places_;
  const NoiseState& noise_;
  OwnResiduals own_;
  Columns by_bias_, by_field_;
  std::vector<StepTest> bias_, field_;
};

}  // namespace

std::optional<MagnetometerChange> FindMagnetometerChange(const PoseGraph& settled,
                                                         const ReducedSystem& settled_system,
                                                         const NoiseState& noise) {
  if (!settled.layout.Has(kMagnetometer) || noise.unknown) return std::nullopt;
  const std::vector<Place> places = PlacesOf(settled, kMagnetometer);
  if (places.size() < kFewestInAll || places.size() > kMostPoses) return std::nullopt;
  const auto rejected = std::count_if(
      places.begin(), places.end(), [](const Place& place) { return place.rejected; });
  if (settled_system.rank() < settled_system.size()) return std::nullopt;
  std::vector<bool> allowed(places.size(), false);
  std::fill(allowed.begin() + kFewestPoses, allowed.end() - (kFewestPoses - 1), true);
  std::optional<MagnetometerChange> found;
  if (!IsMostlyLeftOut(settled)) {
    found = ChangeSearch(settled, settled_system, places, noise, /*counts_as_estimated=*/false)
                .Find(allowed);
  }
  const bool is_table = noise.source[kMagnetometer] == NoiseSource::kResidual;
  const auto is_too_little = [is_table](const std::optional<MagnetometerChange>& change) {
    return is_table && change && change->explained_share < kMostExplained;
  };
  if (is_too_little(found)) found.reset();
  if (rejected == 0) return found;
  AllowWhereLeftOut(places, &allowed);
  for (std::size_t first = 0; found && first < places.size(); ++first) {
    allowed[first] = allowed[first] || places[first].node == found->node;
  }
  const PoseGraph whole = WithoutWeights(settled, places);
  const ReducedSystem whole_system(whole);
  if (whole_system.rank() == whole_system.size()) {
    const auto among_all =
        ChangeSearch(whole, whole_system, places, noise, /*counts_as_estimated=*/true)
            .Find(allowed);
    // Few poses that are off alike have been left out one by one.
    if (among_all && !among_all->last && !is_too_little(among_all) &&
        (!found || among_all->p_value <= found->p_value))
      found = among_all;
  }
  if (found) found->p_value = std::min(1.0, 2.0 * found->p_value);
  return found && found->p_value > kChangeLevel ? std::nullopt : found;
}

std::optional<BiasStep> FindBiasStep(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const NoiseState& noise,
                                     Triad triad) {
  const std::vector<Place> places = PlacesOf(graph, triad);
  if (places.size() < kFewestInAll || places.size() > kMostPoses) return {};
  std::vector<bool> allowed(places.size(), false);
  std::fill(allowed.begin() + kFewestPoses, allowed.end() - (kFewestPoses - 1), true);
  OwnResiduals own = OwnResidualsOf(graph, system, noise, triad, kChangeLevel, /*of_poses=*/true);
  BiasStep found = LikeliestBiasStep(graph, system, places, own, triad, allowed);
  if (!AllowWhereLeftOut(places, &allowed)) return found;
  const PoseGraph whole = WithoutWeights(graph, places);
  const ReducedSystem whole_system(whole);
  if (whole_system.rank() < whole_system.size()) return found;
  own = OwnResidualsOf(whole, whole_system, noise, triad, kChangeLevel, /*of_poses=*/true);
  own.is_estimated = true;
  BiasStep among_all = LikeliestBiasStep(whole, whole_system, places, own, triad, allowed);
  if (found.p_value <= among_all.p_value) return found;
  among_all.p_value = std::min(1.0, 2.0 * among_all.p_value);
  among_all.moved += graph.layout.basis.transpose() * (graph.shared - whole.shared);
  among_all.effect_sigmas = LargestInSigmas(graph, system.covariance(), among_all.moved);
  return among_all;
}

}  // namespace truetriad
