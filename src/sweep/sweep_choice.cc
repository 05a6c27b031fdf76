// SPDX-License-Identifier: Apache-2.0
#include "sweep/sweep_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/messages.h"

namespace truetriad {
namespace {

// The other terms must leave at least this share of a term's RMS unexplained. At 1/4 they make the
// σ of the term 4 times as large.
constexpr double kFewestOfItsOwn = 0.25;
// Significance level at which a term enters: a nonexistent term enters by chance once in a hundred.
constexpr double kEnterLevel = 0.01;
// The significance level at which a term leaves. It is above the level of entry, so that a term
// that has just entered does not leave at once.
constexpr double kLeaveLevel = 0.05;
// The significance level at which a stated order counts as too low, divided among all orders tried.
// Chance causes this once in 10,000 axes.
constexpr double kHigherLevel = 1e-4;
// Chosen: to be kept, a lag, a knot or the highest power has to lower the held-out error by 5 %.
constexpr double kFewerLags = 0.95;
// Chosen: a lag longer than this share of the recording counts as drift.
constexpr double kLongestLagShare = 0.25;
// Chosen: the ratio of neighbouring lags in the grid; 23 span a factor of 1000. RefineOne searches
// between them.
constexpr double kLagRatio = 1.35;
// Chosen: if there are two lags, that of the element is searched up to this share of the recording.
constexpr double kElementShare = 1.0 / 16.0;
// Order of the plain cubic with which the chosen terms are compared.
constexpr int kPlainOrder = 3;

// Which of the two lags the model has.
struct LagShape {
  bool element = false, rate = false;
  int count() const { return (element ? 1 : 0) + (rate ? 1 : 0); }
};

ThermalOptions Plain(int order) {
  ThermalOptions terms;
  terms.bias_order = order;
  return terms;
}

class Chooser {
 public:
  Chooser(SweepProblem* problem, int axis, const ThermalOptions& wanted)
      : problem_(*problem), axis_(axis), wanted_(wanted), allowed_(wanted) {
    allowed_.lags = 0;
    allowed_.bias_order_auto = allowed_.rate_auto = allowed_.lags_auto = false;
    shortest_s_ = std::max(2.0 * problem_.spacing_s(), 1.0);
    longest_s_ = kLongestLagShare * problem_.duration_s();
  }

  SweepChoice Choose() {
    problem_.SetKnots(wanted_.knots_degc);
    GateRates();
    if (wanted_.find_knots > 0) FindKnots();
    std::optional<Candidate> best;
    for (const LagShape& shape : Shapes()) {
      std::optional<Candidate> candidate = Try(shape);
      if (!candidate) continue;
      const bool same_count = best && best->shape.count() == shape.count();
      const double needed = same_count ? 1.0 : kFewerLags;
      if (!best || candidate->held_out < needed * best->held_out) best = std::move(candidate);
    }
    if (!best) best = Try({});  // Every wanted lag was refused.
    choice_.held_out = best->held_out;
    choice_.held_out_cubic = HeldOutRms(&problem_, axis_, Plain(kPlainOrder), {});
    choice_.fit = FinalFit(*best);
    if (wanted_.bias_order_auto) {
      LowerOrder(&*best);
    } else {
      FindHigher(*best);
    }
    choice_.steps = std::move(best->steps);
    return std::move(choice_);
  }

 private:
  struct Candidate {
    LagShape shape;
    SweepLags lags;
    ThermalOptions terms;
    double held_out = 0.0;
    std::vector<SweepStep> steps;
  };

  // Leaves out the rate terms that cannot be distinguished from the other terms in this recording.
  void GateRates() {
    const Eigen::MatrixX2d states = problem_.States({});
    has_branches_ = problem_.ShareOfItsOwn(states, RateTerm::kLinear, {}) >= kFewestOfItsOwn;
    std::vector<RateTerm> beside;
    for (const RateTerm rate : {RateTerm::kLinear, RateTerm::kCross, RateTerm::kQuadratic}) {
      bool& is_allowed = allowed_.rate[rate];
      if (!is_allowed) continue;
      const double share = problem_.ShareOfItsOwn(states, rate, beside);
      if (share >= kFewestOfItsOwn) {
        beside.push_back(rate);
        continue;
      }
      is_allowed = false;
      choice_.left_out.push_back(
          std::string(InfoOf(rate).letters) +
          Format(": only %.0f %% of it is independent of temperature and the other rate terms; ",
                 100.0 * share) +
          (rate == RateTerm::kQuadratic ? "repeat the sweep at another rate"
                                        : "repeat the sweep up and down, at more than one rate"));
    }
  }

  // Adds knots where the sum of squares is least, one by one while the held-out error falls.
  void FindKnots() {
    ThermalOptions terms = allowed_;
    terms.bias_order = wanted_.bias_order_auto ? kPlainOrder : wanted_.bias_order;
    const ThermalScale& scale = problem_.scale();
    for (int count = 0; count < wanted_.find_knots; ++count) {
      const std::vector<double> known = problem_.knots_degc();
      terms.knots_degc = known;
      const double before = HeldOutRms(&problem_, axis_, terms, {});
      const auto square_at = [&](double v) {
        std::vector<double> knots = known;
        knots.push_back(scale.centre_degc + v * scale.half_range_degc);
        problem_.SetKnots(knots);
        terms.knots_degc = knots;
        return WeightedSquareAt(problem_, axis_, terms, {});
      };
      // Steps of 1.5 % of the range of temperatures.
      constexpr int kPlaces = 60;
      constexpr double kInner = 0.92;  // of half the range, to leave data beyond the knots
      double best = 0.0, least = std::numeric_limits<double>::infinity();
      const double step = 2.0 * kInner / kPlaces;
      for (int place = 0; place <= kPlaces; ++place) {
        const double square = square_at(-kInner + place * step);
        if (square >= least) continue;
        least = square;
        best = -kInner + place * step;
      }
      for (double width = 0.5 * step; width > 1e-4; width *= 0.5) {
        for (const double v : {best - width, best + width}) {
          const double square = square_at(v);
          if (square >= least) continue;
          least = square;
          best = v;
        }
      }
      square_at(best);
      if (HeldOutRms(&problem_, axis_, terms, {}) < kFewerLags * before) continue;
      choice_.left_out.push_back(
          Format("knot: the best one, at %.1f degC, does not lower the held-out error",
                 scale.centre_degc + best * scale.half_range_degc) +
          Format(" by %.0f %%", 100.0 * (1.0 - kFewerLags)));
      problem_.SetKnots(known);
      break;
    }
    allowed_.knots_degc = problem_.knots_degc();
    allowed_.find_knots = 0;
  }

  std::vector<LagShape> Shapes() {
    const bool has_rates = allowed_.rate.any();
    const bool any = wanted_.lags > 0 || wanted_.lags_auto;
    if (any && !has_branches_) {
      choice_.left_out.emplace_back(
          "lag: only heating and cooling together determine it; repeat the sweep up and "
          "down");
      return {LagShape()};
    }
    std::vector<LagShape> shapes;
    if (wanted_.lags == 0) shapes.push_back({false, false});
    if (wanted_.lags == 1 || wanted_.lags_auto) {
      shapes.push_back({true, false});
      if (has_rates) shapes.push_back({false, true});
    }
    if ((wanted_.lags == 2 || wanted_.lags_auto) && has_rates) shapes.push_back({true, true});
    if (wanted_.lags == 2 && !has_rates) shapes.push_back({true, false});
    return shapes;
  }

  std::vector<double> Grid(double longest) const {
    std::vector<double> grid;
    for (double lag = shortest_s_; lag < longest; lag *= kLagRatio) grid.push_back(lag);
    return grid;
  }

  // The lags to try, up to the recording's duration: too long a lag indicates a drift.
  std::vector<SweepLags> LagsOf(const LagShape& shape) const {
    std::vector<SweepLags> all;
    const std::vector<double> none = {0.0};
    const double longest = problem_.duration_s();
    for (const double element :
         shape.element ? Grid(shape.rate ? kElementShare * longest : longest) : none) {
      for (const double rate : shape.rate ? Grid(longest) : none) all.push_back({element, rate});
    }
    return all;
  }

  // The lags in `all` with the smallest sum of squares over all folds except `but` (-1: over all).
  SweepLags BestOf(const std::vector<SweepLags>& all, const ThermalOptions& terms, int but) {
    const std::vector<int> columns = ColumnsOf(problem_, terms);
    SweepLags best;
    double least = std::numeric_limits<double>::infinity();
    for (const SweepLags& lags : all) {
      const double square = WeightedSquare(problem_.Blocks(lags), columns, axis_, but);
      if (square >= least) continue;
      least = square;
      best = lags;
    }
    return best;
  }

  // Refines one lag by golden section over its logarithm, within one grid step on either side.
  void RefineOne(const ThermalOptions& terms, double SweepLags::*which, SweepLags* lags) const {
    if (!(lags->*which > 0.0)) return;
    // (sqrt(5) - 1) / 2.
    constexpr double kGolden = 0.6180339887498949;
    constexpr int kSteps = 14;  // shorten the interval to a thousandth
    double low = std::log(lags->*which / kLagRatio), high = std::log(lags->*which * kLagRatio);
    const auto value = [&](double log_lag) {
      SweepLags tried = *lags;
      tried.*which = std::exp(log_lag);
      return WeightedSquareAt(problem_, axis_, terms, tried);
    };
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double value_a = value(a), value_b = value(b);
    for (int step = 0; step < kSteps; ++step) {
      if (value_a < value_b) {
        high = b, b = a, value_b = value_a;
        a = high - kGolden * (high - low), value_a = value(a);
      } else {
        low = a, a = b, value_a = value_b;
        b = low + kGolden * (high - low), value_b = value(b);
      }
    }
    lags->*which = std::exp(0.5 * (low + high));
  }

  std::optional<Candidate> Try(const LagShape& shape) {
    Candidate candidate{shape, {}, allowed_, 0.0, {}};
    const std::vector<SweepLags> all = LagsOf(shape);
    candidate.lags = BestOf(all, allowed_, -1);
    if (wanted_.bias_order_auto) ChooseOrder(&candidate);
    if (wanted_.rate_auto) ChooseRates(&candidate);
    candidate.lags = BestOf(all, candidate.terms, -1);
    const double longest = std::max(candidate.lags.element_s, candidate.lags.rate_s);
    if (longest > longest_s_) {
      choice_.left_out.push_back(
          std::string(shape.element && shape.rate ? "two lags"
                      : shape.element             ? "lag of the element"
                                                  : "lag of the rate") +
          Format(": the best fit needs %.0f s, ", longest) +
          Format("more than a quarter of the recording (%.0f s): this is drift, not a lag",
                 longest_s_));
      return std::nullopt;
    }
    for (int round = 0; round < (shape.count() > 1 ? 2 : 1); ++round) {
      RefineOne(candidate.terms, &SweepLags::element_s, &candidate.lags);
      RefineOne(candidate.terms, &SweepLags::rate_s, &candidate.lags);
    }
    // The lags that are chosen again for each fold must not be so long that they are drift, either.
    std::vector<SweepLags> usable = all;
    std::erase_if(usable, [this](const SweepLags& lags) {
      return std::max(lags.element_s, lags.rate_s) > longest_s_;
    });
    const std::vector<int> columns = ColumnsOf(problem_, candidate.terms);
    double sum = 0.0;
    for (int fold = 0; fold < problem_.fold_count(); ++fold) {
      const SweepLags lags = BestOf(usable, candidate.terms, fold);
      sum += HeldOutSquare(problem_.Blocks(lags), columns, problem_.attitude_count(), axis_, fold);
    }
    candidate.held_out = std::sqrt(std::max(sum, 0.0) / problem_.size());
    return candidate;
  }

  // Tests the highest power again, beside the chosen rate terms and with the noise of the
  // thermometer; ChooseOrder tested it beside all allowed rate terms and without this noise.
  // Removes the power if it is not significant, unless it lowers the held-out error by 5 %.
  void LowerOrder(Candidate* chosen) {
    ThermalOptions& terms = chosen->terms;
    while (terms.bias_order > 1) {
      const int power = terms.bias_order;
      if (WaldProbability(choice_.fit, {problem_.power_column(power)}) < kLeaveLevel) return;
      --terms.bias_order;
      const double held_out = HeldOut(terms, *chosen);
      if (kFewerLags * held_out > choice_.held_out) return;
      choice_.held_out = held_out;
      choice_.fit = FinalFit(*chosen);
      Note("- tau^" + std::to_string(power), terms, chosen);
    }
  }

  void FindHigher(Candidate chosen) {
    constexpr int kMost = ThermalOptions::kMaxBiasOrder;
    ThermalOptions& terms = chosen.terms;
    const double held_out = HeldOut(terms, chosen);
    const int tries = kMost - terms.bias_order;
    std::vector<int> added;
    while (terms.bias_order < kMost) {
      added.push_back(problem_.power_column(++terms.bias_order));
      if (HeldOut(terms, chosen) >= held_out) continue;
      SweepFit fit = FinalFit(chosen);
      if (WaldProbability(fit, added) > kHigherLevel / tries) continue;
      choice_.higher = std::move(fit);
      return;
    }
  }

  // Chooses the order beside all allowed rate terms: each, from 1 on, is tested against higher
  // ones.
  void ChooseOrder(Candidate* candidate) {
    constexpr int kMost = ThermalOptions::kMaxBiasOrder;
    int& order = candidate->terms.bias_order;
    order = 1;
    Note("start", candidate->terms, candidate);
    while (order < kMost) {
      const double held_out = HeldOut(candidate->terms, *candidate);
      ThermalOptions terms = candidate->terms;
      std::vector<int> added;
      bool is_better = false;
      while (!is_better && terms.bias_order < kMost) {
        added.push_back(problem_.power_column(++terms.bias_order));
        is_better = HeldOut(terms, *candidate) < held_out &&
                    WaldProbability(Fit(terms, *candidate), added) < kEnterLevel / (kMost - 1);
      }
      if (!is_better) {
        terms.bias_order = order + 1;
        NoteRejected("tau^" + std::to_string(order + 1), terms, added.front(), candidate);
        return;
      }
      candidate->terms = terms;
      Note("+ up to tau^" + std::to_string(order), terms, candidate);
    }
  }

  void ChooseRates(Candidate* candidate) {
    ThermalOptions& terms = candidate->terms;
    terms.rate = {};
    Note("rates: none", terms, candidate);
    const auto column = [this](RateTerm rate) {
      return std::vector<int>{problem_.rate_column(rate)};
    };
    for (int round = 0; round < 6; ++round) {
      // Terms are also tried in groups: two rate terms may have an effect only together.
      std::optional<ThermalOptions> best;
      double least = HeldOut(terms, *candidate);
      std::string what;
      for (unsigned set = 1; set < 1U << kRateTermCount; ++set) {
        ThermalOptions with = terms;
        std::vector<int> added;
        std::string names;
        for (const RateTermInfo& rate : kRateTerms) {
          if ((set >> static_cast<unsigned>(rate.term) & 1U) == 0) continue;
          if (terms.rate[rate.term] || !allowed_.rate[rate.term]) {
            added.clear();
            break;
          }
          with.rate[rate.term] = true;
          added.push_back(column(rate.term).front());
          names.append(names.empty() ? "" : ", ").append(rate.letters);
        }
        if (added.empty()) continue;
        const double error = HeldOut(with, *candidate);
        // Each term beyond the first has to lower the held-out error by another 2 %.
        const double needed = 1.0 - 0.02 * static_cast<double>(added.size() - 1);
        if (error >= needed * least) continue;
        if (WaldProbability(Fit(with, *candidate), added) > kEnterLevel) continue;
        least = error;
        best = with;
        what = names;
      }
      if (!best) break;
      terms = *best;
      Note("+ " + what, terms, candidate);
      for (const RateTermInfo& rate : kRateTerms) {
        if (!terms.rate[rate.term]) continue;
        if (WaldProbability(Fit(terms, *candidate), column(rate.term)) < kLeaveLevel) continue;
        ThermalOptions without = terms;
        without.rate[rate.term] = false;
        if (HeldOut(without, *candidate) > least) continue;
        terms = without;
        Note("- " + std::string(rate.letters), terms, candidate);
      }
    }
    for (const RateTermInfo& rate : kRateTerms) {
      if (terms.rate[rate.term] || !allowed_.rate[rate.term]) continue;
      ThermalOptions with = terms;
      with.rate[rate.term] = true;
      NoteRejected(std::string(rate.letters), with, column(rate.term).front(), candidate);
    }
  }

  SweepFit FinalFit(const Candidate& candidate) const {
    return FitSweep(problem_, axis_, candidate.terms, candidate.lags, /*with_thermometer=*/true);
  }

  SweepFit Fit(const ThermalOptions& terms, const Candidate& candidate) const {
    return FitSweep(problem_, axis_, terms, candidate.lags);
  }

  double HeldOut(const ThermalOptions& terms, const Candidate& candidate) {
    return HeldOutRms(&problem_, axis_, terms, candidate.lags);
  }

  // Notes a term that was tried beside the chosen ones and rejected, with its p-value.
  void NoteRejected(const std::string& name,
                    const ThermalOptions& with,
                    int column,
                    Candidate* candidate) {
    const double p = WaldProbability(Fit(with, *candidate), {column});
    // If a p-value is smaller, this bound is printed instead, as in the tables of a regression.
    constexpr double kLeastShown = 1e-6;
    const std::string shown = p < kLeastShown ? " (p < 1e-6)" : Format(" (p = %.2g)", p);
    Note("rejected: " + name + shown, with, candidate);
  }

  void Note(const std::string& what, const ThermalOptions& terms, Candidate* candidate) {
    const SweepFit fit = Fit(terms, *candidate);
    const double constants = Fit(Plain(0), *candidate).weighted_square;
    const auto n = static_cast<double>(problem_.size());
    const auto k = static_cast<double>(fit.columns.size());
    SweepStep step;
    step.what = what;
    step.terms = TermsText(terms);
    step.r2 = constants > 0.0 ? 1.0 - fit.weighted_square / constants : 0.0;
    step.adjusted_r2 = 1.0 - (1.0 - step.r2) * (n - problem_.attitude_count()) / (n - k);
    // Correlated windows count as fewer independent ones.
    const double effective = EffectiveCount(n, fit.correlation);
    step.bic = effective * std::log(fit.weighted_square / n) + k * std::log(effective);
    step.held_out = HeldOut(terms, *candidate);
    candidate->steps.push_back(step);
  }

  SweepProblem& problem_;
  int axis_;
  ThermalOptions wanted_, allowed_;
  double shortest_s_ = 0.0, longest_s_ = 0.0;
  bool has_branches_ = false;
  SweepChoice choice_;
};

}  // namespace

std::string TermsText(const ThermalOptions& terms) {
  std::string text;
  const auto add = [&text](const std::string& term) { text += (text.empty() ? "" : ", ") + term; };
  for (int power = 1; power <= terms.bias_order; ++power) {
    add(power == 1 ? "tau" : "tau^" + std::to_string(power));
  }
  for (const RateTermInfo& rate : kRateTerms) {
    if (terms.rate[rate.term]) add(std::string(rate.letters));
  }
  for (const double degc : terms.knots_degc) add(Format("knot at %.1f degC", degc));
  return text.empty() ? "none" : text;
}

SweepChoice ChooseSweep(SweepProblem* problem, int axis, const ThermalOptions& wanted) {
  return Chooser(problem, axis, wanted).Choose();
}

}  // namespace truetriad
