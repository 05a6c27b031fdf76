// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "config/experiment_draft.h"
#include "config/quantities.h"
#include "config/yaml_values.h"
#include "io/yaml_reader.h"

// What each key of a sensor in an experiment says.

namespace truetriad {
namespace {

void ReadNoise(YamlReader reader, TriadOptions* options, std::string* allan_file) {
  if (!reader) return;
  YamlReader sigma = reader.Child("sigma");
  YamlReader allan = reader.Child("allan");
  if (sigma && allan) allan.Fail("sigma and allan exclude each other; keep one");
  // What a document says takes the place of what those before it said.
  if (sigma) allan_file->clear();
  if (allan.Read(allan_file) || IsWord(sigma, "auto")) {
    options->noise_sigma_raw.reset();
  } else if (Eigen::Vector3d value; ReadSigmas(sigma, &value)) {
    options->noise_sigma_raw = value;
  }
  ReadChoice(reader.Child("source"), NoiseSources(), &options->noise_source);
  if (YamlReader excess = reader.Child("excess"); excess.IsMap()) {
    if (ReadNumber(excess.RequireChild("sigma"), kNotNegative, &options->excess_sigma)) {
      options->excess = ExcessNoise::kGiven;
    }
    excess.RejectUnknown();
  } else {
    ReadChoice(excess, kExcesses, &options->excess);
  }
  reader.RejectUnknown();
}

void ReadPrior(YamlReader reader, std::optional<TriadPrior>* prior) {
  if (!reader) return;
  TriadPrior value = prior->value_or(TriadPrior());
  ReadNumbers(reader.Child("bias"), &value.bias);
  ReadSigmas(reader.Child("bias_sigma"), &value.bias_sigma);
  ReadNumbers(reader.Child("sensitivity"), &value.sensitivity);
  ReadSigmas(reader.Child("sensitivity_sigma"), &value.sensitivity_sigma);
  reader.RejectUnknown();
  *prior = value;
}

void ReadNonlinearity(YamlReader reader, Triad triad, std::optional<Nonlinearity>* nonlinearity) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    nonlinearity->reset();
    return;
  }
  Nonlinearity value = nonlinearity->value_or(Nonlinearity());
  YamlReader percent = reader.Child("percent_of_full_scale");
  ReadNumber(percent,
             {std::numeric_limits<double>::denorm_min(),
              Nonlinearity::kMostPercent,
              "a percentage above 0, at most 10"},
             &value.percent_of_full_scale);
  const QuantityKeys scales = TriadKeys("full_scale", triad);
  const bool has_scale = std::any_of(scales.begin(), scales.end(), [&](const auto& scale) {
    return bool(reader.Child(scale.key));
  });
  ReadQuantity(reader, scales, kPositive, &value.full_scale);
  const bool is_first = !nonlinearity->has_value();
  if (reader.IsScalar()) {
    reader.Fail("expected `none` or { percent_of_full_scale: …, " + scales.front().key + ": … }");
  } else if (is_first && !(percent && has_scale)) {
    reader.Fail("`" + (percent ? scales.front().key : "percent_of_full_scale") +
                "` is missing; a data sheet states the non-linearity in percent of the end of "
                "the range, of which both are needed");
  }
  reader.RejectUnknown();
  *nonlinearity = value;
}

void ReadFixed(YamlReader reader, TriadOptions* options, bool* identity) {
  if (!reader) return;
  if (YamlReader matrix = reader.Child("matrix"); IsWord(matrix, "identity")) {
    *identity = true;
    options->fixed_sensitivity.reset();
  } else if (Eigen::Matrix3d value; ReadNumbers(matrix, &value)) {
    *identity = false;
    options->fixed_sensitivity = value;
  }
  Eigen::Vector3d bias;
  if (ReadNumbers(reader.Child("bias"), &bias)) options->fixed_bias = bias;
  reader.RejectUnknown();
}

/// A whole number from zero to `most`, or `auto`: any of them.
void ReadOrder(YamlReader reader, int most, int* order, bool* is_auto) {
  if (!reader) return;
  *is_auto = IsWord(reader, "auto");
  int value = most;
  if (!*is_auto && !reader.Read(&value)) return;
  if (value >= 0 && value <= most) {
    *order = value;
  } else {
    reader.Fail("expected an order of 0 (none) to " + std::to_string(most) + ", or auto");
  }
}

/// Factors, all of them (`full`), or none.
void ReadRegression(YamlReader reader, ThermalOptions* thermal) {
  if (!reader) return;
  thermal->regression.fill(IsWord(reader, "full"));
  if (reader.IsScalar()) {
    if (!IsWord(reader, "full") && !IsWord(reader, "none")) {
      reader.Fail(
          "expected `full`, `none` or a list of factors: reading, temperature, rate, ambient, "
          "ambient_rate");
    }
    return;
  }
  for (const YamlReader& item : reader.Items()) {
    RegressionFactor factor = RegressionFactor::kTemperature;
    if (ReadChoice(item, RegressionFactors(), &factor)) {
      thermal->regression[static_cast<std::size_t>(factor)] = true;
    }
  }
}

void ReadThermal(YamlReader reader, ThermalOptions* thermal) {
  if (!reader) return;
  if (IsWord(reader, "none")) {
    *thermal = ThermalOptions();
    return;
  }
  ReadOrder(reader.Child("bias_order"),
            ThermalOptions::kMaxBiasOrder,
            &thermal->bias_order,
            &thermal->bias_order_auto);
  ReadOrder(reader.Child("matrix_order"),
            ThermalOptions::kMaxMatrixOrder,
            &thermal->matrix_order,
            &thermal->matrix_order_auto);
  if (YamlReader matrix = reader.Child("matrix"); IsWord(matrix, "auto")) {
    thermal->matrix_auto = true;
    thermal->matrix = ThermalMatrix::kFull;
  } else if (matrix) {
    thermal->matrix_auto = false;
    ReadChoice(matrix, ThermalMatrices(), &thermal->matrix);
  }
  if (YamlReader rate = reader.Child("rate"); IsWord(rate, "auto")) {
    thermal->rate_auto = true;
    thermal->rate = PerRateTerm<bool>::All(true);
  } else if (rate) {
    thermal->rate_auto = false;
    thermal->rate = {};
    for (const YamlReader& item : rate.Items()) {
      RateTerm term = RateTerm::kLinear;
      if (ReadChoice(item, RateTerms(), &term)) thermal->rate[term] = true;
    }
  }
  if (YamlReader lag = reader.Child("lag"); IsWord(lag, "auto")) {
    thermal->lags_auto = true;
    thermal->lags = 0;
  } else if (int lags = 0; lag.Read(&lags)) {
    thermal->lags_auto = false;
    thermal->lags = lags;
    if (lags < 0 || lags > 2) lag.Fail("expected 0, 1 or 2 lags, or auto");
  }
  if (YamlReader knots = reader.Child("knots"); knots.IsSequence()) {
    thermal->knots_degc.clear();
    thermal->find_knots = 0;
    for (const YamlReader& item : knots.Items()) {
      double degc = 0.0;
      if (ReadNumber(item, kTemperatureDegc, &degc)) {
        thermal->knots_degc.push_back(degc);
      }
    }
    if (!std::is_sorted(
            thermal->knots_degc.begin(), thermal->knots_degc.end(), std::less_equal<>())) {
      knots.Fail("expected temperatures in increasing order, each once");
    }
  } else if (int count = 0; knots.Read(&count)) {
    thermal->knots_degc.clear();
    thermal->find_knots = count;
    if (count < 0 || count > 3) {
      knots.Fail("expected temperatures [31.5, …], or the number of knots to find, 0 to 3");
    }
  }
  reader.Optional("smooth_knots", &thermal->smooth_knots);
  ReadRegression(reader.Child("regression"), thermal);
  reader.RejectUnknown();
}

}  // namespace

void ReadSensor(YamlReader reader, Triad triad, Draft* draft) {
  TriadOptions& options = draft->experiment.options.triads[triad];
  ReadChoice(reader.Child("model"), Models(), &options.model);
  if (triad == Triad::kAccelerometer) ReadChoice(reader.Child("sign"), kSigns, &options.sign);
  if (triad == Triad::kGyroscope) {
    ReadChoice(reader.Child("g_sensitivity"), WantedTerms(), &options.g_sensitivity);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != triad) continue;
    ReadChoice(reader.Child(info.name), WantedTerms(), &options.axis_terms[info.term]);
  }
  ReadNoise(reader.Child("noise"), &options, &draft->allan_files[triad]);
  ReadPrior(reader.Child("prior"), &options.prior);
  ReadNonlinearity(reader.Child("nonlinearity"), triad, &options.nonlinearity);
  ReadFixed(reader.Child("fixed"), &options, &draft->experiment.fixed_identity[triad]);
  if (bool per_session = false; ReadChoice(reader.Child("bias"), kSessionBiases, &per_session)) {
    options.bias_per_session = per_session;
  }
  ReadThermal(reader.Child("thermal"), &options.thermal);
  ReadNumber(reader.Child("time_offset_s"),
             {-10.0, 10.0, "an offset of at most 10 s"},
             &draft->time_offset_s[triad]);
  reader.RejectUnknown();
}

}  // namespace truetriad
