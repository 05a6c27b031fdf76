// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
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
#include "truetriad/config/scenario.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording_writer.h"
#include "truetriad/sim/simulation.h"

DEFINE_int32(jobs, 0, "N: number of units at a time; 0: one per core");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

/// A folder inside the output folder that is gone at the end, whatever happens: files appear in
/// their places only once all of them are whole.
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

/// Finds out whether MoveInto would fail, so that it does not stop half-way.
Status CheckCanMoveInto(const fs::path& from, const fs::path& to) {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(from)) {
    const fs::path target = to / fs::relative(entry.path(), from);
    if (InputGuard::Holds(target.string())) return InputGuard::Refusal(target.string());
    std::error_code missing;
    if (fs::exists(target, missing) && fs::is_directory(target, missing) != entry.is_directory()) {
      return Error(ErrorCode::kOutputInTheWay,
                   {target.string()},
                   std::string("is in the way of a ") + (entry.is_directory() ? "folder" : "file") +
                       " to write; remove it or choose another --output");
    }
    if (entry.is_directory() && fs::exists(target, missing)) {
      TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(target.string()));
    }
  }
  return {};
}

/// Moves all files in the folder `from`, and in its folders, to the same places in `to`.
Status MoveInto(const fs::path& from, const fs::path& to) {
  TRUETRIAD_RETURN_IF_ERROR(CheckCanMoveInto(from, to));
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(from)) {
    const fs::path target = to / fs::relative(entry.path(), from);
    std::error_code failure;
    if (entry.is_directory()) {
      fs::create_directories(target, failure);
    } else {
      fs::rename(entry.path(), target, failure);
    }
    if (failure) return Error(ErrorCode::kCannotWrite, {target.string()}, failure.message());
  }
  return {};
}

/// A pose table of attitudes alone, as a turntable or a robot without error would state it.
std::string AttitudesCsv(const std::vector<TrueRest>& rests) {
  std::string text =
      "# attitude of every rest (world <- body) and temperature of the sensing elements\n"
      "time[s],qw,qx,qy,qz,temperature[degC]\n";
  for (const TrueRest& rest : rests) {
    const Eigen::Quaterniond& q = rest.world_from_body;
    char line[160];
    std::snprintf(line,
                  sizeof line,
                  "%.6f,%.12f,%.12f,%.12f,%.12f,%.4f\n",
                  rest.start_s,
                  q.w(),
                  q.x(),
                  q.y(),
                  q.z(),
                  rest.element_degc);
    text += line;
  }
  return text;
}

/// Writes the recording of one unit and what is true of it; says what that is.
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
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically((folder / "truth.yaml").string(), CalibrationToYaml(truth)));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically((folder / "attitudes.csv").string(), AttitudesCsv(simulation->rests())));
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically((folder / "poses.yaml").string(),
                                                PoseRangesToYaml(simulation->rest_rows())));
  if (const std::vector<StatedTurn> turns = simulation->turns(); !turns.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(
        WriteFileAtomically((folder / "turns.yaml").string(), StatedTurnsToYaml(turns)));
  }
  const std::vector<StatedRate> rates = simulation->rates();
  if (!rates.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(
        WriteFileAtomically((folder / "rates.yaml").string(), StatedRatesToYaml(rates)));
  }
  return truth;
}

/// Each session of a unit in a folder of its own, and beside them the unit on the mean of them.
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

/// Simulates all units, several at a time. Each depends on the seed and its own number alone, so
/// the bytes are the same however many threads there are.
class Fleet {
 public:
  Fleet(const Scenario& scenario, fs::path folder)
      : scenario_(scenario), folder_(std::move(folder)) {}

  /// Error: the first of any unit; the others are then given up. A signal that has been noted ends
  /// the program as it would have done, once what was written so far is removed.
  Status Write(int threads, const ProgressCallback& progress) {
    const auto count = static_cast<std::size_t>(std::min(threads, scenario_.count));
    shares_ = std::vector<std::atomic<double>>(count);
    running_ = count;
    std::vector<std::jthread> workers;
    for (std::size_t i = 0; i < count; ++i) workers.emplace_back([this, i] { Work(&shares_[i]); });
    std::unique_lock lock(mutex_);
    while (running_ > 0) {
      ended_.wait_for(lock, std::chrono::milliseconds(100));
      if (IsInterrupted()) {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
        EndAsInterrupted();
      }
      if (!progress) continue;
      double done = finished_;
      for (const std::atomic<double>& share : shares_) done += share;
      progress(std::min(1.0, done / scenario_.count));
    }
    lock.unlock();
    workers.clear();
    return failure_ ? Status(*failure_) : Status();
  }

 private:
  void Work(std::atomic<double>* share) {
    for (int index = next_++; index < scenario_.count && !given_up_; index = next_++) {
      const SimulatedUnit unit = DrawUnit(scenario_, index);
      const fs::path folder = scenario_.count > 1 ? folder_ / unit.serial : folder_;
      const Status status =
          WriteUnit(scenario_, index, folder, [share](double value) { *share = value; });
      *share = 0.0;
      ++finished_;
      if (status) continue;
      const std::lock_guard lock(mutex_);
      given_up_ = true;
      if (!failure_) {
        failure_ = Error{status.error().code, unit.serial + ": " + status.error().message};
      }
    }
    const std::lock_guard lock(mutex_);
    --running_;
    ended_.notify_all();
  }

  const Scenario& scenario_;
  fs::path folder_;
  std::atomic<int> next_ = 0;
  std::atomic<int> finished_ = 0;
  std::atomic<bool> given_up_ = false;
  std::vector<std::atomic<double>> shares_;  ///< Of the unit that each thread is at.
  std::mutex mutex_;
  std::condition_variable ended_;
  std::size_t running_ = 0;  ///< Guarded by mutex_, as is failure_.
  std::optional<Error> failure_;
};

/// About what the recordings of all units take on the disk.
struct ExpectedSize {
  double rows = 0.0;
  double bytes = 0.0;
};

ExpectedSize SizeOf(const Scenario& scenario, const Simulation& unit) {
  // As numbers come with their separators: readings in steps of a thousandth, times in
  // milliseconds.
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

/// Refuses what the disk has no room for, and says beforehand that something takes long.
Status CheckRoom(const Scenario& scenario, const fs::path& folder) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Simulation> unit,
                             Simulation::Create(scenario, 0));
  const ExpectedSize size = SizeOf(scenario, *unit);
  constexpr double kBytesAGb = 1e9;
  char text[200];
  std::snprintf(text, sizeof text, "%.3g rows, about %.3g GB", size.rows, size.bytes / kBytesAGb);
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  if (!unknown && size.bytes > static_cast<double>(space.available)) {
    char room[64];
    std::snprintf(room, sizeof room, "%.3g GB", static_cast<double>(space.available) / kBytesAGb);
    return Error(ErrorCode::kCannotWrite,
                 {FLAGS_output},
                 std::string("the recording would need ") + text + ", but only " + room +
                     " are free; shorten the motion, lower the rates or simulate fewer units");
  }
  if (size.bytes > kBytesAGb) Note(std::string("truetriad simulate: writing ") + text);
  return {};
}

/// The files of one unit stand in the output folder itself, perhaps beside what it is made from.
Status CheckKeepsInputs(const Scenario& scenario) {
  if (scenario.count > 1) return {};
  const fs::path folder = FLAGS_output;
  for (const char* name :
       {"recording.yaml", "truth.yaml", "poses.yaml", "turns.yaml", "rates.yaml"}) {
    if (InputGuard::Holds((folder / name).string())) {
      return InputGuard::Refusal((folder / name).string());
    }
  }
  const std::string poses = (folder / "poses.yaml").string();
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
  const fs::path folder = FLAGS_output;
  VerbResult result;
  result.result = {{"output", FLAGS_output}, {"units", Json::array()}};
  for (int unit = 0; unit < scenario.count; ++unit) {
    result.result["units"].push_back(DrawUnit(scenario, unit).serial);
  }
  if (scenario.count > 1) {
    result.text = std::to_string(scenario.count) + " units, from " +
                  (folder / DrawUnit(scenario, 0).serial).string() + " to " +
                  (folder / DrawUnit(scenario, scenario.count - 1).serial).string() +
                  ", each with recording.yaml, truth.yaml, attitudes.csv and poses.yaml\n";
    return result;
  }
  if (scenario.sessions > 1) {
    result.text = std::to_string(scenario.sessions) + " sessions, from " +
                  (folder / "session-1" / "recording.yaml").string() +
                  " on\nTruth: " + (folder / "truth.yaml").string() + '\n';
    return result;
  }
  for (const auto& [title, name] : {std::pair("Recording:", "recording.yaml"),
                                    std::pair("Truth:    ", "truth.yaml"),
                                    std::pair("Attitudes:", "attitudes.csv"),
                                    std::pair("Rests:    ", "poses.yaml"),
                                    std::pair("Turns:    ", "turns.yaml"),
                                    std::pair("Rates:    ", "rates.yaml")}) {
    std::error_code missing;
    if (!fs::exists(folder / name, missing)) continue;
    result.text += std::string(title) + ' ' + (folder / name).string() + '\n';
  }
  return result;
}

Result<VerbResult> RunSimulate(const std::vector<std::string>&) {
  if (FLAGS_jobs < 0) {
    return Error(ErrorCode::kInvalidArgument,
                 "--jobs=" + std::to_string(FLAGS_jobs) +
                     " is invalid; expected 1 or more, or 0 for one per core");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Scenario scenario, ReadScenario(FLAGS_config, Overrides()));
  TRUETRIAD_RETURN_IF_ERROR(CheckKeepsInputs(scenario));
  TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Staging> staging, Staging::Create(FLAGS_output));
  TRUETRIAD_RETURN_IF_ERROR(CheckRoom(scenario, staging->path()));
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  const int threads = std::max(1, FLAGS_jobs > 0 ? FLAGS_jobs : cores);
  {
    NoteInterruptions();
    ProgressLine progress("simulating " + scenario.serial);
    TRUETRIAD_RETURN_IF_ERROR(Fleet(scenario, staging->path()).Write(threads, progress.callback()));
  }
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
