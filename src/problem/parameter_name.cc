// SPDX-License-Identifier: Apache-2.0
#include "problem/parameter_name.h"

#include <algorithm>
#include <string_view>

#include "truetriad/base/triad.h"

namespace truetriad {

std::string ParameterName::str() const {
  std::string text(TriadName(triad));
  if (is_thermal()) text += ".thermal";
  text.append(".").append(InfoOf(kind).name);
  if (power > 0) text.append(".").append(std::to_string(power));
  text += '.';
  text += AxisLetter(row);
  if (InfoOf(kind).is_matrix) text += AxisLetter(col);
  return text;
}

std::optional<ParameterName> ParameterName::Parse(const std::string& text) {
  // sensor [thermal] kind [power] axes
  const std::size_t first = text.find('.');
  const std::size_t last = text.rfind('.');
  const auto triad = TriadFromName(text.substr(0, first));
  if (!triad || last <= first) return std::nullopt;
  ParameterName name;
  name.triad = *triad;
  std::string_view what = std::string_view(text).substr(first + 1, last - first - 1);
  constexpr std::string_view kThermal = "thermal.";
  if (what.starts_with(kThermal)) {
    what.remove_prefix(kThermal.size());
    const std::size_t dot = what.rfind('.');
    if (dot + 2 == what.size() && what.back() >= '1' && what.back() <= '9') {
      name.power = what.back() - '0';
      what = what.substr(0, dot);
    }
  }
  const auto* info = std::find_if(kParameterKinds.begin(),
                                  kParameterKinds.end(),
                                  [&](const ParameterInfo& listed) { return listed.name == what; });
  const std::string_view axes = std::string_view(text).substr(last + 1);
  if (info == kParameterKinds.end() || axes.size() != (info->is_matrix ? 2U : 1U))
    return std::nullopt;
  name.kind = info->kind;
  if (axes.find_first_not_of(kAxisLetters) != std::string_view::npos) return std::nullopt;
  name.row = static_cast<int>(kAxisLetters.find(axes.front()));
  if (info->is_matrix) name.col = static_cast<int>(kAxisLetters.find(axes.back()));
  return name;
}

}  // namespace truetriad
