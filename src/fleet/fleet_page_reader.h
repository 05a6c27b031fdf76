// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Words of which units have one each, and which: 0 is the first.
struct PageWords {
  explicit PageWords(std::string what) : name(std::move(what)) {}

  std::string name;  ///< "verdict", "lot".
  std::vector<std::string> words;
  std::vector<std::uint32_t> of;  ///< By unit.

  /// The number of `word`, which is added where it is new.
  std::uint32_t NumberOf(const std::string& word);
  /// Puts the words into the order of their bytes; one that no unit has goes.
  void Sort();

 private:
  std::map<std::string, std::uint32_t> numbers_;
};

/// What units were judged by, or a parameter: a number of each unit.
struct PageColumn {
  std::string name = {};
  bool is_judged = false;
  std::string lower = {}, target = {}, upper = {};  ///< Limits, as text; empty: open.
  bool limits_differ = false;                       ///< Among the units: none is shown.
  std::vector<float> values = {};                   ///< By unit; NaN: none.
};

/// The units of a page, in the order of their serial numbers; of each the run that counts.
struct PageUnits {
  std::vector<std::string> serials, runs;
  std::vector<std::int64_t> recorded_s;  ///< When it was measured, since 1970, UTC; 0: not known.
  PageWords verdict{"verdict"}, first_verdict{"first"}, code{"code"};
  std::vector<PageWords> tags;           ///< Those that any unit has, but notes.
  std::vector<std::uint32_t> run_count;  ///< All runs of a unit.
  std::vector<PageColumn> columns;
  std::size_t reports = 0;

  std::size_t size() const { return serials.size(); }
};

/// Units whose runs are one file: what is looked up when a unit is opened.
inline constexpr std::size_t kUnitsInPart = 250;

/// Reads the units that `where` lets through. `add_part` is given the text of each part of their
/// runs, from 0 on. Where run folders' names are relative, they are looked for from here and beside
/// `store_name`; links lead to them from `page_folder`. Errors: as Store::Query.
Result<PageUnits> ReadPageUnits(
    Store& store,
    const std::string& store_name,
    const std::string& where,
    const std::string& page_folder,
    const std::function<Status(std::size_t part, const std::string& script)>& add_part);

}  // namespace truetriad::fleet
