// SPDX-License-Identifier: Apache-2.0
//
// Robust centre and covariance: from some starts that chance has no part in (as
// Hubert, Rousseeuw and Verdonck 2012 do) the three quarters of the units with
// the smallest distances, found again and again (Rousseeuw and Van Driessen
// 1999); of these cores the one of the least determinant; then all units that
// are no outliers, until they stay.
#include "line/outliers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Units for each parameter, at least: three quarters of them then have a
// covariance to speak of.
constexpr Index kUnitsOfParameter = 4;
// Of the units: those that have a value of a parameter that is used.
constexpr double kLeastShareOfUnits = 0.9;
constexpr double kCore = 0.75;
// Robust σ at which values are clipped for the start.
constexpr double kClip = 2.0;
constexpr int kMostSteps = 10;
// The start is found with so many units; more would not make it better.
constexpr Index kMostStartUnits = 5000;
// Of the units in the start's reach that are kept, before the number of units
// is allowed for.
constexpr double kKept = 0.975;

// Units of the robust estimate, a column each, in robust σ about the median.
struct Cloud {
  std::vector<int> units;
  MatrixXd values;
};

struct CentreAndRoot {
  VectorXd centre;
  Cholesky root;
  double count = 0.0;
};

VectorXd SquaredDistances(const MatrixXd& values, const CentreAndRoot& about) {
  return about.root.SolveLower(values.colwise() - about.centre).colwise().squaredNorm().transpose();
}

CentreAndRoot MomentsOf(const MatrixXd& values, const std::vector<Index>& some) {
  MatrixXd selected(values.rows(), static_cast<Index>(some.size()));
  for (std::size_t k = 0; k < some.size(); ++k) {
    selected.col(static_cast<Index>(k)) = values.col(some[k]);
  }
  CentreAndRoot moments;
  moments.count = static_cast<double>(some.size());
  moments.centre = selected.rowwise().mean();
  selected.colwise() -= moments.centre;
  moments.root = Cholesky(TimesTranspose(selected, selected) / (moments.count - 1.0));
  return moments;
}

std::vector<Index> All(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

// The `count` units with the smallest distances, in their order.
std::vector<Index> Nearest(const VectorXd& distances, Index count) {
  std::vector<Index> order = All(distances.size());
  std::nth_element(order.begin(), order.begin() + count - 1, order.end(), [&](Index a, Index b) {
    return distances[a] < distances[b];
  });
  order.resize(static_cast<std::size_t>(count));
  std::sort(order.begin(), order.end());
  return order;
}

// Some units spread evenly over all.
MatrixXd Sampled(const MatrixXd& values) {
  const Index count = values.cols();
  if (count <= kMostStartUnits) return values;
  MatrixXd sampled(values.rows(), kMostStartUnits);
  for (Index k = 0; k < kMostStartUnits; ++k)
    sampled.col(k) = values.col(k * count / kMostStartUnits);
  return sampled;
}

// What units are far from by a scatter that spoilt units may have drawn towards
// them: along its own axes their spread is found anew, from medians, which they
// hold against.
VectorXd DistancesAlongAxes(const MatrixXd& values, const MatrixXd& scatter) {
  const MatrixXd along = TransposeTimes(EigenOfSymmetric(scatter).vectors, values);
  VectorXd distances = VectorXd::Zero(values.cols());
  for (Index axis = 0; axis < along.rows(); ++axis) {
    const VectorXd own = along.row(axis).transpose();
    const RobustMoments robust = RobustMomentsOf({own.begin(), own.end()});
    // Half of the units are the same along it.
    if (!(robust.sigma > 0.0)) continue;
    distances += ((own.array() - robust.centre) / robust.sigma).square().matrix();
  }
  return distances;
}

// Distances to start from, of which one at least is not misled: by correlations
// of clipped values; along the axes of these, of the units' directions alone,
// and of the half nearest to the median.
std::vector<VectorXd> Starts(const MatrixXd& values) {
  const Index count = values.cols();
  const MatrixXd clipped = values.cwiseMax(-kClip).cwiseMin(kClip);
  const CentreAndRoot of_clipped = MomentsOf(clipped, All(count));
  const MatrixXd directions = values.colwise().normalized();
  const CentreAndRoot of_half =
      MomentsOf(values, Nearest(values.colwise().squaredNorm().transpose(), (count + 1) / 2));
  const auto along_axes_of = [&values](const CentreAndRoot& moments) {
    const MatrixXd root = moments.root.Root();
    return DistancesAlongAxes(values, TimesTranspose(root, root));
  };
  std::vector<VectorXd> starts = {
      SquaredDistances(values, of_clipped),
      along_axes_of(of_clipped),
      DistancesAlongAxes(values, TimesTranspose(directions, directions))};
  if (of_half.root.is_positive()) starts.push_back(along_axes_of(of_half));
  return starts;
}

// The core that a start leads to.
CentreAndRoot CoreFrom(const MatrixXd& values, const VectorXd& start) {
  const Index count = values.cols();
  const Index core = static_cast<Index>(std::ceil(kCore * static_cast<double>(count)));
  CentreAndRoot about = MomentsOf(values, Nearest(start, (count + 1) / 2));
  std::vector<Index> nearest;
  for (int round = 0; round < kMostSteps && about.root.is_positive(); ++round) {
    std::vector<Index> next = Nearest(SquaredDistances(values, about), core);
    if (next == nearest) break;
    nearest = std::move(next);
    about = MomentsOf(values, nearest);
  }
  return about;
}

// Centre and covariance of the core, that of the least determinant, its
// covariance scaled so that the median distance is that of normal values.
CentreAndRoot Core(const MatrixXd& values) {
  CentreAndRoot about;
  double least = std::numeric_limits<double>::infinity();
  for (const VectorXd& start : Starts(values)) {
    CentreAndRoot core = CoreFrom(values, start);
    if (!core.root.is_positive()) return core;
    const double determinant = core.root.LogDeterminant();
    if (!(determinant < least)) continue;
    least = determinant;
    about = std::move(core);
  }
  const VectorXd distances = SquaredDistances(values, about);
  const double scale = Median({distances.begin(), distances.end()}) /
                       ChiSquareQuantile(0.5, static_cast<double>(values.rows()));
  const MatrixXd root = std::sqrt(scale) * about.root.Root();
  about.root = Cholesky(TimesTranspose(root, root));
  return about;
}

struct Judged {
  CentreAndRoot about;
  VectorXd distances;     // squared
  std::vector<double> p;  // adjusted
  std::vector<double> own_p;
};

// From the units in the core's reach to all that are no outliers.
// `all`: units that are judged anywhere.
Judged Judge(const MatrixXd& values, const CentreAndRoot& core, double level, double all) {
  const int dimension = static_cast<int>(values.rows());
  const auto count = static_cast<std::size_t>(values.cols());
  const VectorXd from_core = SquaredDistances(values, core);
  std::vector<bool> good(count);
  const double reach = ChiSquareQuantile(kKept, dimension);
  for (std::size_t k = 0; k < count; ++k) good[k] = from_core[static_cast<Index>(k)] <= reach;
  Judged judged;
  judged.p.resize(count);
  judged.own_p.resize(count);
  // What is cut off made the first covariance smaller by this.
  double shrunk = ChiSquareCdf(reach, dimension + 2.0) / kKept;
  for (int round = 0; round < kMostSteps; ++round) {
    std::vector<Index> clean;
    for (std::size_t k = 0; k < count; ++k) {
      if (good[k]) clean.push_back(static_cast<Index>(k));
    }
    judged.about = MomentsOf(values, clean);
    judged.distances = SquaredDistances(values, judged.about) * shrunk;
    shrunk = 1.0;
    const double n = judged.about.count;
    bool same = true;
    for (std::size_t k = 0; k < count; ++k) {
      const double variance = good[k] ? 1.0 - 1.0 / n : 1.0 + 1.0 / n;
      const double t2 = judged.distances[static_cast<Index>(k)] / variance;
      judged.own_p[k] = HotellingUpper(dimension, t2, n, good[k]);
      judged.p[k] = -std::expm1(all * std::log1p(-judged.own_p[k]));
      const bool is_good = !(judged.p[k] < level);
      same = same && is_good == good[k];
      good[k] = is_good;
    }
    if (same) break;
  }
  return judged;
}

bool HasValue(const UnitRecord& unit, int parameter) {
  return parameter < unit.values.size() && std::isfinite(unit.values[parameter]);
}

// Units of stations that have the same parameters.
struct Group {
  std::vector<std::string> stations;
  std::vector<int> units;
};

// Of a station nine of ten units have them.
std::vector<int> SharedParameters(const LineData& data, const std::vector<int>& units) {
  std::vector<int> counts(data.parameters.size(), 0);
  for (const int unit : units) {
    for (int parameter = 0; parameter < static_cast<int>(counts.size()); ++parameter) {
      const auto place = static_cast<std::size_t>(parameter);
      counts[place] += HasValue(data.units[static_cast<std::size_t>(unit)], parameter) ? 1 : 0;
    }
  }
  std::vector<int> shared;
  const double most = counts.empty() ? 0.0 : *std::max_element(counts.begin(), counts.end());
  for (std::size_t c = 0; c < counts.size(); ++c) {
    if (counts[c] > 0 && counts[c] >= kLeastShareOfUnits * most) {
      shared.push_back(static_cast<int>(c));
    }
  }
  return shared;
}

std::map<std::vector<int>, Group> GroupsOf(const LineData& data, const std::vector<int>& units) {
  std::map<std::string, std::vector<int>> of_station;
  for (const int unit : units) {
    of_station[TagOf(data.units[static_cast<std::size_t>(unit)], "station")].push_back(unit);
  }
  std::map<std::vector<int>, Group> groups;  // by their parameters
  for (const auto& [station, own] : of_station) {
    Group& group = groups[SharedParameters(data, own)];
    group.stations.push_back(station);
    group.units.insert(group.units.end(), own.begin(), own.end());
  }
  for (auto& [parameters, group] : groups) std::sort(group.units.begin(), group.units.end());
  return groups;
}

// Of these parameters those that vary, with robust centre and σ.
OutlierSet ChooseParameters(const LineData& data,
                            const Group& group,
                            const std::vector<int>& parameters) {
  OutlierSet set;
  set.stations = group.stations;
  for (const int parameter : parameters) {
    std::vector<double> column;
    for (const int unit : group.units) {
      const UnitRecord& record = data.units[static_cast<std::size_t>(unit)];
      if (HasValue(record, parameter)) column.push_back(record.values[parameter]);
    }
    if (!Varies(column)) continue;
    const RobustMoments robust = RobustMomentsOf(column);
    if (!(robust.sigma > 0.0)) continue;
    set.parameters.push_back(parameter);
    set.centre.push_back(robust.centre);
    set.sigma.push_back(robust.sigma);
  }
  return set;
}

Cloud CloudOf(const LineData& data, const std::vector<int>& units, const OutlierSet& set) {
  Cloud cloud;
  const auto has_all = [&](const UnitRecord& unit) {
    return std::all_of(set.parameters.begin(), set.parameters.end(), [&](int parameter) {
      return HasValue(unit, parameter);
    });
  };
  for (const int unit : units) {
    if (has_all(data.units[static_cast<std::size_t>(unit)])) cloud.units.push_back(unit);
  }
  cloud.values.resize(static_cast<Index>(set.parameters.size()),
                      static_cast<Index>(cloud.units.size()));
  for (std::size_t k = 0; k < cloud.units.size(); ++k) {
    const VectorXd& values = data.units[static_cast<std::size_t>(cloud.units[k])].values;
    for (std::size_t c = 0; c < set.parameters.size(); ++c) {
      cloud.values(static_cast<Index>(c), static_cast<Index>(k)) =
          (values[set.parameters[c]] - set.centre[c]) / set.sigma[c];
    }
  }
  return cloud;
}

// Without parameters that others determine.
void DropDependent(OutlierSet* set, Cloud* cloud) {
  const MatrixXd clipped = Sampled(cloud->values).cwiseMax(-kClip).cwiseMin(kClip);
  const MatrixXd about_mean = clipped.colwise() - VectorXd(clipped.rowwise().mean());
  const std::vector<Index> kept = IndependentColumns(TimesTranspose(about_mean, about_mean));
  OutlierSet left;
  MatrixXd values(static_cast<Index>(kept.size()), cloud->values.cols());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const auto place = static_cast<std::size_t>(kept[k]);
    values.row(static_cast<Index>(k)) = cloud->values.row(kept[k]);
    left.parameters.push_back(set->parameters[place]);
    left.centre.push_back(set->centre[place]);
    left.sigma.push_back(set->sigma[place]);
  }
  cloud->values = std::move(values);
  left.stations = set->stations;
  *set = std::move(left);
}

std::vector<OutlierShare> SharesOf(const OutlierSet& set,
                                   const CentreAndRoot& about,
                                   const MatrixXd& inverse,
                                   const VectorXd& value,
                                   int most) {
  const VectorXd deviation = value - about.centre;
  const VectorXd pull = TimesVector(inverse, deviation);
  const VectorXd sigma = about.root.Root().rowwise().norm();
  std::vector<OutlierShare> shares;
  for (std::size_t c = 0; c < set.parameters.size(); ++c) {
    const auto row = static_cast<Index>(c);
    shares.push_back(
        {set.parameters[c], deviation[row] / sigma[row], pull[row] / std::sqrt(inverse(row, row))});
  }
  std::sort(shares.begin(), shares.end(), [](const OutlierShare& a, const OutlierShare& b) {
    return std::abs(a.conditional) > std::abs(b.conditional);
  });
  shares.resize(std::min(shares.size(), static_cast<std::size_t>(std::max(most, 0))));
  return shares;
}

void AddOutliers(const Cloud& cloud,
                 const Judged& judged,
                 const OutlierOptions& options,
                 OutlierSet set,
                 OutlierReport* report) {
  const MatrixXd inverse = judged.about.root.Inverse();
  for (std::size_t k = 0; k < cloud.units.size(); ++k) {
    const auto column = static_cast<Index>(k);
    const double distance = std::sqrt(judged.distances[column]);
    report->distances[static_cast<std::size_t>(cloud.units[k])] = distance;
    if (!(judged.p[k] < options.level)) continue;
    Outlier outlier{cloud.units[k], distance, judged.own_p[k], judged.p[k], {}};
    outlier.shares =
        SharesOf(set, judged.about, inverse, cloud.values.col(column), options.most_parameters);
    report->outliers.push_back(std::move(outlier));
  }
  const VectorXd sigma = judged.about.root.Root().rowwise().norm();
  for (std::size_t c = 0; c < set.parameters.size(); ++c) {
    const auto row = static_cast<Index>(c);
    set.centre[c] += set.sigma[c] * judged.about.centre[row];
    set.sigma[c] *= sigma[row];
  }
  report->sets.push_back(std::move(set));
}

// Why units were not judged; empty: they were. `all`: units that are judged anywhere.
std::string JudgeGroup(const LineData& data,
                       const Group& group,
                       const std::vector<int>& parameters,
                       const OutlierOptions& options,
                       double all,
                       OutlierReport* report) {
  OutlierSet set = ChooseParameters(data, group, parameters);
  Cloud cloud = CloudOf(data, group.units, set);
  const auto wanted = static_cast<Index>(set.parameters.size());
  if (cloud.values.cols() > 1) DropDependent(&set, &cloud);
  set.units = static_cast<int>(cloud.units.size());
  const Index dimension = cloud.values.rows();
  if (dimension == 0 || cloud.values.cols() < kUnitsOfParameter * dimension) {
    // Of so few units as there are parameters any seem to determine the others.
    const Index needed = cloud.values.cols() > wanted ? dimension : wanted;
    return std::to_string(set.units) + " units have all " + std::to_string(needed) +
           " parameters, which takes " +
           std::to_string(kUnitsOfParameter * std::max<Index>(needed, 1));
  }
  const CentreAndRoot core = Core(Sampled(cloud.values));
  if (!core.root.is_positive()) return "most units are the same";
  const Judged judged = Judge(cloud.values, core, options.level, all);
  const double n = judged.about.count;
  const double own_level = -std::expm1(std::log1p(-options.level) / all);
  set.limit =
      std::sqrt((1.0 + 1.0 / n) * HotellingLimit(static_cast<int>(dimension), own_level, n, false));
  AddOutliers(cloud, judged, options, std::move(set), report);
  return "";
}

std::string NamesOf(const std::vector<std::string>& stations) {
  std::string names;
  for (const std::string& station : stations) {
    names += (names.empty() ? "" : ", ") + (station.empty() ? "(no station)" : station);
  }
  return names;
}

// Those that have a value.
std::vector<int> UnitsToJudge(const LineData& data) {
  std::vector<int> units;
  for (std::size_t unit = 0; unit < data.units.size(); ++unit) {
    if (data.units[unit].values.array().isFinite().any()) units.push_back(static_cast<int>(unit));
  }
  return units;
}

}  // namespace

OutlierReport Outliers(const LineData& data, const OutlierOptions& options) {
  OutlierReport report;
  report.distances.assign(data.units.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<int> left = UnitsToJudge(data);
  const double all = static_cast<double>(left.size());
  // What lacks some of its station's parameters is judged among its like, until none are enough.
  for (std::size_t before = 0; left.size() != before;) {
    before = left.size();
    report.notes.clear();
    const bool is_first = report.sets.empty();
    for (const auto& [parameters, group] : GroupsOf(data, left)) {
      const std::string lack = JudgeGroup(data, group, parameters, options, all, &report);
      if (lack.empty()) continue;
      const bool is_whole = is_first && group.units.size() == left.size();
      report.notes.push_back("no outliers looked for" +
                             (is_whole
                                  ? ": "
                                  : " among " + std::to_string(group.units.size()) + " units at " +
                                        NamesOf(group.stations) + " that have other parameters: ") +
                             lack);
    }
    std::erase_if(left, [&report](int unit) {
      return std::isfinite(report.distances[static_cast<std::size_t>(unit)]);
    });
  }
  std::stable_sort(report.outliers.begin(),
                   report.outliers.end(),
                   [](const Outlier& a, const Outlier& b) { return a.distance > b.distance; });
  return report;
}

}  // namespace truetriad::line
