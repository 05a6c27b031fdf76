// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "config/experiment_draft.h"
#include "config/quantities.h"
#include "config/resolved_text.h"
#include "io/tags_text.h"
#include "io/yaml_text.h"
#include "truetriad/model/mounting.h"

namespace truetriad {
namespace {

void WriteReference(ResolvedText& out, const ExperimentDraft& draft) {
  const ReferenceOptions& reference = draft.experiment.options.reference;
  out.Open("reference");
  out.Line("gravity_mps2", draft.gravity_mps2);
  if (const auto& position = draft.experiment.position) {
    out.Open("position");
    out.Line("latitude_deg", position->latitude_deg);
    if (position->longitude_deg) out.Line("longitude_deg", *position->longitude_deg);
    out.Line("height_m", position->height_m);
    if (!position->date.empty()) out.Line("date", Quoted{position->date});
    out.Close();
  }
  out.Open("field");
  out.Line("strength_ut", draft.strength_ut);
  out.Line("dip_deg", draft.dip_deg);
  if (reference.is_hemisphere_stated) {
    out.Line("hemisphere", kHemispheres.Name(reference.northern_hemisphere));
  }
  out.Line("site", kFieldSites.Name(draft.field_site));
  out.Close();
  // A static calibration brings its own; the default would contradict it when read back.
  if (draft.static_file.empty() || draft.experiment.reference_given) {
    out.Line("temperature_degc", reference.temperature_degc);
  }
  if (draft.earth_rate) {
    out.Open("earth_rate");
    out.Line("latitude_deg", draft.earth_rate->latitude.value_or(0.0));
    out.Line("declination_deg", draft.earth_rate->declination.value_or(0.0));
    out.Close();
  }
  out.Close();
}

std::string RatesText(const ThermalOptions& thermal) {
  if (thermal.rate_auto) return "auto";
  std::string rates;
  for (const RateTermInfo& info : kRateTerms) {
    if (thermal.rate[info.term]) rates.append(rates.empty() ? "" : ", ").append(info.name());
  }
  return "[" + rates + "]";
}

// One that was open as it was chosen.
void WriteChoice(ResolvedText& out,
                 std::string_view key,
                 const std::string& asked,
                 const std::string& chosen) {
  if (asked == chosen) {
    out.Line(key, asked);
  } else {
    out.ChosenLine(key, chosen);
  }
}

void WriteThermal(ResolvedText& out, const ThermalOptions& thermal, const ThermalOptions& chosen) {
  out.Open("thermal");
  const auto write = [&](std::string_view key, auto text) {
    WriteChoice(out, key, text(thermal), text(chosen));
  };
  write("bias_order", [](const ThermalOptions& terms) {
    return terms.bias_order_auto ? "auto" : std::to_string(terms.bias_order);
  });
  write("matrix_order", [](const ThermalOptions& terms) {
    return terms.matrix_order_auto ? "auto" : std::to_string(terms.matrix_order);
  });
  write("matrix", [](const ThermalOptions& terms) {
    return terms.matrix_auto ? "auto" : std::string(ThermalMatrixName(terms.matrix));
  });
  write("rate", RatesText);
  if (thermal.lags_auto) {
    out.Line("lag", "auto");
  } else if (thermal.lags > 0) {
    out.Line("lag", thermal.lags);
  }
  if (!thermal.knots_degc.empty()) {
    YamlText knots;
    for (const double degc : thermal.knots_degc) {
      knots << (knots.str().empty() ? "" : ", ") << degc;
    }
    out.Line("knots", "[", knots.str(), "]");
  } else if (thermal.find_knots > 0) {
    out.Line("knots", thermal.find_knots);
  }
  if (thermal.smooth_knots) out.Line("smooth_knots", "true");
  if (thermal.has_regression()) {
    std::string factors;
    for (std::size_t f = 0; f < kRegressionFactors; ++f) {
      if (!thermal.regression[f]) continue;
      factors.append(factors.empty() ? "" : ", ")
          .append(RegressionFactorName(static_cast<RegressionFactor>(f)));
    }
    out.Line("regression", "[", factors, "]");
  }
  out.Close();
}

// Models and terms, those that were open as they were chosen.
void WriteModel(ResolvedText& out,
                Triad triad,
                const TriadOptions& asked,
                const TriadOptions& chosen) {
  const auto write =
      [&](std::string_view key, const auto& as_asked, const auto& as_chosen, auto name) {
        WriteChoice(out, key, std::string(name(as_asked)), std::string(name(as_chosen)));
      };
  write("model", asked.model, chosen.model, MatrixModelName);
  if (triad == Triad::kGyroscope) {
    write("g_sensitivity", asked.g_sensitivity, chosen.g_sensitivity, WantedName);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    if (info.triad != triad) continue;
    write(info.name, asked.axis_terms[info.term], chosen.axis_terms[info.term], WantedName);
  }
}

void WriteSensor(ResolvedText& out,
                 Triad triad,
                 const ExperimentDraft& draft,
                 const CalibrateOptions& chosen) {
  const Experiment& experiment = draft.experiment;
  const TriadOptions& options = experiment.options.triads[triad];
  out.Open(TriadName(triad));
  WriteModel(out, triad, options, chosen.triads[triad]);
  if (triad == Triad::kAccelerometer) out.Line("sign", kSigns.Name(options.sign));
  out.Open("noise");
  if (!draft.allan_files[triad].empty()) {
    out.Line("allan", Quoted{draft.allan_files[triad]});
  } else if (options.noise_sigma_raw) {
    out.Line("sigma", *options.noise_sigma_raw);
  } else {
    out.Line("sigma", "auto");
  }
  out.Line("source", NoiseSources().Name(options.noise_source));
  if (options.excess == ExcessNoise::kGiven) {
    out.Line("excess", "{ sigma: ", options.excess_sigma, " }");
  } else {
    out.Line("excess", kExcesses.Name(options.excess));
  }
  out.Close();
  if (const std::optional<TriadPrior>& prior = options.prior) {
    out.Open("prior");
    out.Line("bias", prior->bias);
    out.Line("bias_sigma", prior->bias_sigma);
    out.Line("sensitivity", prior->sensitivity);
    out.Line("sensitivity_sigma", prior->sensitivity_sigma);
    out.Close();
  }
  if (const std::optional<Nonlinearity>& stated = options.nonlinearity) {
    out.Line("nonlinearity",
             "{ percent_of_full_scale: ",
             stated->percent_of_full_scale,
             ", ",
             TriadKeys("full_scale", triad).front().key,
             ": ",
             stated->full_scale,
             " }");
  }
  if (experiment.fixed_identity[triad] || options.fixed_sensitivity || options.fixed_bias) {
    out.Open("fixed");
    if (experiment.fixed_identity[triad]) out.Line("matrix", "identity");
    if (options.fixed_sensitivity) out.Line("matrix", *options.fixed_sensitivity);
    if (options.fixed_bias) out.Line("bias", *options.fixed_bias);
    out.Close();
  }
  if (options.bias_per_session) {
    out.Line("bias", kSessionBiases.Name(*options.bias_per_session));
  }
  if (options.thermal.any()) WriteThermal(out, options.thermal, chosen.triads[triad].thermal);
  if (draft.time_offset_s[triad] != 0.0) out.Line("time_offset_s", draft.time_offset_s[triad]);
  out.Close();
}

void WriteMounting(ResolvedText& out, const ExperimentDraft& draft) {
  out.Open("mounting");
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = draft.experiment.options.triads[triad];
    if (!sensor.enabled) continue;
    out.Line(TriadName(triad), sensor.mounting ? AxisMapName(*sensor.mounting) : "any");
  }
  out.Close();
}

void WritePoses(ResolvedText& out, const ExperimentDraft& draft) {
  const PosesConfig& poses = draft.experiment.poses;
  if (!poses.given) return;  // Writing the default would overrule what a recording states.
  switch (poses.kind) {
    case PoseSelectionKind::kDetect:
      return out.Line("poses", "{ detect: auto }");
    case PoseSelectionKind::kEveryRow:
      return out.Line("poses", "every_row");
    case PoseSelectionKind::kEveryN:
      return out.Line("poses", "{ every: ", poses.every, " }");
    case PoseSelectionKind::kColumn:
      return out.Line("poses", "{ column: ", Quoted{poses.column}, " }");
    case PoseSelectionKind::kRanges:
      return out.Line("poses", "{ file: ", Quoted{draft.pose_file}, " }");
    case PoseSelectionKind::kMotion:
      return out.Line("poses", "{ motion: { spacing_s: ", poses.motion_spacing_s, " } }");
    case PoseSelectionKind::kSweep:
      break;
  }
  out.Open("poses");
  const bool is_given = poses.sweep.window_s > 0.0 || poses.sweep.window_samples > 0;
  if (!is_given && draft.pose_file.empty()) {
    out.Line("sweep", "auto");
  } else {
    out.Open("sweep");
    if (poses.sweep.window_s > 0.0) out.Line("window_s", poses.sweep.window_s);
    if (poses.sweep.window_samples > 0) out.Line("window_samples", poses.sweep.window_samples);
    if (!draft.pose_file.empty()) out.Line("attitudes", Quoted{draft.pose_file});
    out.Close();
  }
  out.Close();
}

void WriteInputs(ResolvedText& out, const std::vector<std::string>& inputs) {
  if (inputs.empty()) return;
  if (inputs.size() == 1) return out.Line("input", Quoted{inputs.front()});
  YamlText list;
  for (const std::string& input : inputs) {
    list << (list.str().empty() ? "" : ", ") << Quoted{input};
  }
  out.Line("input", "[", list.str(), "]");
}

void WriteExcluded(ResolvedText& out, const ExperimentDraft& draft) {
  YamlText ranges, numbers;
  for (const ExcludedSeconds& range : draft.exclude) {
    ranges << (ranges.str().empty() ? " " : ", ") << "{ from_s: " << range.from_s
           << ", to_s: " << range.to_s << " }";
  }
  for (const int number : draft.experiment.exclude_poses) {
    numbers << (numbers.str().empty() ? "" : ", ") << number;
  }
  out.Line("exclude", "[", ranges.str(), draft.exclude.empty() ? "]" : " ]");
  out.Line("exclude_poses", "[", numbers.str(), "]");
}

void WriteLimit(ResolvedText& out, const std::string& name, const Limit& limit) {
  if (limit.IsAboutZero()) return out.Line(name, limit.upper);
  std::ostringstream parts;
  parts.precision(std::numeric_limits<double>::max_digits10);
  auto part = [&parts, separator = ""](const char* key, double value) mutable {
    parts << separator << key << ": " << value;
    separator = ", ";
  };
  if (std::isfinite(limit.lower)) part("lower", limit.lower);
  if (limit.target) part("target", *limit.target);
  if (std::isfinite(limit.upper)) part("upper", limit.upper);
  out.Line(name, "{ ", parts.str(), limit.if_present ? ", if_present: true }" : " }");
}

void WriteAttitudes(ResolvedText& out, const ExperimentDraft& draft) {
  const AttitudeOptions& attitudes = draft.experiment.options.attitudes;
  switch (attitudes.kind) {
    case AttitudeKind::kNone:
      return out.Line("attitudes", "none");
    case AttitudeKind::kSixFace:
      out.Open("attitudes");
      out.Open("six_face");
      out.Line("tilt_sigma_deg",
               attitudes.stated_tilt_sigma_deg.value_or(attitudes.tilt_sigma_deg));
      out.Line("seat_sigma_deg", attitudes.seat_sigma_deg);
      out.Close();
      return out.Close();
    case AttitudeKind::kGiven:
      out.Open("attitudes");
      out.Line("file", Quoted{draft.attitudes_file});
      out.Line("sigma_deg", draft.experiment.attitudes_sigma_deg);
      out.Line("fixture_rotation", kFixtureRotations.Name(attitudes.unknown_fixture_rotation));
      return out.Close();
  }
}

void WriteKnownMotions(ResolvedText& out, const ExperimentDraft& draft) {
  const KnownMotionsConfig& motions = draft.known_motions;
  if (draft.turns_file.empty()) {
    out.Line("turns", "none");
  } else {
    YamlText held_out;
    for (const std::string& id : motions.held_out_turns) {
      held_out << (held_out.str().empty() ? "" : ", ") << Quoted{id};
    }
    out.Open("turns");
    out.Line("file", Quoted{draft.turns_file});
    out.Line("sigma_deg", motions.turn_sigma_deg);
    out.Line("axis_sigma_deg", motions.turn_axis_sigma_deg);
    out.Line("held_out", "[", held_out.str(), "]");
    out.Close();
  }
  if (draft.rates_file.empty()) return out.Line("rates", "none");
  out.Open("rates");
  out.Line("file", Quoted{draft.rates_file});
  out.Line("sigma_degps", motions.rate_sigma_degps);
  out.Line("axis_sigma_deg", motions.rate_axis_sigma_deg);
  out.Line("axes", kRateAxes.Name(motions.rate_axes_known));
  out.Close();
}

}  // namespace

std::string ResolvedYaml(const ExperimentDraft& draft, const CalibrateOptions& chosen) {
  const Experiment& experiment = draft.experiment;
  const CalibrateOptions& options = experiment.options;
  ResolvedText out(draft.given);
  out.Line("experiment", 1);
  WriteInputs(out, draft.inputs);
  out.Line("device",
           "{ serial: ",
           Quoted{experiment.serial},
           ", model: ",
           Quoted{experiment.model},
           DeviceTagsText(experiment.tags),
           " }");
  out.Line("run", "{ ", TagsText(kRunTags, experiment.tags, /*comes_after=*/false), " }");
  WriteReference(out, draft);
  out.Line("gauge", Gauges().Name(options.gauge));
  out.Line("clocks", kClocks.Name(options.corrects_clocks));
  out.Line("units", kUnitChecks.Name(options.check_units));
  out.Open("sensors");
  for (const Triad triad : kTriads) {
    if (options.triads[triad].enabled) WriteSensor(out, triad, draft, chosen);
  }
  out.Close();
  WriteMounting(out, draft);
  WritePoses(out, draft);
  out.Line("time", kTimeStamps.Name(draft.time_stamps));
  WriteExcluded(out, draft);
  WriteAttitudes(out, draft);
  if (!draft.static_file.empty()) out.Line("static", Quoted{draft.static_file});
  if (options.triads[Triad::kGyroscope].enabled) WriteKnownMotions(out, draft);
  out.Open("robust");
  out.Line("loss", kLosses.Name(options.robust.enabled));
  out.Line("scale", options.robust.scale);
  out.Close();
  out.Open("initialise");
  out.Line("method", kMethods.Name(options.initialise.method));
  out.Line("only", options.initialise.only);
  if (!draft.forces_file.empty()) out.Line("forces", Quoted{draft.forces_file});
  out.Close();
  out.Open("limits");
  for (const auto& [name, limit] : options.limits.limits) WriteLimit(out, name, limit);
  if (options.limits.guard_band_k > 0.0) {
    out.Line("decision", "{ guard_band_k: ", options.limits.guard_band_k, " }");
  } else {
    out.Line("decision", "simple");
  }
  out.Close();
  out.Open("cross_validation");
  out.Line("folds", options.cross_validation_folds);
  out.Close();
  if (options.strict_shift_sigmas) out.Line("strict", *options.strict_shift_sigmas);
  out.Line("observable_sigma", options.observable_sigma);
  return out.str();
}

}  // namespace truetriad
