// SPDX-License-Identifier: Apache-2.0
//
// Runs contaminated recordings and says what came of them: a line each, and the table by kind; or,
// with --prices, the table of what each mechanism is worth.
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gflags/gflags.h>
#include <glog/logging.h>

#include "trust/prices.h"
#include "trust/trial.h"

DEFINE_uint64(first, 0, "the first seed");
DEFINE_uint64(runs, 300, "how many seeds");
DEFINE_int32(threads, 2, "how many at a time");
DEFINE_string(only, "", "only kinds whose name contains one of these, NAME[;NAME]");
DEFINE_bool(clean, false, "clean recordings of every regime instead");
DEFINE_string(keep, "", "keep the files of every run in this folder");
DEFINE_string(write, "", "calibrate nothing, and write the files of every run into this folder");
DEFINE_string(lines, "", "write a line for each run to this file");
DEFINE_string(table, "", "write the table by fault, or of prices, into this file");
DEFINE_bool(prices, false, "run again without each mechanism that acted: what each is worth");
DEFINE_string(often,
              "",
              "with --prices: mechanisms that act so often that a share tells their price");
DEFINE_uint64(one_in, 8, "with --often: of how many recordings one is run again");
DEFINE_string(without, "", "switch off these mechanisms, NAME[,NAME]");
DEFINE_double(most_wrong, 1.0, "fail where more of the runs that can be seen are wrong");

namespace truetriad::trust {
namespace {

namespace fs = std::filesystem;

std::vector<Kind> WantedKinds() {
  std::vector<Kind> kinds;
  if (FLAGS_clean) {
    for (const Regime regime : kRegimes) kinds.push_back({nullptr, {}, regime});
    return kinds;
  }
  for (const Kind& kind : Kinds()) {
    std::istringstream only(FLAGS_only);
    bool is_wanted = FLAGS_only.empty();
    for (std::string name; std::getline(only, name, ';');) {
      is_wanted = is_wanted || kind.Name().find(name) != std::string::npos;
    }
    if (is_wanted) kinds.push_back(kind);
  }
  return kinds;
}

const char* VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kRight:
      return "right";
    case Verdict::kRefused:
      return "refused";
    case Verdict::kWrong:
      return "WRONG";
    case Verdict::kCrashed:
      return "CRASHED";
  }
  return "";
}

std::string LineOf(const Trial& trial) {
  std::string said;
  for (const std::string& code : trial.said) said += (said.empty() ? "" : ",") + code;
  char numbers[120];
  std::snprintf(numbers,
                sizeof numbers,
                "%llu\t%s\t%.3g\t%.1f\t%.2f",
                static_cast<unsigned long long>(trial.seed),
                VerdictName(trial.verdict),
                trial.severity,
                trial.worst_sigmas,
                trial.seconds);
  return std::string(numbers) + "\t" + trial.kind.Name() + "\t" + trial.second + "\t" +
         trial.worst_parameter + "\t" + said + "\t" + (trial.blames_other ? "OTHER " : "") +
         trial.refusal.substr(0, 150);
}

// Rows are by fault and sensor, over all regimes, but separate if nothing shows the fault.
std::string RowName(const Kind& kind) {
  std::string name = kind.fault == nullptr ? kind.Name() : std::string(kind.fault->name);
  if (kind.fault != nullptr && kind.triad && kind.fault->triads.size() > 1) {
    name += ", " + std::string(TriadName(*kind.triad));
  }
  return name + (kind.CanBeSeen() ? "" : " (nothing shows it)");
}

struct Row {
  int runs = 0, right = 0, refused = 0, wrong = 0, silent = 0, blames_other = 0;
  double longest_s = 0.0;
  std::map<std::string, int> reasons;

  void Add(const Trial& trial) {
    ++runs;
    right += trial.verdict == Verdict::kRight;
    refused += trial.verdict == Verdict::kRefused;
    wrong += trial.verdict == Verdict::kWrong || trial.verdict == Verdict::kCrashed;
    silent += trial.IsSilent();
    blames_other += trial.blames_other;
    longest_s = std::max(longest_s, trial.seconds);
    if (trial.verdict == Verdict::kRefused)
      ++reasons[trial.refusal.find(' ') == std::string::npos ? trial.refusal : "bad input"];
  }
};

std::string TableOf(const std::map<std::string, Row>& rows) {
  std::string text =
      "| fault | runs | right | refused | wrong | undetected | most frequent reason |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const auto& [name, row] : rows) {
    std::string reason;
    int most = 0;
    for (const auto& [text_of, count] : row.reasons) {
      if (count > most) most = count, reason = text_of;
    }
    text += "| " + name + " | " + std::to_string(row.runs) + " | " + std::to_string(row.right) +
            " | " + std::to_string(row.refused) + " | " + std::to_string(row.wrong) + " | " +
            std::to_string(row.silent) + " | " + reason + " |\n";
  }
  return text;
}

// Runs all seeds in FLAGS_threads threads.
void ForEachSeed(const std::function<void(std::uint64_t)>& run) {
  std::atomic<std::uint64_t> next = FLAGS_first;
  std::vector<std::jthread> workers;
  for (int i = 0; i < FLAGS_threads; ++i) {
    workers.emplace_back([&] {
      for (std::uint64_t seed; (seed = next++) < FLAGS_first + FLAGS_runs;) run(seed);
    });
  }
  workers.clear();  // Joins them.
}

int WriteAll(const std::vector<Kind>& kinds) {
  std::atomic<bool> failed = false;
  ForEachSeed([&](std::uint64_t seed) {
    const fs::path own = fs::path(FLAGS_write) / std::to_string(seed);
    const Status status = WriteTrial(seed, kinds, own.string());
    if (status) return;
    failed = true;
    std::cerr << own.string() + ": " + status.error().message + "\n";
  });
  return failed ? 2 : 0;
}

int Main() {
  if (!kCountsMechanisms && (FLAGS_prices || !FLAGS_without.empty())) {
    std::cerr << "this needs a build with -DTRUETRIAD_MECHANISMS=ON\n";
    return 2;
  }
  if (!FLAGS_without.empty()) setenv("TRUETRIAD_WITHOUT", FLAGS_without.c_str(), 1);
  if (FLAGS_one_in == 0) {
    std::cerr << "--one_in is at least 1\n";
    return 2;
  }
  const std::vector<Kind> kinds = WantedKinds();
  if (kinds.empty()) {
    std::cerr << "no kind has `" << FLAGS_only << "` in its name\n";
    return 2;
  }
  if (!FLAGS_write.empty()) return WriteAll(kinds);
  const fs::path folder = FLAGS_keep.empty()
                              ? fs::temp_directory_path() / ("trust" + std::to_string(getpid()))
                              : fs::path(FLAGS_keep);
  std::ofstream lines;
  if (!FLAGS_lines.empty()) lines.open(FLAGS_lines);
  std::mutex mutex;
  std::map<std::string, Row> rows;
  Row all, seen;
  Prices prices;
  ForEachSeed([&](std::uint64_t seed) {
    const fs::path own = folder / std::to_string(seed);
    // Kinds follow each other by seed: the share is one seed of FLAGS_one_in of each kind.
    const bool is_share = seed / kinds.size() % FLAGS_one_in == seed % kinds.size() % FLAGS_one_in;
    const auto is_priced = [&](Mechanism mechanism) {
      const std::string name(Mechanisms()[static_cast<std::size_t>(mechanism)].name);
      const bool is_often = ("," + FLAGS_often + ",").find("," + name + ",") < std::string::npos;
      return FLAGS_prices && (is_share || !is_often);
    };
    const Trial trial = RunTrial(seed, kinds, own.string(), is_priced);
    std::error_code ignored;
    if (FLAGS_keep.empty()) fs::remove_all(own, ignored);
    const std::scoped_lock lock(mutex);
    rows[RowName(trial.kind)].Add(trial);
    all.Add(trial);
    prices.Add(trial);
    if (trial.kind.CanBeSeen()) seen.Add(trial);
    if (lines.is_open()) lines << LineOf(trial) << std::endl;
    if (trial.verdict == Verdict::kCrashed) std::cout << LineOf(trial) << std::endl;
  });
  if (FLAGS_keep.empty()) fs::remove_all(folder);
  const std::string table = FLAGS_prices ? prices.Table() : TableOf(rows);
  if (!FLAGS_table.empty()) std::ofstream(FLAGS_table) << table;
  if (FLAGS_prices) std::cout << table;
  for (const auto& [name, row] : {std::pair{"all", all}, std::pair{"that can be seen", seen}}) {
    std::printf(
        "%s: %d runs, right %d, refused %d (%d blame another sensor), wrong %d (%.2f %%), "
        "undetected %d; longest %.1f s\n",
        name,
        row.runs,
        row.right,
        row.refused,
        row.blames_other,
        row.wrong,
        100.0 * row.wrong / std::max(row.runs, 1),
        row.silent,
        row.longest_s);
  }
  return seen.wrong <= FLAGS_most_wrong * seen.runs ? 0 : 1;
}

}  // namespace
}  // namespace truetriad::trust

int main(int argc, char** argv) {
  FLAGS_minloglevel = 3;
  google::InitGoogleLogging(argv[0]);
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return truetriad::trust::Main();
}
