// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

// What a calibration report says and in which order, once for the terminal and for HTML.

struct Headline {
  Grade grade = Grade::kBad;
  std::string text;         ///< "PASS, A0001: all 6 limits are met".
  std::string explanation;  ///< One sentence.
};
/// Begins with the verdict's words, then the serial number and the first reason.
Headline HeadlineOf(const Calibration& calibration);
/// "FAIL by R. Roe on 2026-11-25T10:00:00Z: connector bent".
std::string DecisionText(const Decision& decision);
/// The one of the limits, of which there is one, that is most surely missed, or nearest to it.
const LimitCheck& WorstLimit(const std::vector<LimitCheck>& limits);
/// "accelerometer.bias.y -0.889 of ± 0.7 m/s²".
std::string MissedText(const LimitCheck& check);

/// A title inside a section.
struct Subtitle {
  std::string text;
};
/// One point of a list.
struct Bullet {
  std::string text;
  std::string tag = {};  ///< Shown small behind it: "warning, clock-offset".
};
/// A paragraph, a subtitle, a list point or a table.
using Block = std::variant<std::string, Subtitle, Bullet, Table>;

/// A part of a page. Without a title it belongs to the head.
struct Section {
  std::string title;
  std::vector<Block> blocks;
  std::function<std::vector<Drawing>()> draw = {};  ///< What pages alone show behind the blocks.

  void Add(Block block) { blocks.push_back(std::move(block)); }
};
/// What a verb says, once for the terminal and for HTML.
struct PageContent {
  std::string title;
  Headline headline;
  std::vector<Section> sections;
};

/// The sections in reading order: limits, findings, error before and after, parameters with σ,
/// temperature, weak directions, choice of the model, held-out error, residuals, left-out terms,
/// coverage; one with nothing to say is left out. A calibration that is not usable has no
/// parameters section, whatever numbers it carries. `turns`: spheres have data to be turned.
std::vector<Section> SectionsOf(const Calibration& calibration, bool turns = false);

/// That of the limits, with `coverage_factor` σ behind each ±.
Section LimitsSection(const Calibration& calibration, double coverage_factor);

/// Serial, model, software, inputs, gauge: one row each.
Table IdentityTable(const Calibration& calibration);

/// "from an Allan deviation".
std::string_view NoiseSourceWords(NoiseSource source);

/// "Accelerometer".
std::string TriadTitle(Triad triad);

/// "0.0912 deg; 0.271 deg with nominal gains …" for errors of turns.
std::string MedianAngles(double median_rad, const std::optional<double>& nominal_rad);

/// The true unit of one triad, for display.
std::string TruthUnit(Triad triad);

}  // namespace truetriad
