// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "allan/allan_fields.h"
#include "allan/allan_report.h"
#include "calibrate/verdict_fields.h"
#include "io/calibration_tree.h"
#include "planning/plan_fields.h"
#include "python/array_source.h"
#include "python/calibration.h"
#include "python/errors.h"
#include "python/numbers.h"
#include "tree/to_tree.h"
#include "truetriad/allan/allan.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"
#include "truetriad/sim/scenario.h"

namespace truetriad::python {
namespace py = pybind11;
namespace fs = std::filesystem;
namespace {

using Integers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Recordings = std::vector<std::shared_ptr<ArrayRecording>>;
using Texts = std::vector<std::string>;

/// The result of a verb as text, as the command line's --json, and as a page.
struct Answer {
  std::string text, json, html;
};

Answer AnswerOf(const VerbReport& report, const Json& json) {
  return {report.text, TextOf(json), report.html};
}

/// An experiment or a scenario, as a file or as a text. If neither is given, calibrate uses
/// defaults, and other verbs fail.
struct Document {
  std::optional<fs::path> path;
  std::optional<std::string> text;
  Texts overrides;
};
constexpr char kDictName[] = "<config>";

template <typename T>
void Append(const Doubles& from, std::size_t column, std::size_t columns, std::vector<T>* to) {
  const auto count = static_cast<std::size_t>(from.size()) / columns;
  to->resize(count);
  const double* const values = from.data();
  for (std::size_t i = 0; i < count; ++i) (*to)[i] = static_cast<T>(values[i * columns + column]);
}

/// Adds one sensor. Python has checked that the arrays have the same length.
void AddStream(ArrayRecording* recording,
               const std::string& sensor,
               const std::string& unit,
               const Doubles& readings,
               const std::optional<Integers>& time_ns,
               const std::optional<Doubles>& temperature_degc,
               const std::optional<Doubles>& pose) {
  ArrayStream stream;
  const std::optional<Triad> triad = TriadFromName(sensor);
  if (!triad) {
    Raise(
        Error(ErrorCode::kUnknownName,
              "`" + sensor + "` is no sensor; expected accelerometer, gyroscope or magnetometer"));
  }
  stream.triad = *triad;
  stream.unit = ValueOf(ParseTriadUnit(*triad, unit));
  Append(readings, 0, 3, &stream.x);
  Append(readings, 1, 3, &stream.y);
  Append(readings, 2, 3, &stream.z);
  if (time_ns) stream.time_ns.assign(time_ns->data(), time_ns->data() + time_ns->size());
  if (temperature_degc) Append(*temperature_degc, 0, 1, &stream.temperature_degc);
  if (pose) Append(*pose, 0, 1, &stream.pose);
  recording->streams.push_back(std::move(stream));
}

RecordingOpener OpenerOf(const Recordings& recordings) {
  if (recordings.empty()) return {};
  std::map<std::string, std::shared_ptr<const ArrayRecording>> by_name;
  for (const auto& recording : recordings) by_name[recording->name] = recording;
  return [by_name = std::move(by_name)](
             const std::string& input,
             const OpenRecordingOptions&) -> Result<std::unique_ptr<SampleSource>> {
    const auto found = by_name.find(input);
    if (found == by_name.end()) {
      return Error(
          ErrorCode::kUnreadableFile, {input}, "is not one of the recordings that were given");
    }
    return OpenArrays(found->second);
  };
}

/// The input of a verb: files, or recordings in memory.
struct Inputs {
  Inputs(Texts files, const Recordings& recordings)
      : names(std::move(files)), opener(OpenerOf(recordings)) {
    for (const auto& recording : recordings) names.push_back(recording->name);
  }

  Texts names;
  RecordingOpener opener;
};

/// Runs a verb with a progress callback; raises its error.
template <typename Work>
auto Run(const py::object& progress, const Work& work) {
  const ProgressCallback callback = ProgressOf(progress);
  return ValueOf(WithoutGil([&] { return work(callback); }));
}

Result<Experiment> ReadStated(const Document& config) {
  if (config.path) return ReadExperiment(config.path->string(), config.overrides);
  if (!config.text)
    return Error(ErrorCode::kMissingArgument, "no config; name a file, or give a dict");
  return ReadExperimentText(*config.text, kDictName, config.overrides);
}

/// Calibrates as `truetriad calibrate` does.
Result<HeldCalibration> RunCalibrate(Texts inputs,
                                     const Document& config,
                                     const std::optional<fs::path>& folder,
                                     const RecordingOpener& opener,
                                     const ProgressCallback& progress) {
  std::optional<LoadedPoses> first;
  Experiment experiment;
  if (config.path || config.text) {
    TRUETRIAD_ASSIGN_OR_RETURN(experiment, ReadStated(config));
    if (inputs.empty()) inputs = experiment.inputs;
    if (inputs.empty()) {
      return Error(ErrorCode::kMissingArgument,
                   "no recording; give one, or add `input:` to the config");
    }
  } else {
    if (inputs.empty()) return Error(ErrorCode::kMissingArgument, "no recording; give one");
    const std::string beside = opener ? std::string() : inputs.front() + ".truetriad";
    const std::string of_result = folder ? folder->string() : beside;
    TRUETRIAD_ASSIGN_OR_RETURN(FirstLook look,
                               InitialExperiment(inputs, of_result, progress, opener));
    TRUETRIAD_ASSIGN_OR_RETURN(
        experiment, ReadExperimentText(look.experiment_yaml, "experiment.yaml", config.overrides));
    experiment.path = (fs::path(of_result) / "experiment.yaml").string();
    first = std::move(look.loaded);
  }
  experiment.inputs = std::move(inputs);
  auto poses = std::make_shared<PoseSet>();
  TRUETRIAD_ASSIGN_OR_RETURN(
      Calibration calibration,
      CalibrateExperiment(std::move(experiment), progress, std::move(first), poses.get(), opener));
  return HeldCalibration(std::move(calibration), std::move(poses));
}

HeldCalibration CalibrateVerb(const Texts& files,
                              const Recordings& recordings,
                              const Document& config,
                              const std::optional<fs::path>& folder,
                              const py::object& progress) {
  const Inputs inputs(files, recordings);
  return Run(progress, [&](const ProgressCallback& callback) {
    return RunCalibrate(inputs.names, config, folder, inputs.opener, callback);
  });
}

Result<Answer> RunEvaluate(const Calibration& calibration,
                           const std::string& input,
                           const std::string& poses,
                           const RecordingOpener& opener,
                           const ProgressCallback& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(const LoadedPoses loaded,
                             LoadToEvaluate({calibration}, input, poses, progress, opener));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const EvaluationSummary found,
      Evaluate(
          calibration, loaded.poses, IsMadeFrom(calibration, loaded.inputs), loaded.si_per_count));
  const Texts about = {"Recording: " + input};
  return AnswerOf(ReportOf(found, calibration, about), ToTree(found));
}

Answer EvaluateVerb(const HeldCalibration& calibration,
                    const Texts& files,
                    const Recordings& recordings,
                    const std::string& poses,
                    const py::object& progress) {
  const Inputs in(files, recordings);
  return Run(progress, [&](const ProgressCallback& callback) {
    return RunEvaluate(*calibration.value, in.names.front(), poses, in.opener, callback);
  });
}

Result<Answer> RunCompare(const Calibration& a, const Calibration& b) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors("a", a, b));
  TRUETRIAD_ASSIGN_OR_RETURN(const Comparison found, Compare(a, b));
  Texts about;
  if (IsMadeFrom(a, b.inputs) || IsTooAlike(found)) {
    about.emplace_back(
        "Both were made from the same readings, so they share the noise and agree better than "
        "calibrations from two recordings would.");
  }
  return AnswerOf(ReportOf(found, about), ToTree(found));
}

Result<Answer> RunPlan(const Document& config,
                       const std::string& measured,
                       const ProgressCallback& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment, ReadStated(config));
  TRUETRIAD_ASSIGN_OR_RETURN(const Plan plan,
                             PlanExperiment(std::move(experiment), measured, progress));
  return AnswerOf(ReportOf(plan), PlanTree(plan));
}

Answer PlanVerb(const Document& config, const std::string& measured, const py::object& progress) {
  return Run(progress, [&](const auto& callback) { return RunPlan(config, measured, callback); });
}

Result<Answer> RunAllan(const std::string& input,
                        const RecordingOpener& opener,
                        double rate_hz,
                        const ProgressCallback& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             opener ? opener(input, {}) : OpenRecording(input));
  AllanOptions options;
  options.rate_hz = rate_hz;
  TRUETRIAD_ASSIGN_OR_RETURN(const AllanResult found, AnalyseAllan(*source, options, progress));
  return AnswerOf(ReportOf(found), AsInYaml(ToTree(found)));
}

Answer AllanVerb(const Texts& files,
                 const Recordings& recordings,
                 double rate_hz,
                 const py::object& progress) {
  const Inputs in(files, recordings);
  return Run(progress, [&](const ProgressCallback& callback) {
    return RunAllan(in.names.front(), in.opener, rate_hz, callback);
  });
}

/// All readings of a source.
Result<ArrayRecording> ReadAll(SampleSource* source, const ProgressCallback& progress) {
  ArrayRecording all;
  all.name = source->info().path;
  all.serial = source->info().serial;
  all.has_time = source->info().has_time;
  for (const StreamInfo& info : source->info().streams) {
    ArrayStream& stream = all.streams.emplace_back();
    stream.triad = info.triad;
    stream.unit = info.unit;
  }
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  std::vector<SampleBlock> blocks;
  while (true) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source->Next(&blocks));
    if (!more) return all;
    for (const SampleBlock& block : blocks) {
      for (ArrayStream& stream : all.streams) {
        if (stream.triad != block.triad) continue;
        append(block.time_ns, &stream.time_ns);
        append(block.x, &stream.x);
        append(block.y, &stream.y);
        append(block.z, &stream.z);
        append(block.temperature_degc, &stream.temperature_degc);
      }
    }
    if (progress) progress(source->progress());
  }
}

/// The stream as a tuple: name of the sensor, unit, readings, times, temperatures or None.
py::tuple ArraysOf(const ArrayStream& stream) {
  const auto count = static_cast<py::ssize_t>(stream.size());
  Doubles readings({count, py::ssize_t{3}});
  double* out = readings.mutable_data();
  for (std::size_t i = 0; i < stream.size(); ++i) {
    *out++ = stream.x[i];
    *out++ = stream.y[i];
    *out++ = stream.z[i];
  }
  py::object temperature = py::none();
  if (!stream.temperature_degc.empty()) {
    temperature = Doubles(count, stream.temperature_degc.data());
  }
  return py::make_tuple(TriadName(stream.triad),
                        stream.unit.name,
                        readings,
                        Integers(count, stream.time_ns.data()),
                        temperature);
}

Result<Scenario> ReadStatedScenario(const Document& scenario) {
  if (scenario.path) return ReadScenario(scenario.path->string(), scenario.overrides);
  if (!scenario.text) {
    return Error(ErrorCode::kMissingArgument, "no scenario; name a file, or give a dict");
  }
  return ReadScenarioText(*scenario.text, "<scenario>", scenario.overrides);
}

/// Returns the serial, the arrays of each sensor (ArraysOf), and the truth.
py::tuple SimulateVerb(const Document& document, int unit, const py::object& progress) {
  std::optional<Calibration> truth;
  const auto simulate = [&](const ProgressCallback& callback) -> Result<ArrayRecording> {
    TRUETRIAD_ASSIGN_OR_RETURN(const Scenario scenario, ReadStatedScenario(document));
    if (unit < 0 || unit >= scenario.count) {
      return Error(ErrorCode::kInvalidArgument,
                   "unit " + std::to_string(unit) + " is not one of the scenario's " +
                       std::to_string(scenario.count) + "; units are numbered from 0");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Simulation> simulation,
                               Simulation::Create(scenario, unit));
    TRUETRIAD_ASSIGN_OR_RETURN(ArrayRecording all, ReadAll(simulation.get(), callback));
    truth = TruthOf(scenario, unit, *simulation);
    return all;
  };
  const ArrayRecording recording = Run(progress, simulate);
  py::list streams;
  for (const ArrayStream& stream : recording.streams) streams.append(ArraysOf(stream));
  return py::make_tuple(NameOrText(recording.serial), streams, HeldCalibration(*std::move(truth)));
}

py::str SaveRecording(const std::shared_ptr<ArrayRecording>& recording, const fs::path& folder) {
  return NameOrText(ValueOf(WithoutGil(
      [&] { return WriteRecording(*OpenArrays(recording), RecordingFormat(), folder.string()); })));
}

void BindRecording(py::module_& module) {
  py::class_<ArrayRecording, std::shared_ptr<ArrayRecording>>(module, "ArrayRecording")
      .def(py::init([](const std::string& name, const std::string& serial) {
             ArrayRecording recording;
             recording.name = name;
             recording.serial = serial;
             return recording;
           }),
           py::arg("name"),
           py::arg("serial"))
      .def("add", &AddStream)
      .def("settle", [](ArrayRecording& recording) { Check(recording.Settle()); })
      .def("save", &SaveRecording);
}

}  // namespace

void BindVerbs(py::module_& module) {
  module.def("numbers", &NumbersOf);
  BindRecording(module);
  py::class_<Answer>(module, "Answer")
      .def(py::init<std::string, std::string, std::string>())
      .def_property_readonly("text", [](const Answer& a) { return Printable(a.text); })
      .def_property_readonly("json", [](const Answer& a) { return NameOrText(a.json); })
      .def("__reduce__",
           [](const py::object& self) {
             const auto& a = self.cast<const Answer&>();
             return py::make_tuple(
                 py::type::of(self),
                 py::make_tuple(py::bytes(a.text), py::bytes(a.json), py::bytes(a.html)));
           })
      .def("report", [](const Answer& answer, const fs::path& path) {
        Check(WriteFileAtomically(path.string(), answer.html));
      });
  py::class_<Document>(module, "Document")
      .def(py::init([](std::optional<fs::path> path, std::optional<std::string> text, Texts set) {
        return Document{std::move(path), std::move(text), std::move(set)};
      }));
  module.def("load", [](const fs::path& path) {
    return HeldCalibration(ValueOf(ReadCalibration(path.string())));
  });
  module.def("calibrate", &CalibrateVerb);
  module.def("evaluate", &EvaluateVerb);
  module.def("compare", [](const HeldCalibration& a, const HeldCalibration& b) {
    return ValueOf(RunCompare(*a.value, *b.value));
  });
  module.def("plan", &PlanVerb);
  module.def("allan", &AllanVerb);
  module.def("simulate", &SimulateVerb);
}

}  // namespace truetriad::python
