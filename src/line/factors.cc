// SPDX-License-Identifier: Apache-2.0
#include "line/factors.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace truetriad::line {
namespace {

constexpr std::size_t kUnitsOfLevel = 3;
// Levels of all factors together: the model's matrix is decomposed for every parameter.
constexpr std::size_t kMostLevels = 200;

// Of a unit without values, which says nothing of what goes with what.
constexpr int kNoLevel = -1;

bool HasValues(const UnitRecord& unit) { return unit.values.array().isFinite().any(); }

struct Coded {
  FactorLevels levels;
  std::vector<int> level_of;
};

Coded CodedTag(const LineData& data, const std::string& tag) {
  std::map<std::string, int> code;
  for (const UnitRecord& unit : data.units) {
    if (HasValues(unit)) code.emplace(TagOf(unit, tag), 0);
  }
  Coded coded;
  coded.levels.name = tag;
  for (auto& [level, number] : code) {
    number = static_cast<int>(coded.levels.levels.size());
    coded.levels.levels.push_back(level);
  }
  coded.level_of.reserve(data.units.size());
  for (const UnitRecord& unit : data.units) {
    coded.level_of.push_back(HasValues(unit) ? code.at(TagOf(unit, tag)) : kNoLevel);
  }
  return coded;
}

// Whether units of one level of `finer` all have the same level of `coarser`. Those without one of
// the tags say nothing of that.
bool Determines(const Factors& factors, std::size_t finer, std::size_t coarser) {
  std::map<int, int> goes_with;
  for (std::size_t unit = 0; unit < factors.level_of[finer].size(); ++unit) {
    if (!factors.IsNamed(finer, unit) || !factors.IsNamed(coarser, unit)) continue;
    const int level = factors.level_of[coarser][unit];
    const auto at = goes_with.emplace(factors.level_of[finer][unit], level).first;
    if (at->second != level) return false;
  }
  return !goes_with.empty();
}

void Relate(Factors* factors) {
  const std::size_t count = factors->count();
  factors->related.assign(count, std::vector<bool>(count, false));
  for (std::size_t a = 0; a < count; ++a) {
    factors->related[a][a] = true;
    for (std::size_t b = 0; b < a; ++b) {
      const bool a_says_b = Determines(*factors, a, b);
      const bool b_says_a = Determines(*factors, b, a);
      factors->related[a][b] = factors->related[b][a] = a_says_b || b_says_a;
      const std::string& first = factors->factors[b].name;
      const std::string& second = factors->factors[a].name;
      if (a_says_b && b_says_a) {
        factors->notes.push_back(
            first + " and " + second + " cannot be told apart: all units of a " + first +
            " have the same " + second + ", and all of a " + second + " the same " + first);
      } else if (a_says_b || b_says_a) {
        const std::string& finer = a_says_b ? second : first;
        const std::string& coarser = a_says_b ? first : second;
        factors->notes.push_back("each " + finer + " goes with one " + coarser +
                                 ": the effect of " + coarser + " includes that of " + finer +
                                 ", and is held against it");
      }
    }
  }
}

// Those that no other of them determines; of two that go together the first one.
std::vector<std::size_t> Undetermined(const Factors& factors,
                                      const std::vector<std::size_t>& some) {
  std::vector<std::size_t> left;
  for (const std::size_t a : some) {
    const std::size_t levels = factors.factors[a].levels.size();
    const bool is_determined = std::any_of(some.begin(), some.end(), [&](std::size_t b) {
      const std::size_t others = factors.factors[b].levels.size();
      return b != a && factors.related[a][b] && (others > levels || (others == levels && b < a));
    });
    if (!is_determined) left.push_back(a);
  }
  return left;
}

}  // namespace

Factors FactorsOf(const LineData& data, const std::vector<std::string>& wanted) {
  Factors factors;
  const auto units =
      static_cast<std::size_t>(std::count_if(data.units.begin(), data.units.end(), HasValues));
  std::size_t levels = 0;
  for (const std::string& tag : wanted) {
    Coded coded = CodedTag(data, tag);
    const std::size_t own = coded.levels.levels.size();
    const auto unnamed = std::count_if(data.units.begin(), data.units.end(), [&](const auto& unit) {
      return HasValues(unit) && TagOf(unit, tag).empty();
    });
    if (own < (unnamed > 0 ? 3 : 2)) continue;
    if (units < kUnitsOfLevel * own) {
      factors.notes.push_back(tag + " is left out: " + std::to_string(own) + " levels for " +
                              std::to_string(units) + " units");
      continue;
    }
    if (levels + own > kMostLevels) {
      factors.notes.push_back(tag + " is left out: with its " + std::to_string(own) +
                              " levels there would be more than " + std::to_string(kMostLevels));
      continue;
    }
    if (unnamed > 0) {
      factors.notes.push_back(std::to_string(unnamed) + " of " + std::to_string(units) +
                              " units have no " + tag + " and are not in its estimate");
    }
    levels += own;
    factors.factors.push_back(std::move(coded.levels));
    factors.level_of.push_back(std::move(coded.level_of));
  }
  Relate(&factors);
  return factors;
}

std::vector<std::size_t> FullModel(const Factors& factors) {
  std::vector<std::size_t> all(factors.count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return Undetermined(factors, all);
}

std::vector<std::size_t> ModelFor(const Factors& factors, std::size_t factor) {
  std::vector<std::size_t> others;
  for (std::size_t a = 0; a < factors.count(); ++a) {
    if (!factors.related[a][factor]) others.push_back(a);
  }
  std::vector<std::size_t> model = Undetermined(factors, others);
  model.insert(model.begin(), factor);
  return model;
}

}  // namespace truetriad::line
