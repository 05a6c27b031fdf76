// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/fleet_run.h"
#include "fleet/log_watch.h"
#include "fleet/unit_folders.h"
#include "fleet/unit_list.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/format_flags.h"
#include "tools/truetriad/interruption.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(folder, "", "the folder in which, and below which, logs arrive");
DEFINE_string(poll,
              "",
              "look every so many seconds, instead of being told by the system (default: 5 on "
              "network folders, which do not tell)");
DEFINE_string(until_idle, "", "end when nothing has happened for so many seconds");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

Result<std::optional<double>> StatedSeconds(const std::string& flag, const std::string& text) {
  if (text.empty()) return std::optional<double>();
  TRUETRIAD_ASSIGN_OR_RETURN(const double seconds, ParseReal(flag, text));
  constexpr double kLeast = 0.05, kMost = 1e6;
  if (seconds >= kLeast && seconds <= kMost) return std::optional(seconds);
  return Error(ErrorCode::kInvalidArgument,
               "--" + flag + "=" + text + ": expected seconds, 0.05 or more");
}

Result<VerbResult> RunFleetWatch(const std::vector<std::string>&) {
  fleet::WatchOptions watched{.folder = FLAGS_folder, .serial_pattern = FLAGS_serial};
  TRUETRIAD_ASSIGN_OR_RETURN(watched.poll_s, StatedSeconds("poll", FLAGS_poll));
  TRUETRIAD_ASSIGN_OR_RETURN(watched.until_idle_s, StatedSeconds("until-idle", FLAGS_until_idle));
  std::error_code failure;
  if (!fs::is_directory(watched.folder, failure)) {
    return Error(ErrorCode::kUnreadableFile, {watched.folder}, "is no folder that can be read");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(fleet::FleetOptions options, StatedFleetOptions());
  watched.without = options.plan.folder;
  TRUETRIAD_RETURN_IF_ERROR(fleet::CheckSerialsToCome(options.plan, FLAGS_serial));
  TRUETRIAD_RETURN_IF_ERROR(PrepareUnitsFolder(options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::FolderClaim own,
                             fleet::FolderClaim::TakeAlone(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store, OpenStatedStore());
  TRUETRIAD_RETURN_IF_ERROR(store->StateShard({}));
  TRUETRIAD_RETURN_IF_ERROR(NameStore(*store, &options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(options.hold,
                             StatedGoldenHold(options.plan, *store, /*needs_station=*/true));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::FolderClaim claim,
      fleet::FolderClaim::Share(options.plan.folder, *store, options.plan.store));
  NoteInterruptions();
  const Result<fleet::FleetProgress> progress = [&] {
    FleetTalk talk(/*names_all=*/true);
    return fleet::WatchFleet(watched, options, *store, talk.Listener(), IsInterrupted);
  }();
  TRUETRIAD_RETURN_IF_ERROR(progress);
  return FleetResult(*progress);
}

}  // namespace

Command FleetWatchCommand() {
  return {
      .name = "fleet watch",
      .summary = "Calibrates units as their logs arrive in a folder, for days.",
      .examples =
          "build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line\n"
          "build/truetriad fleet watch out/line -o out/day --report=false --until-idle=5",
      .details =
          "As fleet run, of logs that are there without a run, and then of each that is closed "
          "after writing or\nrenamed into FOLDER or below it; one that arrives again changed is a "
          "new run. A recording.yaml counts\nonce all files that it names are there and have "
          "stayed "
          "the same; with --until-idle in the end as it is.\nEnds on SIGTERM after the units in "
          "hand, exit code 0.\n",
      .flags =
          FleetFlags({{"folder", "DIR", true}, {"poll", "SECONDS"}, {"until-idle", "SECONDS"}}),
      .words = {"folder"},
      .run = RunFleetWatch};
}

}  // namespace truetriad
