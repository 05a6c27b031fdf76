// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <sys/stat.h>

#include "io/input_guard.h"
#include "io/known_motion_file.h"
#include "io/pose_program_file.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/interruption.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/sim/scenario.h"

DEFINE_int32(jobs, 0, "N: number of units at a time; 0: one per core");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

/// A temporary folder inside the output folder, removed at the end of this object. Files move from
/// it to their final paths after all of them are complete.
class Staging {
 public:
  static Result<std::unique_ptr<Staging>> Create(const std::string& output) {
    TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(output));
    const std::string name = TemporaryNameBeside((fs::path(output) / ".simulated").string());
    if (mkdir(name.c_str(), 0755) != 0) {
      return Error(ErrorCode::kCannotWrite, {output}, "cannot create a folder in it");
    }
    return std::unique_ptr<Staging>(new Staging(name));
  }
  ~Staging() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  const fs::path& path() const { return path_; }

 private:
  explicit Staging(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
};

/// Moves all files below `from` to the same places below `to`. It first checks for obstacles, so as
/// not to stop half-way.
Status MoveInto(const fs::path& from, const fs::path& to) {
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(from)) {
    const fs::path target = to / fs::relative(entry.path(), from);
    if (InputGuard::Holds(target.string())) return InputGuard::Refusal(target.string());
    if (!fs::exists(target, failure)) continue;
    if (fs::is_directory(target, failure) != entry.is_directory()) {
      return Error(ErrorCode::kOutputInTheWay,
                   {target.string()},
                   std::string("exists, but a ") + (entry.is_directory() ? "folder" : "file") +
                       " of that name must be written; remove it or choose another --output");
    }
    if (entry.is_directory()) TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(target.string()));
  }
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(from)) {
    const fs::path target = to / fs::relative(entry.path(), from);
    if (entry.is_directory()) {
      fs::create_directories(target, failure);
    } else {
      fs::rename(entry.path(), target, failure);
    }
    if (failure) return Error(ErrorCode::kCannotWrite, {target.string()}, failure.message());
  }
  return {};
}

/// A table of the attitudes of all rests, as an ideal turntable or robot would state them.
std::string AttitudesCsv(const std::vector<TrueRest>& rests) {
  std::string text =
      "# attitude of every rest (world <- body) and temperature of the sensing elements\n"
      "time[s],qw,qx,qy,qz,temperature[degC]\n";
  for (const TrueRest& rest : rests) {
    const Eigen::Quaterniond& q = rest.world_from_body;
    text += Formatted("%.6f,%.12f,%.12f,", rest.start_s, q.w(), q.x()) +
            Formatted("%.12f,%.12f,%.4f\n", q.y(), q.z(), rest.element_degc);
  }
  return text;
}

/// Writes the recording of one unit and its truth, and returns the truth.
Result<Calibration> WriteRecordingOf(const Scenario& scenario,
                                     int index,
                                     const fs::path& folder,
                                     const ProgressCallback& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Simulation> simulation,
                             Simulation::Create(scenario, index));
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(folder.string()));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::string manifest,
      WriteRecording(*simulation, simulation->format(), folder.string(), progress));
  Calibration truth = TruthOf(scenario, index, *simulation);
  FileTexts files = {
      {folder / "truth.yaml", CalibrationToYaml(truth)},
      {folder / "attitudes.csv", AttitudesCsv(simulation->rests())},
      {folder / "poses.yaml", PoseRangesToYaml(simulation->rest_rows())},
  };
  if (const std::vector<StatedTurn> turns = simulation->turns(); !turns.empty()) {
    files.emplace_back(folder / "turns.yaml", StatedTurnsToYaml(turns));
  }
  if (const std::vector<StatedRate> rates = simulation->rates(); !rates.empty()) {
    files.emplace_back(folder / "rates.yaml", StatedRatesToYaml(rates));
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFiles(files));
  return truth;
}

/// Writes a unit's recording. Several sessions get a folder each, and the truth beside the folders
/// has the mean of their biases.
Status WriteUnit(const Scenario& scenario,
                 int index,
                 const fs::path& folder,
                 const ProgressCallback& progress) {
  const int count = scenario.sessions;
  if (count == 1) {
    const Result<Calibration> truth = WriteRecordingOf(scenario, index, folder, progress);
    return truth ? Status() : Status(truth.error());
  }
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(folder.string()));
  std::optional<Calibration> mean;
  for (int session = 0; session < count; ++session) {
    const fs::path of_session = folder / ("session-" + std::to_string(session + 1));
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Calibration truth,
        WriteRecordingOf(SessionOf(scenario, index, session), 0, of_session, [&](double share) {
          if (progress) progress((session + share) / count);
        }));
    const bool is_first = !mean.has_value();
    if (is_first) mean = truth;
    for (const Triad triad : kTriads) {
      if (!truth.sensors[triad]) continue;
      Eigen::Vector3d& bias = mean->sensors[triad]->model.bias;
      if (is_first) bias.setZero();
      bias += truth.sensors[triad]->model.bias / count;
    }
  }
  return WriteFileAtomically((folder / "truth.yaml").string(), CalibrationToYaml(*mean));
}

/// Simulates all units in parallel. A unit depends only on the seed and its own number, so the
/// bytes do not depend on the number of threads. Error: a unit failed; no further units are begun.
/// After a recorded signal, removes the files written so far and ends the program by that signal.
Status WriteUnits(const Scenario& scenario,
                  const fs::path& folder,
                  int threads,
                  const ProgressCallback& progress) {
  struct Worker {
    std::atomic<double> share = 0.0;  ///< Of the thread's unit.
    std::optional<Error> failure = {};
  };
  std::vector<Worker> workers(static_cast<std::size_t>(std::min(threads, scenario.count)));
  std::atomic<int> next = 0, finished = 0;
  std::counting_semaphore<> ended(0);
  const auto work = [&](Worker* worker) {
    for (int index = next++; index < scenario.count && !IsInterrupted(); index = next++) {
      const std::string serial = DrawUnit(scenario, index).serial;
      const Status status = WriteUnit(
          scenario, index, scenario.count > 1 ? folder / serial : folder, [worker](double value) {
            worker->share = value;
          });
      worker->share = 0.0;
      ++finished;
      if (status) continue;
      next = scenario.count;
      worker->failure = Error{status.error().code, serial + ": " + status.error().message};
    }
    ended.release();
  };
  std::vector<std::jthread> threads_at_work;
  for (Worker& worker : workers) threads_at_work.emplace_back(work, &worker);
  for (std::size_t left = workers.size(); left > 0;) {
    if (ended.try_acquire_for(std::chrono::milliseconds(100))) --left;
    if (IsInterrupted()) {
      // Threads that are still writing may fill a folder while it is removed.
      std::error_code error;
      do {
        fs::remove_all(folder, error);
      } while (error == std::errc::directory_not_empty);
      EndAsInterrupted();
    }
    double units = finished;
    for (const Worker& worker : workers) units += worker.share;
    if (progress) progress(std::min(1.0, units / scenario.count));
  }
  for (const Worker& worker : workers) {
    if (worker.failure) return *worker.failure;
  }
  return {};
}

/// Approximate size of the recordings of all units on disk.
struct ExpectedSize {
  double rows = 0.0;
  double bytes = 0.0;
};

ExpectedSize SizeOf(const Scenario& scenario, const Simulation& unit) {
  // Typical bytes of a number with thousandths and of a time with milliseconds, each with
  // separator.
  constexpr double kBytesANumber = 7.5, kBytesATime = 11.0;
  ExpectedSize size;
  double numbers = 0.0;
  for (const auto& sensor : scenario.sensors) {
    if (!sensor) continue;
    const SensorSampling& sampling = sensor->sampling;
    const double samples = unit.duration_s() * sampling.rate_hz * (1.0 - sampling.dropout);
    size.rows = unit.format().one_file ? std::max(size.rows, samples) : size.rows + samples;
    numbers += 3.0 * samples;
  }
  if (scenario.temperature.logged) numbers += size.rows;
  if (scenario.temperature.ambient_logged) numbers += size.rows;
  const int recordings = scenario.count * scenario.sessions;
  size.rows *= recordings;
  size.bytes = kBytesATime * size.rows + kBytesANumber * numbers * recordings;
  return size;
}

/// Error: the disk lacks room. If the recordings are large, prints a note.
Status CheckRoom(const Scenario& scenario, const fs::path& folder) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Simulation> unit,
                             Simulation::Create(scenario, 0));
  const ExpectedSize size = SizeOf(scenario, *unit);
  constexpr double kBytesAGb = 1e9;  // 1 GB.
  const std::string text = Formatted("%.3g rows, about %.3g GB", size.rows, size.bytes / kBytesAGb);
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  if (!unknown && size.bytes > static_cast<double>(space.available)) {
    return Error(ErrorCode::kCannotWrite,
                 {FLAGS_output},
                 "the recording would need " + text +
                     Formatted(", but only %.3g GB are free; shorten the motion, lower the rates "
                               "or simulate fewer units",
                               static_cast<double>(space.available) / kBytesAGb));
  }
  if (size.bytes > kBytesAGb) Note("truetriad simulate: writing " + text);
  return {};
}

/// Error: a single unit's files, in the output folder itself, would replace inputs or a program.
Status CheckKeepsInputs(const Scenario& scenario) {
  if (scenario.count > 1) return {};
  for (const char* name :
       {"recording.yaml", "truth.yaml", "poses.yaml", "turns.yaml", "rates.yaml"}) {
    if (InputGuard::Holds(InOutput(name))) return InputGuard::Refusal(InOutput(name));
  }
  const std::string poses = InOutput("poses.yaml");
  const Result<std::string> there = LookAtSmallFile(poses);
  if (there && (there->starts_with("program:") || there->find("\nprogram:") != there->npos)) {
    return Error(ErrorCode::kConflictingArguments,
                 {poses},
                 "is a pose program and would be overwritten; choose another folder, or "
                 "rename it to program.yaml");
  }
  return {};
}

VerbResult ResultOf(const Scenario& scenario) {
  VerbResult result;
  result.result = {{"output", FLAGS_output}, {"units", Json::array()}};
  Json& units = result.result["units"];
  for (int unit = 0; unit < scenario.count; ++unit) {
    units.push_back(DrawUnit(scenario, unit).serial);
  }
  if (scenario.count > 1) {
    result.text = std::to_string(scenario.count) + " units, from " + InOutput(units.front()) +
                  " to " + InOutput(units.back()) +
                  ", each with recording.yaml, truth.yaml, attitudes.csv and poses.yaml\n";
    return result;
  }
  if (scenario.sessions > 1) {
    result.text = std::to_string(scenario.sessions) + " sessions, from " +
                  InOutput("session-1/recording.yaml") + " on\nTruth: " + InOutput("truth.yaml") +
                  '\n';
    return result;
  }
  for (const auto& [title, name] : {std::pair("Recording: ", "recording.yaml"),
                                    std::pair("Truth:     ", "truth.yaml"),
                                    std::pair("Attitudes: ", "attitudes.csv"),
                                    std::pair("Rests:     ", "poses.yaml"),
                                    std::pair("Turns:     ", "turns.yaml"),
                                    std::pair("Rates:     ", "rates.yaml")}) {
    std::error_code missing;
    if (fs::exists(InOutput(name), missing)) result.text += title + InOutput(name) + '\n';
  }
  return result;
}

Result<VerbResult> RunSimulate(const std::vector<std::string>&) {
  if (FLAGS_jobs < 0) {
    return BadValue("jobs",
                    std::to_string(FLAGS_jobs),
                    " is invalid; expected 1 or more, or 0 for one per core");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Scenario scenario, ReadScenario(FLAGS_config, Overrides()));
  TRUETRIAD_RETURN_IF_ERROR(CheckKeepsInputs(scenario));
  TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  // From here on, before the first file is created, a signal leaves no incomplete files behind.
  NoteInterruptions();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Staging> staging, Staging::Create(FLAGS_output));
  TRUETRIAD_RETURN_IF_ERROR(CheckRoom(scenario, staging->path()));
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  const int threads = std::max(1, FLAGS_jobs > 0 ? FLAGS_jobs : cores);
  ProgressLine progress("simulating " + scenario.serial);
  TRUETRIAD_RETURN_IF_ERROR(WriteUnits(scenario, staging->path(), threads, progress.callback()));
  TRUETRIAD_RETURN_IF_ERROR(MoveInto(staging->path(), FLAGS_output));
  return ResultOf(scenario);
}

}  // namespace

Command SimulateCommand() {
  return {
      .name = "simulate",
      .summary = "What would a unit with known errors record?",
      .examples =
          R"(build/truetriad simulate --config=configs/scenarios/consumer-9dof.yaml --output=out/simulated
build/truetriad calibrate --config=configs/experiments/joint.yaml --input=out/simulated/recording.yaml --output=out/estimated
build/truetriad compare --a=out/simulated/truth.yaml --b=out/estimated/calibration.yaml)",
      .details = R"(Writes DIR/recording.yaml with its CSV, DIR/truth.yaml (the true calibration),
DIR/attitudes.csv (the attitude of every rest) and DIR/poses.yaml (the rows of every
rest); for `turn` or `turntable` steps also DIR/turns.yaml and DIR/rates.yaml. With
`count:` above 1, writes one folder per unit. The same seed gives the same bytes. All
keys are in docs/simulation.md.
)",
      .flags = "config=SCENARIO.yaml! output! set* jobs",
      .words = {"config"},
      .run = RunSimulate};
}

}  // namespace truetriad
