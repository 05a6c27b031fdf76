// SPDX-License-Identifier: Apache-2.0
#include "trust/prices.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "math/distributions.h"

namespace truetriad::trust {
namespace {

// σ with a mechanism over σ without it, as geometric mean over parameters; unset without both.
std::optional<double> SigmaRatio(const Trial& with, const Trial& without) {
  double sum = 0.0, count = 0.0;
  for (const auto& [name, sigma] : with.sigmas) {
    const auto other = without.sigmas.find(name);
    if (other == without.sigmas.end() || !(sigma > 0.0) || !(other->second > 0.0)) continue;
    sum += std::log(sigma / other->second);
    ++count;
  }
  return count > 0.0 ? std::optional(std::exp(sum / count)) : std::nullopt;
}

}  // namespace

void Prices::Price::Add(const Trial& with, const Trial& without) {
  const auto is_wrong = [](const Trial& trial) { return trial.verdict == Verdict::kWrong; };
  ++again;
  crashed += without.verdict == Verdict::kCrashed;
  if (with.kind.CanBeSeen() && without.verdict != Verdict::kCrashed) {
    avoided += !is_wrong(with) && is_wrong(without);
    caused += is_wrong(with) && !is_wrong(without);
  }
  kept += with.verdict == Verdict::kRight && without.verdict != Verdict::kRight;
  refused += with.verdict == Verdict::kRefused && without.verdict == Verdict::kRight;
  if (const auto ratio = SigmaRatio(with, without)) sigma_ratios.push_back(*ratio);
}

void Prices::Add(const Trial& trial) {
  for (const Mechanism mechanism : trial.acted) ++prices_[mechanism].acted;
  for (const Trial& without : trial.without) prices_[*without.off].Add(trial, without);
  for (const std::string& name : std::set(trial.findings.begin(), trial.findings.end())) {
    ++said_[name].runs;
  }
  if (trial.verdict == Verdict::kRefused && FindingCodeFromName(trial.refusal)) {
    ++said_[trial.refusal].refused;
  }
}

std::string Prices::Table() const {
  std::vector<const MechanismInfo*> rows;
  for (const MechanismInfo& info : Mechanisms()) {
    if (info.mechanism < Mechanism::kNothingToSolve) rows.push_back(&info);
  }
  const auto price_of = [&](const MechanismInfo& info) {
    const auto at = prices_.find(info.mechanism);
    return at == prices_.end() ? Price() : at->second;
  };
  std::stable_sort(rows.begin(), rows.end(), [&](const auto* a, const auto* b) {
    const auto worth = [&](const MechanismInfo& info) {
      const Price price = price_of(info);
      return std::tuple(price.OfAll(price.avoided) - price.OfAll(price.caused),
                        price.OfAll(price.kept) - price.OfAll(price.refused),
                        price.acted);
    };
    return worth(*a) > worth(*b);
  });
  std::string text =
      "| mechanism | acted in | run again | wrong avoided | wrong caused | right kept | good "
      "refused | σ ratio "
      "| crashed without |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const MechanismInfo* info : rows) {
    Price price = price_of(*info);
    char ratio[40] = "";
    if (!price.sigma_ratios.empty()) {
      std::snprintf(ratio, sizeof ratio, "%.3f", Median(std::move(price.sigma_ratios)));
    }
    text += "| " + std::string(info->name) + " | ";
    for (const int count : {price.acted, price.again}) text += std::to_string(count) + " | ";
    for (const int count : {price.avoided, price.caused, price.kept, price.refused}) {
      text += std::to_string(price.OfAll(count)) + " | ";
    }
    text += std::string(ratio) + " | " + std::to_string(price.crashed) + " |\n";
  }
  text += "\n| finding | mechanism | said in | refused by it |\n|---|---|---|---|\n";
  for (const FindingKind& kind : FindingKinds()) {
    const auto at = said_.find(std::string(kind.name));
    const Said said = at == said_.end() ? Said() : at->second;
    const MechanismInfo& info = Mechanisms()[static_cast<std::size_t>(MechanismOf(kind.code))];
    text += "| " + std::string(kind.name) + " | " + std::string(info.name) + " | " +
            std::to_string(said.runs) + " | " + std::to_string(said.refused) + " |\n";
  }
  return text;
}

}  // namespace truetriad::trust
