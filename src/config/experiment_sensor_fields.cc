// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "config/experiment_draft.h"
#include "config/fields.h"

namespace truetriad {
namespace {

const auto kModels = Named(MatrixModelName,
                           MatrixModel::kBias,
                           MatrixModel::kDiagonal,
                           MatrixModel::kSymmetric,
                           MatrixModel::kFull,
                           MatrixModel::kAuto);
/// Whether a term beyond bias and sensitivity is estimated.
const auto kWantedTerms = Named(WantedName, Wanted::kNo, Wanted::kYes, Wanted::kAuto);
const auto kNoiseSources = Named(NoiseSourceName, NoiseSource::kConfig, NoiseSource::kDatasheet);
const auto kThermalMatrices =
    Named(ThermalMatrixName, ThermalMatrix::kFull, ThermalMatrix::kDiagonal, ThermalMatrix::kScale);
const auto kFactors = Named(RegressionFactorName,
                            RegressionFactor::kReading,
                            RegressionFactor::kTemperature,
                            RegressionFactor::kRate,
                            RegressionFactor::kAmbient,
                            RegressionFactor::kAmbientRate);
const auto kRates = Named(
    +[](RateTerm term) { return InfoOf(term).name(); },
    RateTerm::kLinear,
    RateTerm::kQuadratic,
    RateTerm::kCross);
constexpr NamedValues<AccelerometerSign, 2> kSigns = {{
    {AccelerometerSign::kSpecificForce, "specific_force"},
    {AccelerometerSign::kGravity, "gravity"},
}};
constexpr NamedValues<ExcessNoise, 2> kExcesses = {{
    {ExcessNoise::kNone, "none"},
    {ExcessNoise::kEstimate, "estimate"},
}};
constexpr NamedValues<bool, 2> kSessionBiases = {{{false, "shared"}, {true, "per_session"}}};

template <typename Visit>
void NoiseFields(Visit& visit, TriadOptions& options, std::string& allan_file) {
  const bool says_allan = visit.Has("allan"), says_sigma = visit.Has("sigma");
  visit.Expect(
      !(says_allan && says_sigma), "sigma and allan exclude each other; keep one", "allan");
  // If a document states one of sigma and allan, the other one of earlier documents is dropped.
  if (says_sigma) allan_file.clear();
  if (says_allan) options.noise_sigma_raw.reset();
  visit("allan", allan_file, kFile);
  if (visit.Shows(allan_file.empty()) && !says_allan) {
    visit("sigma", options.noise_sigma_raw, OrWord{kSigmas, "auto"});
  }
  visit("source", options.noise_source, kNoiseSources);
  if (visit.IsMap("excess", options.excess == ExcessNoise::kGiven)) {
    options.excess = ExcessNoise::kGiven;
    const auto of = [&](auto& excess) {
      excess.Require("sigma");
      excess("sigma", options.excess_sigma, kNotNegative);
    };
    visit.Map("excess", of, {.is_flow = true});
  } else {
    visit("excess", options.excess, kExcesses);
  }
}

template <typename Visit>
void PriorFields(Visit& visit, TriadPrior& prior) {
  visit("bias", prior.bias, kNumbers);
  visit("bias_sigma", prior.bias_sigma, kSigmas);
  visit("sensitivity", prior.sensitivity, kNumbers);
  visit("sensitivity_sigma", prior.sensitivity_sigma, kSigmas);
}

/// The first document that states the nonlinearity must state the percentage and the full scale. If
/// `before` is set, earlier documents stated both, and a later document may change one of them.
template <typename Visit>
void NonlinearityFields(Visit& visit,
                        Triad triad,
                        const std::optional<Nonlinearity>& before,
                        Nonlinearity& nonlinearity) {
  const Range percent{std::numeric_limits<double>::denorm_min(),
                      Nonlinearity::kMostPercent,
                      "a percentage above 0, at most 10"};
  const QuantityKeys scales = TriadKeys("full_scale", triad);
  const bool has_percent = visit.Has("percent_of_full_scale");
  const bool has_scale = std::any_of(
      scales.begin(), scales.end(), [&](const auto& scale) { return visit.Has(scale.key); });
  visit("percent_of_full_scale", nonlinearity.percent_of_full_scale, percent);
  visit(scales, nonlinearity.full_scale, kPositive);
  visit.Expect(
      before || (has_percent && has_scale),
      "`" + (has_percent ? scales.front().key : "percent_of_full_scale") +
          "` is missing; both the percentage and the full scale of the data sheet are needed");
}

template <typename Visit>
void FixedFields(Visit& visit, TriadOptions& options, bool& is_identity) {
  Open<std::optional<Eigen::Matrix3d>> matrix{options.fixed_sensitivity, is_identity};
  visit("matrix", matrix, OrWord{kNumbers, "identity", std::optional<Eigen::Matrix3d>()});
  visit("bias", options.fixed_bias, kNumbers);
}

template <typename Visit>
void SweepTermFields(Visit& visit, ThermalOptions& thermal) {
  constexpr Range kLags{0.0, 2.0, "0, 1 or 2 lags, or auto"};
  constexpr Range kCounts{
      0.0, 3.0, "temperatures [31.5, …], or the number of knots to find, 0 to 3"};
  if (visit.Shows(thermal.lags_auto || thermal.lags > 0)) {
    visit("lag", Open{thermal.lags, thermal.lags_auto}, OrWord{kLags, "auto", 0});
  }
  if (visit.IsList("knots", !thermal.knots_degc.empty())) {
    thermal.find_knots = 0;
    std::vector<double>& knots = thermal.knots_degc;
    visit("knots", knots, ListOf{kTemperatureDegc});
    visit.Expect(std::is_sorted(knots.begin(), knots.end(), std::less_equal<>()),
                 "expected temperatures in increasing order, each once",
                 "knots");
  } else if (visit.Shows(thermal.find_knots > 0)) {
    if (visit("knots", thermal.find_knots, kCounts)) thermal.knots_degc.clear();
  }
  if (visit.Shows(thermal.smooth_knots)) visit("smooth_knots", thermal.smooth_knots, Flag());
  if (visit.Says("regression", "full")) {
    thermal.regression.fill(true);
  } else if (visit.Says("regression", "none")) {
    thermal.regression.fill(false);
  } else if (visit.Shows(thermal.has_regression())) {
    visit("regression", thermal.regression, ListOf{kFactors});
  }
}

template <typename Visit>
void ThermalFields(Visit& visit, ThermalOptions& thermal, ThermalOptions& chosen) {
  constexpr int kMostBias = ThermalOptions::kMaxBiasOrder;
  constexpr int kMostMatrix = ThermalOptions::kMaxMatrixOrder;
  static const std::string expected = "an order of 0 (none) to ";
  static const std::string bias = expected + std::to_string(kMostBias) + ", or auto";
  static const std::string matrix = expected + std::to_string(kMostMatrix) + ", or auto";
  visit("bias_order",
        Open{thermal.bias_order, thermal.bias_order_auto},
        OrWord{Range{0.0, kMostBias, bias}, "auto", kMostBias},
        Open{chosen.bias_order, chosen.bias_order_auto});
  visit("matrix_order",
        Open{thermal.matrix_order, thermal.matrix_order_auto},
        OrWord{Range{0.0, kMostMatrix, matrix}, "auto", kMostMatrix},
        Open{chosen.matrix_order, chosen.matrix_order_auto});
  visit("matrix",
        Open{thermal.matrix, thermal.matrix_auto},
        OrWord{kThermalMatrices, "auto", ThermalMatrix::kFull},
        Open{chosen.matrix, chosen.matrix_auto});
  visit("rate",
        Open{thermal.rate, thermal.rate_auto},
        OrWord{ListOf{kRates}, "auto", PerRateTerm<bool>::All(true)},
        Open{chosen.rate, chosen.rate_auto});
  SweepTermFields(visit, thermal);
}

}  // namespace

template <typename Visit>
void SensorFields(Visit& visit, Triad triad, ExperimentDraft& draft, CalibrateOptions& chosen) {
  TriadOptions& options = draft.experiment.options.triads[triad];
  TriadOptions& found = chosen.triads[triad];
  visit("model", options.model, kModels, found.model);
  if (triad == Triad::kGyroscope) {
    visit("g_sensitivity", options.g_sensitivity, kWantedTerms, found.g_sensitivity);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != triad) continue;
    visit(info.name, options.axis_terms[info.term], kWantedTerms, found.axis_terms[info.term]);
  }
  if (triad == Triad::kAccelerometer) visit("sign", options.sign, kSigns);
  visit.Map("noise",
            [&](auto& noise) { NoiseFields(noise, options, draft.experiment.allan_files[triad]); });
  const auto prior = [&](auto& in) {
    TriadPrior stated = options.prior.value_or(TriadPrior());
    PriorFields(in, stated);
    options.prior = stated;
  };
  visit.Map("prior", prior, {.is_there = options.prior.has_value()});
  const auto nonlinearity = [&](auto& in) {
    Nonlinearity stated = options.nonlinearity.value_or(Nonlinearity());
    NonlinearityFields(in, triad, options.nonlinearity, stated);
    options.nonlinearity = stated;
  };
  visit.Map("nonlinearity",
            nonlinearity,
            {.is_there = options.nonlinearity.has_value(),
             .is_flow = true,
             .words = {{"none", false, [&] { options.nonlinearity.reset(); }}}});
  bool& is_identity = draft.experiment.fixed_identity[triad];
  visit.Map("fixed",
            [&](auto& fixed) { FixedFields(fixed, options, is_identity); },
            {.is_there = is_identity || options.fixed_sensitivity || options.fixed_bias});
  visit("bias", options.bias_per_session, kSessionBiases);
  visit.Map("thermal",
            [&](auto& thermal) { ThermalFields(thermal, options.thermal, found.thermal); },
            {.is_there = options.thermal.any(),
             .words = {{"none", false, [&] { options.thermal = ThermalOptions(); }}}});
  double& offset_s = draft.experiment.poses.time_offset_s[triad];
  if (visit.Shows(offset_s != 0.0)) {
    visit("time_offset_s", offset_s, Range{-10.0, 10.0, "an offset of at most 10 s"});
  }
}

template void SensorFields(FieldReader&, Triad, ExperimentDraft&, CalibrateOptions&);
template void SensorFields(FieldWriter&, Triad, ExperimentDraft&, CalibrateOptions&);
template void SensorFields(FieldSchema&, Triad, ExperimentDraft&, CalibrateOptions&);

}  // namespace truetriad
