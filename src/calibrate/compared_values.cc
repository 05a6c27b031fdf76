// SPDX-License-Identifier: Apache-2.0
#include "calibrate/compared_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "math/dense/products.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {
namespace {

// Gravity and the field belong to the place, which may differ between two calibrations of a unit.
bool IsOfThePlace(const std::string& name) { return name.rfind("reference.", 0) == 0; }

// The value of a named entry of a sensor.
double ValueOf(const PresentedSolution& solution, const std::string& name) {
  const auto entry = ParameterName::Parse(name);
  if (!entry) return 0.0;
  const TriadModel<double>& model = *solution.models[entry->triad];
  const auto& thermal = solution.thermal[entry->triad];
  const auto term = static_cast<std::size_t>(std::max(entry->power - 1, 0));
  const ParameterInfo& info = InfoOf(entry->kind);
  if (info.axis_term) return model.axis_terms[*info.axis_term][entry->row];
  if (info.rate) return (*thermal->rate[*info.rate])[entry->row];
  switch (entry->kind) {
    case ParameterKind::kBias:
      return (entry->power > 0 ? thermal->bias[term] : model.bias)[entry->row];
    case ParameterKind::kSensitivity:
      return (entry->power > 0 ? thermal->sensitivity[term] : model.sensitivity)(entry->row,
                                                                                 entry->col);
    default:
      return (*solution.g_sensitivity)(entry->row, entry->col);
  }
}

// An entry of a symmetric matrix, with the letters in its name.
struct GramEntry {
  Eigen::Index row, col;
  const char* name;
};
constexpr std::array<GramEntry, 6> kGramEntries = {
    {{0, 0, "xx"}, {1, 1, "yy"}, {2, 2, "zz"}, {0, 1, "xy"}, {0, 2, "xz"}, {1, 2, "yz"}}};

// Collects compared values, each with its derivative by the entries of the solution's covariance.
class Rows {
 public:
  explicit Rows(const PresentedSolution& solution) : covariance_(solution.covariance) {}

  void Add(std::string name, double value, const Eigen::RowVectorXd& by_entry) {
    values_.names.push_back(std::move(name));
    list_.push_back(value);
    by_entries_.conservativeResize(by_entries_.rows() + 1, covariance_.matrix.cols());
    by_entries_.bottomRows<1>() = by_entry;
  }

  ComparedValues Finish() {
    values_.values = Eigen::Map<Eigen::VectorXd>(list_.data(), std::ssize(list_));
    values_.covariance = Congruence(by_entries_, covariance_.matrix);
    return std::move(values_);
  }

 private:
  const NamedCovariance& covariance_;
  ComparedValues values_;
  std::vector<double> list_;
  Eigen::MatrixXd by_entries_;
};

void AddGram(Triad triad, const PresentedSolution& solution, Rows* rows) {
  const Eigen::Matrix3d C = solution.models[triad]->Correction();
  const Eigen::Matrix3d G = C.transpose() * C;
  const Eigen::Index first = PlaceOf(solution.covariance, {triad, ParameterKind::kSensitivity});
  for (const GramEntry& entry : kGramEntries) {
    Eigen::RowVectorXd by_entry = Eigen::RowVectorXd::Zero(solution.covariance.matrix.cols());
    for (Eigen::Index row = 0; row < 3; ++row) {
      for (Eigen::Index col = 0; col < 3; ++col) {
        by_entry[first + 3 * row + col] =
            -(G(entry.row, row) * C(col, entry.col) + G(entry.col, row) * C(col, entry.row));
      }
    }
    rows->Add(
        std::string(TriadName(triad)) + ".gram." + entry.name, G(entry.row, entry.col), by_entry);
  }
}

}  // namespace

ComparedValues ValuesInFrame(const PresentedSolution& solution) {
  const std::vector<std::string>& names = solution.covariance.parameters;
  ComparedValues all;
  std::vector<double> values;
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (IsOfThePlace(names[i])) continue;
    all.names.push_back(names[i]);
    values.push_back(ValueOf(solution, names[i]));
    places.push_back(static_cast<Eigen::Index>(i));
  }
  all.values = Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values));
  all.covariance = solution.covariance.matrix(places, places);
  return all;
}

ComparedValues ValuesWithoutFrame(const PresentedSolution& solution,
                                  std::vector<std::string>* left_out) {
  Rows rows(solution);
  const std::vector<std::string>& names = solution.covariance.parameters;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (IsOfThePlace(names[i])) continue;
    const auto entry = ParameterName::Parse(names[i]);
    const bool is_sensitivity = entry && entry->kind == ParameterKind::kSensitivity;
    if (is_sensitivity && entry->power == 0) {
      if (entry->row == 0 && entry->col == 0) AddGram(entry->triad, solution, &rows);
      continue;
    }
    if (is_sensitivity || (entry && entry->kind == ParameterKind::kGSensitivity)) {
      const std::string group =
          names[i].substr(0, names[i].rfind('.')) + " (in different body frames)";
      if (std::find(left_out->begin(), left_out->end(), group) == left_out->end()) {
        left_out->push_back(group);
      }
      continue;
    }
    Eigen::RowVectorXd own = Eigen::RowVectorXd::Zero(std::ssize(names));
    own[static_cast<Eigen::Index>(i)] = 1.0;
    rows.Add(names[i], ValueOf(solution, names[i]), own);
  }
  return rows.Finish();
}

Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration) {
  NamedCovariance& covariance = calibration.covariance;
  const std::vector<std::string>& names = covariance.parameters;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto one = ParameterName::Parse(names[i]);
    if (!one || one->power != 0 || !calibration.sensors[one->triad]) continue;
    // The covariance is in raw units: S converts a bias from true to raw units.
    const Eigen::Matrix3d& S = calibration.sensors[one->triad]->model.sensitivity;
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto other = ParameterName::Parse(names[j]);
      if (!other || other->triad != one->triad || other->kind != one->kind || other->power != 0) {
        continue;
      }
      double& entry = covariance.matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (one->kind == ParameterKind::kBias) {
        entry +=
            std::pow(repeatability.bias[one->triad], 2) * S.row(one->row).dot(S.row(other->row));
      } else if (one->kind == ParameterKind::kSensitivity && i == j && one->row == one->col) {
        entry += std::pow(repeatability.scale[one->triad] * S(one->row, one->row), 2);
      }
    }
  }
  return calibration;
}

Calibration AtGravity(double gravity_mps2, Calibration calibration) {
  NamedCovariance& covariance = calibration.covariance;
  const std::vector<std::string>& names = covariance.parameters;
  const auto found = std::find(names.begin(), names.end(), "reference.gravity_mps2");
  if (found == names.end()) return calibration;
  const auto at = static_cast<Eigen::Index>(found - names.begin());
  const double variance = covariance.matrix(at, at);
  if (!(variance > 0.0)) return calibration;
  const Eigen::VectorXd by_gravity = covariance.matrix.col(at) / variance;
  const double shift = gravity_mps2 - calibration.reference.gravity_mps2;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto name = ParameterName::Parse(names[i]);
    if (!name || name->power != 0 || !calibration.sensors[name->triad]) continue;
    TriadModel<double>& model = calibration.sensors[name->triad]->model;
    const double change = by_gravity[static_cast<Eigen::Index>(i)] * shift;
    if (name->kind == ParameterKind::kBias) model.bias[name->row] += change;
    if (name->kind == ParameterKind::kSensitivity) {
      model.sensitivity(name->row, name->col) += change;
    }
  }
  covariance.matrix -= by_gravity * covariance.matrix.row(at).eval();
  calibration.reference.gravity_mps2 = gravity_mps2;
  return calibration;
}

}  // namespace truetriad
