// SPDX-License-Identifier: Apache-2.0
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
#include "line/robust_core.h"
#include "math/dense/products.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Units for each parameter, at least: three quarters of them then have a covariance to speak of.
constexpr Index kUnitsOfParameter = 4;
// Of the units: those that have a value of a parameter that is used.
constexpr double kLeastShareOfUnits = 0.9;
constexpr int kMostSteps = 10;
// Of the units in the start's reach that are kept, before the number of units is allowed for.
constexpr double kKept = 0.975;

// Units of the robust estimate, a column each, in robust σ about the median.
struct Cloud {
  std::vector<int> units;
  MatrixXd values;
};

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

// A parameter that is the same in most units has no robust σ; those in which it differs are named.
std::string MostlySame(const LineData& data, const Group& group, int parameter, double common) {
  constexpr int kMostNamed = 3;
  int count = 0;
  std::string names;
  for (const int unit : group.units) {
    const UnitRecord& record = data.units[static_cast<std::size_t>(unit)];
    if (!HasValue(record, parameter) || record.values[parameter] == common) continue;
    if (count < kMostNamed) names += (count > 0 ? ", " : "") + record.serial;
    ++count;
  }
  return data.parameters[static_cast<std::size_t>(parameter)] +
         " is left out of outliers: most units have the same value of it; " +
         std::to_string(count) + (count == 1 ? " has another: " : " have others: ") + names +
         (count > kMostNamed ? ", ..." : "");
}

// Of these parameters those that vary, with robust centre and σ.
OutlierSet ChooseParameters(const LineData& data,
                            const Group& group,
                            const std::vector<int>& parameters,
                            std::vector<std::string>* left_out) {
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
    if (!(robust.sigma > 0.0)) {
      left_out->push_back(MostlySame(data, group, parameter, robust.centre));
      continue;
    }
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

std::vector<Index> IndependentRows(const MatrixXd& values) {
  const MatrixXd about_mean = values.colwise() - VectorXd(values.rowwise().mean());
  return IndependentColumns(TimesTranspose(about_mean, about_mean));
}

MatrixXd HalfNearestToMedian(const MatrixXd& values) {
  const VectorXd sizes = values.colwise().squaredNorm().transpose();
  std::vector<Index> order(static_cast<std::size_t>(values.cols()));
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(
      order.begin(), order.end(), [&sizes](Index a, Index b) { return sizes[a] < sizes[b]; });
  order.resize((order.size() + 1) / 2);
  return values(Eigen::all, order);
}

// One by one those with which most units are not the same in some direction.
std::vector<Index> RowsWithCore(const MatrixXd& values) {
  std::vector<Index> kept;
  for (Index row = 0; row < values.rows(); ++row) {
    kept.push_back(row);
    const CentreAndRoot core = RobustCore(values(kept, Eigen::all));
    const MatrixXd root = core.root.is_positive() ? core.root.Root() : MatrixXd();
    if (IndependentColumns(TimesTranspose(root, root)).size() < kept.size()) kept.pop_back();
  }
  return kept;
}

// Keeps some parameters; names those left out that others determine in most units, not in all.
void KeepRows(const std::vector<Index>& kept,
              const LineData& data,
              OutlierSet* set,
              Cloud* cloud,
              std::vector<std::string>* left_out) {
  if (static_cast<Index>(kept.size()) == cloud->values.rows()) return;
  for (const Index row : IndependentRows(cloud->values)) {
    if (std::binary_search(kept.begin(), kept.end(), row)) continue;
    const int parameter = set->parameters[static_cast<std::size_t>(row)];
    left_out->push_back(data.parameters[static_cast<std::size_t>(parameter)] +
                        " is left out of outliers: in most units, but not in all, other parameters "
                        "determine it");
  }
  OutlierSet left;
  for (const Index row : kept) {
    const auto place = static_cast<std::size_t>(row);
    left.parameters.push_back(set->parameters[place]);
    left.centre.push_back(set->centre[place]);
    left.sigma.push_back(set->sigma[place]);
  }
  cloud->values = MatrixXd(cloud->values(kept, Eigen::all));
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
                       OutlierReport* report,
                       std::vector<std::string>* left_out) {
  std::vector<std::string> without;
  OutlierSet set = ChooseParameters(data, group, parameters, &without);
  Cloud cloud = CloudOf(data, group.units, set);
  const auto wanted = static_cast<Index>(set.parameters.size());
  // Not of all units: an outlier of a parameter that is a sum of others would hide these.
  const bool has_half = cloud.values.cols() > 2 * wanted;
  if (cloud.values.cols() > 1) {
    KeepRows(IndependentRows(has_half ? HalfNearestToMedian(cloud.values) : cloud.values),
             data,
             &set,
             &cloud,
             &without);
  }
  set.units = static_cast<int>(cloud.units.size());
  Index dimension = cloud.values.rows();
  if (dimension == 0 || cloud.values.cols() < kUnitsOfParameter * dimension) {
    // Of so few units as there are parameters any seem to determine the others.
    const Index needed = cloud.values.cols() > wanted ? dimension : wanted;
    if (needed == 0) return "no parameter varies among these units";
    return "it takes " + std::to_string(kUnitsOfParameter * needed) + " units with all " +
           std::to_string(needed) + " parameters, and there are " + std::to_string(set.units);
  }
  CentreAndRoot core = RobustCore(cloud.values);
  if (!core.root.is_positive()) {
    KeepRows(RowsWithCore(cloud.values), data, &set, &cloud, &without);
    dimension = cloud.values.rows();
    if (dimension == 0) return "most units are the same";
    core = RobustCore(cloud.values);
  }
  const Judged judged = Judge(cloud.values, core, options.level, all);
  const double n = judged.about.count;
  const double own_level = -std::expm1(std::log1p(-options.level) / all);
  set.limit =
      std::sqrt((1.0 + 1.0 / n) * HotellingLimit(static_cast<int>(dimension), own_level, n, false));
  AddOutliers(cloud, judged, options, std::move(set), report);
  left_out->insert(left_out->end(), without.begin(), without.end());
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
  std::vector<std::string> left_out;
  // What lacks some of its station's parameters is judged among its like, until none are enough.
  for (std::size_t before = 0; left.size() != before;) {
    before = left.size();
    report.notes.clear();
    const bool is_first = report.sets.empty();
    for (const auto& [parameters, group] : GroupsOf(data, left)) {
      const std::string lack =
          JudgeGroup(data, group, parameters, options, all, &report, &left_out);
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
  report.notes.insert(report.notes.end(), left_out.begin(), left_out.end());
  std::stable_sort(report.outliers.begin(),
                   report.outliers.end(),
                   [](const Outlier& a, const Outlier& b) { return a.distance > b.distance; });
  return report;
}

}  // namespace truetriad::line
