// SPDX-License-Identifier: Apache-2.0
#include "trust/trial.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <utility>

#include <nlohmann/json.hpp>

#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"
#include "trust/recording.h"

namespace truetriad::trust {
namespace {

constexpr double kAllowedSigmas = 5.0;

// Processor time of this thread: what else the machine does must not count.
double ProcessorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string Text(const char* format, double value) {
  char text[400];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// The clean unit of a regime, drawn by the tolerances of consumer sensors.
Result<Scenario> CleanScenario(Regime regime, std::uint64_t seed, Random* random) {
  std::vector<std::string> overrides = {"count=1", "seed=" + std::to_string(1 + seed % 1'000'000)};
  const double poses = std::floor(random->Uniform(16.0, 33.0));
  const double rest_s = random->Uniform(2.0, 5.0), move_s = random->Uniform(0.8, 2.0);
  const std::string times = Text(", rest_s: %.3f", rest_s) + Text(", move_s: %.3f", move_s);
  if (regime == Regime::kHand || regime == Regime::kAccelerometer) {
    overrides.push_back(Text("motion=[{poses: {attitudes: {spread: %.0f}", poses) + times +
                        ", rest_spread: 0.15, tilt_sigma_deg: 5, travel_m: 0.2, shuffle: true}}]");
  } else if (regime == Regime::kFaces) {
    overrides.push_back("motion=[{poses: {attitudes: six_face" + times +
                        ", rest_spread: 0.1, tilt_sigma_deg: 0.2}}]");
  } else if (regime == Regime::kAttitudes) {
    overrides.push_back("motion=[{poses: {attitudes: {spread: 24}" + times +
                        ", tilt_sigma_deg: 5, shuffle: true}}]");
  } else if (regime == Regime::kRates) {
    std::string steps;
    for (const char* axis : {"x", "y", "z"}) {
      steps += (steps.empty() ? "" : ", ") + std::string("{turntable: {axis: ") + axis +
               ", rates_degps: [-200, -50, 50, 200], hold_s: 5, ramp_s: 1, rest_s: 2}}";
    }
    overrides.push_back("motion=[" + steps + "]");
  } else {
    overrides.push_back(Text("motion=[{tumble: {duration_s: %.1f", random->Uniform(60.0, 180.0)) +
                        Text(", rms_rate_degps: %.1f", random->Uniform(45.0, 120.0)) +
                        ", hand_acceleration_mps2: 0.5}}]");
    overrides.push_back("first_rest_s=5");
  }
  const double rate_hz = regime == Regime::kRows ? 20.0 : random->Uniform() < 0.5 ? 50.0 : 100.0;
  for (const Triad triad : kTriads) {
    overrides.push_back("sensors." + std::string(TriadName(triad)) +
                        Text(".sampling.rate_hz=%.0f", rate_hz));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(
      Scenario scenario,
      ReadScenario(TRUETRIAD_SOURCE_DIR "/configs/scenarios/fleet.yaml", overrides));
  const std::vector<Triad> wanted = SensorsOf(regime);
  for (const Triad triad : kTriads) {
    const bool is_wanted = std::find(wanted.begin(), wanted.end(), triad) != wanted.end();
    // Other sensors stay only in the regime without stated rows: row numbers are those of one
    // sensor.
    if (!is_wanted && regime != Regime::kAccelerometer) scenario.sensors[triad].reset();
  }
  return scenario;
}

std::string ExperimentOf(Regime regime) {
  std::string text = "experiment: 1\ninput: recording.yaml\nreference:\n  gravity_mps2: 9.80665\n";
  const std::vector<Triad> sensors = SensorsOf(regime);
  if (std::find(sensors.begin(), sensors.end(), Triad::kMagnetometer) != sensors.end()) {
    text += "  field: { strength_ut: 48, dip_deg: unknown }\n";
  }
  text += "sensors:\n";
  for (const Triad triad : sensors)
    text += "  " + std::string(TriadName(triad)) + ": { model: full }\n";
  switch (regime) {
    case Regime::kRows:
      return text + "poses: every_row\n";
    case Regime::kMotion:
      return text + "poses: { motion: { spacing_s: 0.1 } }\n";
    case Regime::kFaces:
      return text + "attitudes: { six_face: { tilt_sigma_deg: 0.5 } }\n";
    case Regime::kAttitudes:
      return text +
             "poses: { file: poses.yaml }\nattitudes: { file: attitudes.csv, sigma_deg: 0.01 }\n";
    case Regime::kRates:
      return text + "rates: { file: rates.yaml, sigma_degps: 0.001 }\n";
    case Regime::kHand:
    case Regime::kAccelerometer:
      return text;
  }
  return text;
}

struct Drawn {
  const Fault* fault;  // One of Faults(), which are in the order in which they happen.
  Strike strike;
};

Drawn DrawStrike(const Kind& kind, Random* random) {
  const Fault& fault = *kind.fault;
  const double severity = fault.least * std::pow(fault.most / fault.least, random->Uniform());
  return {&fault, {kind.triad.value_or(Triad::kAccelerometer), severity, random}};
}

bool IsAbout(const Finding& finding, std::optional<Triad> triad) {
  return !finding.sensor || !triad || *finding.sensor == *triad;
}

std::optional<Triad> TriadOfParameter(const std::string& name) {
  return TriadFromName(name.substr(0, name.find('.')));
}

bool MustBeRefused(const std::vector<Drawn>& drawn) {
  return std::ranges::any_of(
      drawn, [](const Drawn& one) { return one.fault->expected == Expected::kRefusal; });
}

// The parameter that is off by most of its own σ.
void FindWorst(const Calibration& calibration, const Calibration& truth, Trial* trial) {
  const Result<Comparison> comparison = Compare(calibration, truth);
  if (!comparison) {
    trial->worst_sigmas = std::numeric_limits<double>::infinity();
    trial->worst_parameter = comparison.error().message;
    return;
  }
  trial->worst_sigmas = comparison->largest_in_sigmas;
  for (const ComparisonEntry& entry : comparison->entries) {
    const double sigmas = std::abs(entry.difference) / entry.sigma;
    if (std::abs(sigmas - trial->worst_sigmas) < 1e-6 * sigmas) {
      trial->worst_parameter = entry.parameter;
    }
  }
}

void Judge(const Result<Calibration>& calibration,
           const Recording& recording,
           const std::vector<Drawn>& drawn,
           Trial* trial) {
  if (!calibration) {
    trial->verdict = Verdict::kRefused;
    trial->refusal = calibration.error().message;
    return;
  }
  for (const Finding& finding : calibration->findings) {
    trial->findings.emplace_back(FindingCodeName(finding.code));
  }
  if (!calibration->IsUsable()) {
    trial->verdict = Verdict::kRefused;
    for (const Finding& finding : calibration->findings) {
      if (!finding.IsRefusal()) continue;
      trial->refusal = FindingCodeName(finding.code);
      trial->blames_other =
          !drawn.empty() && std::none_of(drawn.begin(), drawn.end(), [&](const Drawn& one) {
            return one.fault->triads.empty() || IsAbout(finding, one.strike.triad);
          });
      break;
    }
    return;
  }
  trial->is_left_standing = std::any_of(
      calibration->findings.begin(), calibration->findings.end(), [](const Finding& finding) {
        return finding.IsLeftStanding();
      });
  for (const std::string& name : calibration->covariance.parameters) {
    trial->sigmas[name] = calibration->covariance.Sigma(name);
  }
  FindWorst(*calibration, recording.TruthFor(*calibration), trial);
  trial->verdict = MustBeRefused(drawn) || !(trial->worst_sigmas <= kAllowedSigmas)
                       ? Verdict::kWrong
                       : Verdict::kRight;
  const std::optional<Triad> worst = TriadOfParameter(trial->worst_parameter);
  for (const Finding& finding : calibration->findings) {
    if (finding.severity == Severity::kNote || !IsAbout(finding, worst)) continue;
    trial->said.emplace_back(FindingCodeName(finding.code));
  }
}

// Calibrates a recording with the mechanisms that are switched on, and judges the result.
void CalibrateAndJudge(const Experiment& experiment,
                       const Recording& recording,
                       const std::vector<Drawn>& drawn,
                       Trial* trial) {
  TakeActed();
  const double begin_s = ProcessorSeconds();
  try {
    const Result<Calibration> calibration = CalibrateExperiment(experiment);
    trial->seconds = ProcessorSeconds() - begin_s;
    Judge(calibration, recording, drawn, trial);
  } catch (const std::exception& failure) {
    trial->verdict = Verdict::kCrashed;
    trial->refusal = failure.what();
  }
  trial->acted = TakeActed();
}

// What is needed to judge a calibration of the recording: its kind, and the errors of biases rest
// by rest, since a bias is right by their mean over the rests that were used.
std::string TrialJson(const Trial& trial,
                      const Recording& recording,
                      const std::vector<Drawn>& drawn) {
  nlohmann::ordered_json json = {{"seed", trial.seed},
                                 {"kind", trial.kind.Name()},
                                 {"severity", trial.severity},
                                 {"second", trial.second},
                                 {"can_be_seen", trial.kind.CanBeSeen()},
                                 {"must_be_refused", MustBeRefused(drawn)},
                                 {"rest_errors", nlohmann::ordered_json::object()}};
  for (const Triad triad : kTriads) {
    for (const Eigen::Vector3d& error : recording.rest_errors[triad]) {
      json["rest_errors"][std::string(TriadName(triad))].push_back(
          {error.x(), error.y(), error.z()});
    }
  }
  return json.dump() + "\n";
}

Trial TrialOf(std::uint64_t seed, const std::vector<Kind>& kinds) {
  Trial trial;
  trial.seed = seed;
  trial.kind = kinds[seed % kinds.size()];
  return trial;
}

Random RandomOf(std::uint64_t seed) { return Random(0x7215 + seed); }

// Draws the faults of a trial and writes its recording, truth and experiment into `folder`.
Result<Recording> Contaminate(const std::string& folder,
                              Random* random,
                              Trial* trial,
                              std::vector<Drawn>* faults) {
  TRUETRIAD_ASSIGN_OR_RETURN(Scenario scenario,
                             CleanScenario(trial->kind.regime, trial->seed, random));
  std::vector<Drawn>& drawn = *faults;
  if (trial->kind.fault != nullptr) {
    drawn.push_back(DrawStrike(trial->kind, random));
    trial->severity = drawn.front().strike.severity;
    if (random->Uniform() < 0.25) {
      std::vector<Kind> same;
      for (const Kind& kind : Kinds()) {
        if (kind.regime == trial->kind.regime && kind.fault != trial->kind.fault &&
            kind.CanBeSeen()) {
          same.push_back(kind);
        }
      }
      const Kind& other =
          same[static_cast<std::size_t>(random->Below(static_cast<int>(same.size())))];
      drawn.push_back(DrawStrike(other, random));
      trial->second = other.Name() + Text(" %.2g", drawn.back().strike.severity);
    }
  }
  std::ranges::sort(drawn, {}, &Drawn::fault);
  for (const Drawn& one : drawn) {
    if (one.fault->before != nullptr) one.fault->before(one.strike, &scenario);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(Recording recording, Play(scenario, 0));
  for (const Drawn& one : drawn) {
    if (one.fault->after != nullptr) one.fault->after(one.strike, &recording);
  }
  TRUETRIAD_RETURN_IF_ERROR(Write(recording, folder));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(folder + "/truth.yaml", CalibrationToYaml(recording.truth)));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(folder + "/experiment.yaml", ExperimentOf(trial->kind.regime)));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(folder + "/trial.json", TrialJson(*trial, recording, drawn)));
  return recording;
}

Status Run(const std::string& folder,
           const std::function<bool(Mechanism)>& is_priced,
           Random* random,
           Trial* trial) {
  std::vector<Drawn> drawn;
  TRUETRIAD_ASSIGN_OR_RETURN(const Recording recording, Contaminate(folder, random, trial, &drawn));
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment,
                             ReadExperiment(folder + "/experiment.yaml"));
  const Trial blank = *trial;
  CalibrateAndJudge(experiment, recording, drawn, trial);
  for (const Mechanism mechanism : trial->acted) {
    if (!is_priced || !is_priced(mechanism)) continue;
    trial->without.push_back(blank);
    trial->without.back().off = mechanism;
    SwitchMechanism(mechanism, true);
    CalibrateAndJudge(experiment, recording, drawn, &trial->without.back());
    SwitchMechanism(mechanism, false);
  }
  return {};
}

}  // namespace

std::string Kind::Name() const {
  std::string name = fault == nullptr ? "clean" : std::string(fault->name);
  if (triad) name += ", " + std::string(TriadName(*triad));
  return name + " (" + std::string(RegimeName(regime)) + ")";
}

bool Kind::CanBeSeen() const {
  if (fault == nullptr) return true;
  return fault->expected != Expected::kUnseen &&
         std::find(fault->unseen.begin(), fault->unseen.end(), regime) == fault->unseen.end();
}

std::vector<Kind> Kinds() {
  std::vector<Kind> kinds;
  for (const Fault& fault : Faults()) {
    for (const Regime regime : kRegimes) {
      if (!fault.regimes.empty() &&
          std::find(fault.regimes.begin(), fault.regimes.end(), regime) == fault.regimes.end()) {
        continue;
      }
      if (fault.triads.empty()) {
        kinds.push_back({&fault, {}, regime});
        continue;
      }
      for (const Triad triad : SensorsOf(regime)) {
        if (std::find(fault.triads.begin(), fault.triads.end(), triad) != fault.triads.end()) {
          kinds.push_back({&fault, triad, regime});
        }
      }
    }
  }
  return kinds;
}

Status WriteTrial(std::uint64_t seed, const std::vector<Kind>& kinds, const std::string& folder) {
  Trial trial = TrialOf(seed, kinds);
  Random random = RandomOf(seed);
  std::vector<Drawn> drawn;
  TRUETRIAD_RETURN_IF_ERROR(Contaminate(folder, &random, &trial, &drawn));
  return {};
}

Trial RunTrial(std::uint64_t seed,
               const std::vector<Kind>& kinds,
               const std::string& folder,
               const std::function<bool(Mechanism)>& is_priced) {
  Trial trial = TrialOf(seed, kinds);
  Random random = RandomOf(seed);
  try {
    const Status status = Run(folder, is_priced, &random, &trial);
    if (!status) {
      trial.verdict = Verdict::kRefused;
      trial.refusal = status.error().message;
    }
  } catch (const std::exception& failure) {
    trial.verdict = Verdict::kCrashed;
    trial.refusal = failure.what();
  }
  return trial;
}

}  // namespace truetriad::trust
