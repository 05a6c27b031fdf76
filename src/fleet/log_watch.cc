// SPDX-License-Identifier: Apache-2.0
#include "fleet/log_watch.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <system_error>
#include <utility>
#include <vector>

#include "fleet/log_files.h"
#include "fleet/unit_list.h"
#include "io/recording_layout.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr double kLookS = 1.0;  ///< Where events tell of most.
constexpr double kPollS = 5.0;  ///< Where none do, unless said otherwise.

std::string StampText(const LogStamp& stamp) {
  return std::to_string(stamp.bytes) + "," + std::to_string(stamp.modified_ns) + ";";
}

std::size_t FolderHash(const fs::path& file) { return fs::hash_value(file.parent_path()); }

}  // namespace

LogWatch::LogWatch(WatchOptions options, DoneLogs done, Tell tell)
    : options_(std::move(options)), done_(std::move(done)), tell_(std::move(tell)) {}

Result<std::unique_ptr<LogWatch>> LogWatch::Open(WatchOptions options, DoneLogs done, Tell tell) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSerialPattern(options.serial_pattern));
  fs::path normal = fs::path(options.folder).lexically_normal();
  if (!normal.has_filename()) normal = normal.parent_path();  // "line/".
  options.folder = normal.string();
  std::unique_ptr<LogWatch> watch(
      new LogWatch(std::move(options), std::move(done), std::move(tell)));
  const std::string& folder = watch->options_.folder;
  if (!watch->options_.poll_s) {
    const std::string_view blind = FileSystemWithoutEvents(folder);
    Result<std::unique_ptr<FolderEvents>> events = FolderEvents::Open();
    if (blind.empty() && events) {
      watch->events_ = std::move(*events);
    } else {
      watch->TurnToPolling(blind.empty() ? events.error().message
                                         : folder + " is on " + std::string(blind) +
                                               ", which does not tell of files that arrive");
    }
  }
  watch->table_folders_.insert(fs::hash_value(fs::path(folder)));
  TRUETRIAD_RETURN_IF_ERROR(watch->Scan(folder));
  return watch;
}

double LogWatch::LookS() const { return events_ ? kLookS : options_.poll_s.value_or(kPollS); }

Status LogWatch::Look() {
  if (events_) {
    for (const FolderEvents::Event& event : events_->Take()) {
      last_change_ = Clock::now();
      Handle(event);
      if (!events_) break;
    }
  }
  if (Clock::now() < next_look_) return {};
  if (!events_ || !failure_.empty()) {
    const Status status = Scan(options_.folder);
    const std::string failure = status ? "" : status.error().message;
    if (failure != failure_) tell_(status ? options_.folder + " can be read again" : failure);
    failure_ = failure;
  }
  LookAtWaiting();
  next_look_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1e3 * LookS()));
  return {};
}

void LogWatch::Handle(const FolderEvents::Event& event) {
  using Kind = FolderEvents::Kind;
  switch (event.kind) {
    case Kind::kWhole:
    case Kind::kAppeared:
      HandleFile(event.path, event.kind == Kind::kWhole);
      return;
    case Kind::kNewFolder:
      // Not one within a recording. What cannot be read is gone again.
      if (IsEntered(event.path) && LogOf(event.path) == event.path)
        (void)Scan(event.path).has_value();
      return;
    case Kind::kGone:
      if (event.path != fs::path(options_.folder)) return;
      failure_ = options_.folder + " is gone";
      tell_(failure_ + "; waiting for it to come back");
      return;
    case Kind::kLost:
      tell_("more files came at once than the system tells of; looking through " + options_.folder);
      if (const Status status = Scan(options_.folder); !status) failure_ = status.error().message;
      return;
  }
}

void LogWatch::HandleFile(const fs::path& file, bool is_whole) {
  if ((!IsTable(file) && file.filename() != kManifestName) || IsLeftOut(file)) return;
  const std::string log = LogOf(file).string();
  const bool is_given_at_once = is_whole && log == file.string() && IsTable(file) &&
                                table_folders_.contains(FolderHash(file));
  if (is_given_at_once) {
    Give(log);
  } else {
    waiting_.try_emplace(log);
  }
}

Status LogWatch::Scan(const fs::path& folder) {
  Status full;
  const auto enters = [&](const fs::path& entered) {
    if (IsLeftOut(entered)) return false;
    if (!events_ || !full) return true;
    const Status watched = events_->Watch(entered);
    std::error_code missing;
    if (!watched && fs::exists(entered, missing)) full = watched;
    return true;
  };
  const Status status = ForEachLog(folder, enters, [&](const fs::path& log) {
    if (!done_.Has(log.string())) waiting_.try_emplace(log.string());
  });
  if (!full) TurnToPolling(full.error().message);
  return status;
}

bool LogWatch::IsLeftOut(const fs::path& path) const {
  if (options_.without.empty()) return false;
  std::error_code failure;
  const std::string whole = fs::absolute(path, failure).lexically_normal().string();
  return whole == options_.without || whole.starts_with(options_.without + "/");
}

fs::path LogWatch::LogOf(const fs::path& file) const {
  const fs::path below = file.parent_path().lexically_relative(options_.folder);
  fs::path folder = options_.folder;
  std::error_code missing;
  for (auto part = below.begin();; ++part) {
    if (fs::exists(folder / kManifestName, missing)) return folder / kManifestName;
    if (part == below.end()) return file;
    if (*part != ".") folder /= *part;
  }
}

void LogWatch::LookAtWaiting() {
  folder_states_.clear();
  for (auto at = waiting_.begin(); at != waiting_.end();) {
    const auto item = at++;
    const std::string& log = item->first;
    const std::string whole = LogOf(log).string();
    if (whole != log) waiting_.try_emplace(whole);
    const std::optional<LogStamp> stamp = StampOf(log);
    if (whole != log || !stamp || done_.Has(log, *stamp)) {
      waiting_.erase(item);
      continue;
    }
    const std::string state = StateOf(log, *stamp);
    if (!state.empty() && state == item->second && !IsBeingWritten(log)) {
      Give(log);
      waiting_.erase(item);
      continue;
    }
    if (state != item->second) last_change_ = Clock::now();
    item->second = state;
  }
}

std::string LogWatch::StateOf(const std::string& log, const LogStamp& stamp) {
  const fs::path path = log;
  if (path.filename() != kManifestName) {
    if (table_folders_.contains(FolderHash(path))) return StampText(stamp);
    // The recording.yaml that this one belongs to may be on its way.
    std::string& state = folder_states_[path.parent_path()];
    if (state.empty()) state = StampText(StampOfFolder(path.parent_path()));
    return state;
  }
  std::string state = StampText(stamp);
  const Result<std::vector<std::string>> tables = TablesOfManifest(log);
  if (!tables) return state;  // Its run will say what is wrong.
  for (const std::string& table : *tables) {
    const std::optional<LogStamp> of_table = StampOf(table);
    if (!of_table || IsBeingWritten(table)) return "";
    state += StampText(*of_table);
  }
  return state;
}

void LogWatch::Give(const std::string& log) {
  last_change_ = Clock::now();
  const fs::path path = log;
  if (path.filename() != kManifestName) table_folders_.insert(FolderHash(path));
  ready_.push_back(log);
}

std::optional<Arrival> LogWatch::Next() {
  for (std::size_t i = ready_.size(); i > 0; --i) {
    std::string log = std::move(ready_.front());
    ready_.pop_front();
    if (in_hand_.contains(log)) {
      ready_.push_back(std::move(log));  // It came again meanwhile.
      continue;
    }
    const std::optional<LogStamp> stamp = StampOf(log);
    if (!stamp || done_.Has(log, *stamp)) continue;
    Arrival arrival{.order = {.log = log}};
    const Status named = TakeSerial(options_.serial_pattern, &arrival.order);
    if (!named && named.error().code == ErrorCode::kInvalidValue) {
      tell_(named.error().message);  // No store can keep it.
      done_.Add(log, *stamp);
      continue;
    }
    if (!named) arrival.refusal = named.error();
    in_hand_.insert(log);
    return arrival;
  }
  return std::nullopt;
}

bool LogWatch::HasEnded() const {
  if (!options_.until_idle_s || !in_hand_.empty() || !ready_.empty()) return false;
  // What is seen for the first time is given at the look after the next.
  constexpr double kLooks = 3.0;
  const double idle_s = std::chrono::duration<double>(Clock::now() - last_change_).count();
  return idle_s > std::max(*options_.until_idle_s, kLooks * LookS());
}

void LogWatch::Again(const UnitRun& run) {
  in_hand_.erase(run.log);
  ready_.push_back(run.log);
}

void LogWatch::Finish(const UnitRun& run) {
  last_change_ = Clock::now();
  in_hand_.erase(run.log);
  done_.Add(run.log, {run.log_bytes, run.log_modified_ns});
}

void LogWatch::TurnToPolling(const std::string& why) {
  events_.reset();
  options_.poll_s = options_.poll_s.value_or(kPollS);
  std::array<char, 64> often{};
  std::snprintf(often.data(), often.size(), "; looking every %g s instead", *options_.poll_s);
  tell_(why + often.data());
}

}  // namespace truetriad::fleet
