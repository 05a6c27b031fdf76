// SPDX-License-Identifier: Apache-2.0
#include "choice/open_models.h"

#include <algorithm>

#include "problem/lay_out.h"

namespace truetriad {
namespace {

// The distinct matrix models of a triad, smallest first.
std::vector<Level> MatrixLevels(const CalibrateOptions& wanted, Triad triad) {
  const TriadOptions& sensor = wanted.triads[triad];
  std::vector<MatrixModel> models;
  // Six faces define the body frame only as accurately as they are level. Residuals never show a
  // rotation of all sensors relative to the faces. A smaller model would leave out this rotation
  // and its σ.
  const bool is_frame_told = wanted.attitudes.kind != AttitudeKind::kSixFace;
  if (!sensor.fixed_sensitivity && is_frame_told) {
    if (sensor.nominal_sensitivity) models.push_back(MatrixModel::kBias);
    models.push_back(MatrixModel::kDiagonal);
    const bool frame_is_free = wanted.attitudes.kind == AttitudeKind::kNone;
    if (triad != LeadingTriad(wanted) || !frame_is_free) models.push_back(MatrixModel::kSymmetric);
  }
  models.push_back(MatrixModel::kFull);
  std::vector<Level> levels;
  for (const MatrixModel model : models) {
    levels.push_back({std::string(MatrixModelName(model)), [model](TriadOptions* options) {
                        options->model = model;
                        if (model != MatrixModel::kBias) return;
                        options->fixed_sensitivity = options->nominal_sensitivity;
                      }});
  }
  return levels;
}

template <typename Set>
std::vector<Level> TermLevels(const std::string& name, Set set) {
  return {{name, [set](TriadOptions* options) { set(options, false); }},
          {name, [set](TriadOptions* options) { set(options, true); }}};
}

std::vector<Level> OrderLevels(const std::string& name, int most, int ThermalOptions::*order) {
  std::vector<Level> levels;
  for (int i = 0; i <= most; ++i) {
    levels.push_back({name + " of order " + std::to_string(i) + " in tau",
                      [order, i](TriadOptions* options) { options->thermal.*order = i; }});
  }
  return levels;
}

std::vector<Level> ShapeLevels() {
  std::vector<Level> levels;
  for (const ThermalMatrix shape :
       {ThermalMatrix::kScale, ThermalMatrix::kDiagonal, ThermalMatrix::kFull}) {
    levels.push_back({"matrix " + std::string(ThermalMatrixName(shape)) + " in tau",
                      [shape](TriadOptions* options) { options->thermal.matrix = shape; }});
  }
  return levels;
}

// The highest order that poses at n temperatures can test is n - 2, so that one temperature can be
// predicted from the others. For n = 2 or 3 it is n - 1: a line or a parabola through all
// temperatures.
int HighestOrder(int temperatures) {
  return temperatures <= 3 ? temperatures - 1 : temperatures - 2;
}

// The open parts. If the poses do not determine them all, they are reduced in this order.
// `temperatures`: number of temperatures of the poses.
std::vector<OpenPart> OpenPartsOf(const CalibrateOptions& wanted, int temperatures) {
  std::vector<OpenPart> parts;
  // The gyroscope comes first, since it is calibrated by what the other sensors measure.
  const auto add_where = [&](const auto& is_open, PartKind kind, const auto& levels) {
    for (const Triad triad : {Triad::kGyroscope, Triad::kMagnetometer, Triad::kAccelerometer}) {
      const TriadOptions& sensor = wanted.triads[triad];
      if (sensor.enabled && is_open(sensor)) parts.push_back({triad, kind, levels(triad)});
    }
  };
  const auto order_levels = [&](const char* name, int ThermalOptions::*order) {
    return [&wanted, temperatures, name, order](Triad triad) {
      const int most = wanted.triads[triad].thermal.*order;
      // Without any temperature the calibration itself returns an error.
      return OrderLevels(
          name, temperatures > 0 ? std::min(most, HighestOrder(temperatures)) : most, order);
    };
  };
  for (auto info = kRateTerms.rbegin(); info != kRateTerms.rend(); ++info) {
    add_where([](const TriadOptions& sensor) { return sensor.thermal.rate_auto; },
              PartKind::kThermalTerm,
              [info](Triad) {
                return TermLevels(std::string(info->letters),
                                  [term = info->term](TriadOptions* options, bool is_there) {
                                    options->thermal.rate[term] = is_there;
                                  });
              });
  }
  add_where(
      [](const TriadOptions& sensor) {
        return sensor.thermal.matrix_auto && sensor.thermal.matrix_order > 0;
      },
      PartKind::kThermalShape,
      [](Triad) { return ShapeLevels(); });
  add_where([](const TriadOptions& sensor) { return sensor.thermal.matrix_order_auto; },
            PartKind::kMatrixOrder,
            order_levels("matrix", &ThermalOptions::matrix_order));
  add_where([](const TriadOptions& sensor) { return sensor.thermal.bias_order_auto; },
            PartKind::kBiasOrder,
            order_levels("bias", &ThermalOptions::bias_order));
  const auto add_term = [&](const std::string& name, const auto& of) {
    add_where([&of](const TriadOptions& sensor) { return of(sensor) == Wanted::kAuto; },
              PartKind::kTerm,
              [&](Triad) {
                return TermLevels(name, [of](TriadOptions* options, bool is_there) {
                  of(*options) = is_there ? Wanted::kYes : Wanted::kNo;
                });
              });
  };
  for (const AxisTermInfo& info : kAxisTerms) {
    add_term(
        std::string(info.words), [term = info.term](auto& sensor) -> auto& {
          return sensor.axis_terms[term];
        });
  }
  add_term(
      "g-sensitivity", [](auto& sensor) -> auto& { return sensor.g_sensitivity; });
  add_where([](const TriadOptions& sensor) { return sensor.model == MatrixModel::kAuto; },
            PartKind::kMatrix,
            [&wanted](Triad triad) { return MatrixLevels(wanted, triad); });
  return parts;
}

bool IsOfBias(const OpenPart& part) {
  return part.kind == PartKind::kBiasOrder || part.kind == PartKind::kThermalTerm;
}

bool IsThermal(const OpenPart& part) {
  return part.kind != PartKind::kMatrix && part.kind != PartKind::kTerm;
}

}  // namespace

OpenModels::OpenModels(const CalibrateOptions& wanted, int temperatures)
    : wanted_(wanted), temperatures_(temperatures), parts_(OpenPartsOf(wanted, temperatures)) {}

Choice OpenModels::Largest() const {
  Choice choice;
  for (const OpenPart& part : parts_) choice.push_back(part.levels.size() - 1);
  return choice;
}

bool OpenModels::HasThermalChoice() const {
  return temperatures_ > 1 && std::any_of(parts_.begin(), parts_.end(), IsThermal);
}

CalibrateOptions OpenModels::OptionsOf(const Choice& choice) const {
  CalibrateOptions options = wanted_;
  for (TriadOptions& sensor : options.triads) {
    ThermalOptions& thermal = sensor.thermal;
    thermal.bias_order_auto = thermal.rate_auto = false;
    thermal.matrix_order_auto = thermal.matrix_auto = false;
  }
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    parts_[i].levels[choice[i]].set(&options.triads[parts_[i].triad]);
  }
  return options;
}

std::string OpenModels::DescriptionOf(const Choice& choice) const {
  const CalibrateOptions options = OptionsOf(choice);
  std::string text;
  for (const Triad triad : kTriads) {
    std::string terms;
    bool is_open = false;
    // The loop goes backwards, from the matrix to the terms beyond it.
    for (std::size_t i = parts_.size(); i-- > 0;) {
      if (parts_[i].triad != triad) continue;
      is_open = true;
      const bool is_there = IsOrder(i) || (IsTerm(i) && choice[i] > 0) ||
                            (parts_[i].kind == PartKind::kThermalShape && Matters(i, options));
      if (is_there) terms += ", " + parts_[i].levels[choice[i]].words;
    }
    if (!is_open) continue;
    if (!text.empty()) text += "; ";
    text.append(TriadName(triad)).append(" ");
    text.append(MatrixModelName(options.triads[triad].model)).append(terms);
  }
  return text;
}

std::vector<Neighbour> OpenModels::NeighboursOf(const Choice& choice) const {
  const CalibrateOptions options = OptionsOf(choice);
  std::vector<Neighbour> neighbours;
  for (std::size_t i = parts_.size(); i-- > 0;) {
    if (!Matters(i, options)) continue;
    for (const bool is_larger : {false, true}) {
      if (is_larger ? choice[i] + 1 == parts_[i].levels.size() : choice[i] == 0) continue;
      Neighbour& neighbour = neighbours.emplace_back();
      neighbour.choice = choice;
      neighbour.choice[i] += is_larger ? 1 : -1;
      neighbour.is_larger = is_larger;
      if (IsThermal(parts_[i])) neighbour.thermal_triad = parts_[i].triad;
      neighbour.is_of_bias = IsOfBias(parts_[i]);
      neighbour.description = DescriptionOfStep(i, neighbour.choice[i]);
    }
  }
  return neighbours;
}

bool OpenModels::Shrink(bool keep_matrices, Choice* choice) const {
  const CalibrateOptions options = OptionsOf(*choice);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if ((*choice)[i] == 0 || (keep_matrices && parts_[i].kind == PartKind::kMatrix)) continue;
    // The order is reduced to 1 before the shape is reduced.
    const ThermalOptions& thermal = options.triads[parts_[i].triad].thermal;
    if (parts_[i].kind == PartKind::kThermalShape && thermal.matrix_order != 1 &&
        wanted_.triads[parts_[i].triad].thermal.matrix_order_auto) {
      continue;
    }
    --(*choice)[i];
    return true;
  }
  return false;
}

std::string OpenModels::Missing(const Choice& choice) const {
  const CalibrateOptions options = OptionsOf(choice);
  std::string text;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (choice[i] + 1 >= parts_[i].levels.size() || !Matters(i, options)) continue;
    if (!text.empty()) text += ", ";
    text.append(TriadName(parts_[i].triad))
        .append(" ")
        .append(parts_[i].levels[choice[i] + 1].words);
  }
  return text;
}

bool OpenModels::IsOrder(std::size_t part) const {
  return parts_[part].kind == PartKind::kBiasOrder || parts_[part].kind == PartKind::kMatrixOrder;
}

bool OpenModels::IsTerm(std::size_t part) const {
  return parts_[part].kind == PartKind::kTerm || parts_[part].kind == PartKind::kThermalTerm;
}

bool OpenModels::Matters(std::size_t part, const CalibrateOptions& options) const {
  return parts_[part].kind != PartKind::kThermalShape ||
         options.triads[parts_[part].triad].thermal.matrix_order > 0;
}

std::string OpenModels::DescriptionOfStep(std::size_t part, std::size_t level) const {
  std::string text(TriadName(parts_[part].triad));
  if (IsTerm(part)) text += level > 0 ? " with" : " without";
  return text + " " + parts_[part].levels[level].words;
}

}  // namespace truetriad
