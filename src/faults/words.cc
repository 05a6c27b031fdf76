// SPDX-License-Identifier: Apache-2.0
#include "faults/words.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/messages.h"

namespace truetriad {
namespace {

// Up to three components are listed; if there are more, their norm is stated.
constexpr Eigen::Index kMostInALine = 3;

std::string ListOf(const Eigen::VectorXd& values) {
  if (values.size() == 1) return Format("%.3g", values[0]);
  std::string list = "(";
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    list += Format(i == 0 ? "%.3g" : ", %.3g", values[i]);
  }
  return list + ")";
}

std::string SizeOf(const TakenFault& fault, const std::string& unit) {
  const std::string after = unit.empty() || unit == "1" ? "" : " " + unit;
  if (fault.h.size() <= kMostInALine) {
    return ListOf(fault.h) + " ± " + ListOf(fault.sigma) + after;
  }
  return Format("%.3g", fault.h.norm()) + Format(" ± %.2g", fault.sigma.norm()) + after +
         " (norm of all components)";
}

std::string ChanceOf(double log_p) {
  const double digits = -log_p / std::numbers::ln10;
  if (digits < 6.0) {
    return Format("by chance alone, 1 of %.0f fault-free recordings shows as much",
                  std::exp(-log_p));
  }
  return Format("by chance alone, 1 of 10^%.0f fault-free recordings shows as much", digits);
}

}  // namespace

std::string WordsOf(const FaultPlace& place) {
  std::string words = std::string(TriadName(place.triad)) + ": " + std::string(place.kind->name);
  switch (place.kind->shape) {
    case FaultShape::kStep:
      return words + ", from pose " + std::to_string(place.first_pose) + " on";
    case FaultShape::kWindow:
      return words + ", pose " + std::to_string(place.first_pose) + " to " +
             std::to_string(place.last_pose);
    case FaultShape::kOnce:
      words += (place.kind->form == FaultForm::kTurn ? ", after pose " : ", pose ");
      return words + std::to_string(place.first_pose);
    default:
      return words;
  }
}

FaultWords WordsOf(const TakenFault& fault, const PerTriad<std::string>& raw_units) {
  const FaultKind& kind = *fault.place.kind;
  FaultWords words;
  words.what = WordsOf(fault.place);
  words.size =
      SizeOf(fault, kind.unit.empty() ? raw_units[fault.place.triad] : std::string(kind.unit));
  words.chance = ChanceOf(fault.log_p);
  words.shift =
      Format("left uncorrected, it would shift a parameter by up to %.1f σ", fault.shift_sigmas);
  for (const FaultPlace& rival : fault.rivals) words.rivals.push_back(WordsOf(rival));
  std::vector<std::string> poses;
  for (const int pose : fault.left_out_instead) poses.push_back(std::to_string(pose));
  if (!poses.empty()) {
    words.rivals.push_back("an error of " + std::string(poses.size() == 1 ? "pose " : "poses ") +
                           Listed(poses) + " alone");
  }
  words.remedy = kind.remedy;
  return words;
}

std::string FaultWords::Statement() const {
  std::string sentence = (rivals.empty() ? "" : "either ") + what;
  for (const std::string& rival : rivals) sentence += ", or " + rival;
  return sentence + ": " + size + "; " + chance + "; " + shift;
}

std::string WordsOf(const FaultNote& note) {
  return WordsOf(note.place) +
         Format(" can neither be shown nor ruled out (p = %.1g); ", std::exp(note.log_p)) +
         Format("if it is as large as its own σ, it shifts a parameter by %.1f σ", note.kappa);
}

std::string WordsOf(const LostRowsFound& lost) {
  return Format(
             "turn angles scatter as if %.2g %% of the log's rows were lost while the "
             "unit was turned; ",
             100.0 * lost.share) +
         ChanceOf(lost.log_p);
}

std::string WordsOf(const OverallMisfit& misfit) {
  if (misfit.has_more_faults) {
    return "more faults are significant than were corrected, so these may be the wrong ones; σ "
           "treat remaining residuals, if systematic, as errors that many poses have in common";
  }
  if (!misfit.is_unexplained) return "";
  return Format(
             "readings scatter from pose to pose by %.1f times their noise at rest, and no tested "
             "fault explains it; σ treat this scatter ",
             misfit.excess_ratio) +
         (misfit.is_systematic ? "as an error of all poses in common, since it is systematic"
                               : "as noise");
}

}  // namespace truetriad
