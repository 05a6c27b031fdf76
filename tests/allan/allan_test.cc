// SPDX-License-Identifier: Apache-2.0
#include "truetriad/allan/allan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "allan/allan_curve.h"
#include "allan/allan_fit.h"
#include "allan/allan_theory.h"
#include "data/memory_source.h"
#include "math/random.h"

namespace truetriad {
namespace allan_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kSpacingNs = 10'000'000;  // 100 Hz

/// White noise of sigma one on a large offset.
MemoryStream WhiteStream(int samples, std::uint64_t seed, double offset = 30000.0) {
  Random random(seed);
  MemoryStream stream(Triad::kGyroscope);
  for (int i = 0; i < samples; ++i) {
    stream.Add(i * kSpacingNs, Eigen::Vector3d::Constant(offset) + random.Normal3());
  }
  return stream;
}

Result<AllanResult> Analyse(const MemoryStream& stream, const AllanOptions& options = {}) {
  MemorySource source({stream});
  return AnalyseAllan(source, options);
}

std::string Warnings(const Result<AllanResult>& result) {
  std::string text;
  for (const std::string& warning : result->triads[0].warnings) text += warning + "\n";
  return text;
}

/// The definition, term by term, with full overlap.
double BruteForceVariance(const std::vector<double>& readings, std::size_t m) {
  std::vector<long double> sums = {0.0L};
  for (const double reading : readings) sums.push_back(sums.back() + reading);
  long double sum = 0.0L;
  const std::size_t terms = sums.size() - 2 * m;
  for (std::size_t i = 0; i < terms; ++i) {
    const long double d = sums[i + 2 * m] - 2.0L * sums[i + m] + sums[i];
    sum += d * d;
  }
  return static_cast<double>(sum / static_cast<long double>(terms) / (2.0L * m * m));
}

TEST(AllanCurve, EqualsTheDefinitionTermByTermUpToItsStrides) {
  Random random(3);
  std::vector<double> readings;
  double bias = 30000.0;
  for (int i = 0; i < 40000; ++i) {
    readings.push_back(bias + random.Normal());
    bias += 0.01 * random.Normal();
  }
  AllanCurve curve(10);
  // In uneven pieces, as a reader hands them over.
  for (std::size_t begin = 0, size = 1; begin < readings.size();
       begin += size, size = size * 3 + 1) {
    size = std::min(size, readings.size() - begin);
    curve.Add({readings.data() + begin, size});
  }
  curve.EndStretch();
  const std::vector<AllanFactor> factors = curve.factors();
  const Eigen::VectorXd variances = curve.variances();
  ASSERT_GT(factors.size(), 30U);
  EXPECT_EQ(factors.front().m, 1);
  EXPECT_LE(4 * factors.back().m, 40000);
  EXPECT_GT(5 * factors.back().m, 40000 / 1.3);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const double expected = BruteForceVariance(readings, static_cast<std::size_t>(factors[i].m));
    // Without strides the terms are the same: rounding alone, of sums of 4e4 readings, remains.
    // With strides of m/64 the means of squares differ by what neighbouring terms do: the
    // correlation over one stride is 1 - (3/2)/64, so a tenth of a percent of the terms' scatter.
    const double tolerance = factors[i].stride == 1 ? 1e-9 : 5e-3;
    EXPECT_NEAR(variances[static_cast<Eigen::Index>(i)] / expected, 1.0, tolerance)
        << "m = " << factors[i].m;
    if (factors[i].stride == 1) {
      EXPECT_EQ(factors[i].terms, 40001 - 2 * factors[i].m);
    }
  }
}

TEST(AllanCurve, KeepsWholeCountsExactOverAnyOffset) {
  Random random(4);
  std::vector<double> small, large;
  for (int i = 0; i < 5000; ++i) {
    small.push_back(std::round(10.0 * random.Normal()));
    large.push_back(small.back() + 1e9);
  }
  AllanCurve a(10), b(10);
  a.Add(small), a.EndStretch();
  b.Add(large), b.EndStretch();
  EXPECT_EQ(a.variances(), b.variances());
}

TEST(AllanCurve, DifferencesNothingAcrossTheEndOfAStretch) {
  Random random(5);
  std::vector<double> first, second;
  for (int i = 0; i < 3000; ++i) first.push_back(random.Normal());
  for (int i = 0; i < 2000; ++i) second.push_back(1000.0 + random.Normal());
  AllanCurve both(10);
  both.Add(first), both.EndStretch();
  both.Add(second), both.EndStretch();
  const std::vector<AllanFactor> factors = both.factors();
  for (std::size_t i = 0; i < factors.size() && factors[i].stride == 1; ++i) {
    const auto m = static_cast<std::size_t>(factors[i].m);
    const double terms_a = 3001.0 - 2.0 * static_cast<double>(m);
    const double terms_b = 2001.0 - 2.0 * static_cast<double>(m);
    const double expected =
        (terms_a * BruteForceVariance(first, m) + terms_b * BruteForceVariance(second, m)) /
        (terms_a + terms_b);
    EXPECT_NEAR(both.variances()[static_cast<Eigen::Index>(i)] / expected, 1.0, 1e-9);
    EXPECT_EQ(factors[i].stretches, 2);
  }
}

TEST(AllanTheory, GivesTheDegreesOfFreedomOfTheTextbook) {
  // NIST SP 1065, table 5 of 5.4.3 and its sources: white noise of a rate (white FM) with full
  // overlap has edf = (3 (N - 1) / (2 m) - 2 (N - 2) / N) * 4 m^2 / (4 m^2 + 5), N phase points.
  for (const std::int64_t m : {1, 2, 4, 8, 32}) {
    const std::int64_t phases = 10001;
    const std::vector<AllanFactor> factors = {
        {.m = m, .stride = 1, .terms = phases - 2 * m, .stretches = 1}};
    const NoiseStrengths white(0.0, 1.0, 0.0, 0.0, 0.0);
    const double expected = UnitAllanVariance(static_cast<double>(m)).dot(white);
    const double freedoms = 2.0 * expected * expected / AllanCovariance(factors).Variance(0, white);
    const double N = static_cast<double>(phases), M = static_cast<double>(m);
    const double textbook =
        (3.0 * (N - 1.0) / (2.0 * M) - 2.0 * (N - 2.0) / N) * 4.0 * M * M / (4.0 * M * M + 5.0);
    EXPECT_NEAR(freedoms / textbook, 1.0, 0.02) << "m = " << m;
  }
}

TEST(AllanTheory, PredictsTheScatterOfEstimatesAndTheirCorrelation) {
  // White noise and a walk, seen 2000 times. A variance from n samples has a relative sigma of
  // sqrt(2/n) for normal numbers, so 3.2 %, and somewhat more for the skewed ones of large m.
  constexpr int kRuns = 2000;
  constexpr int kSamples = 600;
  Random random(6);
  std::vector<AllanFactor> factors;
  Eigen::MatrixXd estimates;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<double> readings;
    double bias = 0.0;
    for (int i = 0; i < kSamples; ++i) {
      readings.push_back(bias + random.Normal());
      bias += 0.05 * random.Normal();
    }
    AllanCurve curve(5);
    curve.Add(readings);
    curve.EndStretch();
    if (run == 0) {
      factors = curve.factors();
      estimates.resize(kRuns, static_cast<Eigen::Index>(factors.size()));
    }
    estimates.row(run) = curve.variances().transpose();
  }
  const NoiseStrengths noises(0.0, 1.0, 0.0, 0.05 * 0.05, 0.0);
  const Eigen::MatrixXd predicted =
      AllanCovariance(factors).Matrix(0, static_cast<Eigen::Index>(factors.size()), noises);
  const Eigen::MatrixXd centred = estimates.rowwise() - estimates.colwise().mean();
  const Eigen::MatrixXd seen = centred.transpose() * centred / (kRuns - 1.0);
  for (Eigen::Index i = 0; i < predicted.rows(); ++i) {
    const double expected =
        UnitAllanVariance(static_cast<double>(factors[static_cast<std::size_t>(i)].m)).dot(noises);
    EXPECT_NEAR(estimates.col(i).mean() / expected,
                1.0,
                5.0 * std::sqrt(predicted(i, i) / kRuns) / expected);
    EXPECT_NEAR(seen(i, i) / predicted(i, i), 1.0, 0.2);
    for (Eigen::Index j = 0; j < i; ++j) {
      const double scale = std::sqrt(predicted(i, i) * predicted(j, j));
      EXPECT_NEAR(seen(i, j) / scale, predicted(i, j) / scale, 0.1) << i << ", " << j;
    }
  }
}

TEST(AnalyseAllan, FindsWhiteNoiseAloneInWhiteNoise) {
  const auto result = Analyse(WhiteStream(50000, 7));
  ASSERT_TRUE(result) << result.error().message;
  const AllanTriad& triad = result->triads[0];
  EXPECT_DOUBLE_EQ(triad.rate_hz, 100.0);
  EXPECT_THAT(triad.warnings, IsEmpty());
  for (const AllanAxis& axis : triad.axes) {
    ASSERT_TRUE(axis.white_density);
    // Sigma 1 a sample at 100 Hz: 0.1 a root hertz; its estimate is good to 1 / sqrt(50000).
    EXPECT_NEAR(axis.white_density->value, 0.1, 0.1 * 5.0 / std::sqrt(50000.0));
    EXPECT_LT(axis.white_density->low, axis.white_density->value);
    EXPECT_FALSE(axis.random_walk);
    EXPECT_FALSE(axis.quantisation);
    ASSERT_TRUE(axis.instability);
    EXPECT_TRUE(axis.instability->at_end);
    EXPECT_NEAR(
        axis.instability->coefficient.value,
        axis.instability->minimum.value / std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi),
        1e-12);
  }
}

TEST(AnalyseAllan, FindsQuantisationOfAnglesThatWereDifferentiated) {
  // Angles rounded to a step q are off by up to q / 2 either way, sigma q / sqrt(12) = Q; the
  // readings are their differences over a sample.
  constexpr double kStep = 0.01;
  Random random(8);
  MemoryStream stream(Triad::kGyroscope);
  const auto rounding = [&]() -> Eigen::Vector3d {
    return kStep * Eigen::Vector3d(random.Uniform(), random.Uniform(), random.Uniform());
  };
  Eigen::Vector3d last = rounding();
  for (int i = 0; i < 50000; ++i) {
    const Eigen::Vector3d now = rounding();
    stream.Add(i * kSpacingNs, 100.0 * (now - last));
    last = now;
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  for (const AllanAxis& axis : result->triads[0].axes) {
    ASSERT_TRUE(axis.quantisation);
    // A variance of 50000 numbers is good to 0.6 %, its root to half of that.
    EXPECT_NEAR(axis.quantisation->value * std::sqrt(12.0) / kStep, 1.0, 0.02);
  }
}

TEST(AnalyseAllan, FillsShortGapsAndSaysHowMany) {
  const MemoryStream whole = WhiteStream(20000, 9);
  MemoryStream gappy(Triad::kGyroscope);
  for (std::size_t i = 0; i < whole.x.size(); ++i) {
    if (i % 1000 == 500 || i % 1000 == 501) continue;
    gappy.Add(whole.time_ns[i], {whole.x[i], whole.y[i], whole.z[i]});
  }
  const auto a = Analyse(whole);
  const auto b = Analyse(gappy);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(b->triads[0].filled_samples, 40);
  EXPECT_EQ(b->triads[0].breaks, 0);
  EXPECT_EQ(b->triads[0].samples, 19960);
  EXPECT_DOUBLE_EQ(b->triads[0].rate_hz, 100.0);
  const auto& points_a = a->triads[0].axes[0].points;
  const auto& points_b = b->triads[0].axes[0].points;
  ASSERT_EQ(points_a.size(), points_b.size());
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    // One sample in 500 is replaced.
    EXPECT_NEAR(points_b[i].deviation.value / points_a[i].deviation.value, 1.0, 0.02);
  }
}

TEST(AnalyseAllan, DifferencesNothingAcrossLongGaps) {
  MemoryStream stream = WhiteStream(20000, 10);
  for (std::size_t i = 8000; i < stream.x.size(); ++i) {
    stream.time_ns[i] += 3'600'000'000'000;
    // A turn-on bias, of which an Allan deviation must not hear.
    stream.x[i] += 50.0;
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  const AllanTriad& triad = result->triads[0];
  EXPECT_EQ(triad.breaks, 1);
  EXPECT_DOUBLE_EQ(triad.rate_hz, 100.0);
  EXPECT_THAT(Warnings(result), HasSubstr("longest 3600.01 s"));
  EXPECT_LE(triad.axes[0].points.back().tau_s, 12000.0 / 4.0 / 100.0);
  EXPECT_NEAR(triad.axes[0].white_density->value, 0.1, 0.1 * 5.0 / std::sqrt(20000.0));
  EXPECT_FALSE(triad.axes[0].random_walk);
}

TEST(AnalyseAllan, PassesOverJitterOfTheTimeStamps) {
  MemoryStream stream = WhiteStream(20000, 11);
  Random random(12);
  // Late by up to 70 %: a spacing of 1.7 with one of 0.3 after it is no gap.
  for (std::int64_t& time_ns : stream.time_ns) {
    if (random.Uniform() < 0.02) time_ns += std::llround(random.Uniform(0.0, 0.7e7));
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  // Where two late stamps meet, or a block ends in between, one may still be taken for a gap.
  EXPECT_LE(result->triads[0].filled_samples, 3);
  EXPECT_EQ(result->triads[0].breaks, 0);
  EXPECT_NEAR(result->triads[0].rate_hz, 100.0, 0.02);
}

TEST(AnalyseAllan, TakesStampsInWholeMillisecondsAtTheirMeanRate) {
  MemoryStream stream = WhiteStream(20000, 13);
  for (std::size_t i = 0; i < stream.time_ns.size(); ++i) {
    stream.time_ns[i] = static_cast<std::int64_t>(2.5 * static_cast<double>(i)) * 1'000'000;
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->triads[0].rate_hz, 400.0, 0.02);
  EXPECT_EQ(result->triads[0].filled_samples, 0);
  EXPECT_THAT(result->triads[0].warnings, IsEmpty());
}

TEST(AnalyseAllan, SaysWhenTheTimeStampsAreIrregular) {
  MemoryStream stream = WhiteStream(20000, 14);
  Random random(15);
  std::int64_t time_ns = 0;
  for (std::int64_t& stamp : stream.time_ns) {
    stamp = time_ns;
    time_ns += std::llround(random.Uniform(0.1e7, 2.5e7));
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(Warnings(result), HasSubstr("irregular"));
}

TEST(AnalyseAllan, StatesNoCoefficientsOfAUnitThatMoved) {
  MemoryStream turned = WhiteStream(20000, 16);
  for (std::size_t i = 12000; i < 12300; ++i) turned.y[i] += 40.0;
  const auto result = Analyse(turned);
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->at_rest());
  const AllanTriad& triad = result->triads[0];
  EXPECT_THAT(triad.disturbance, HasSubstr("the unit moved"));
  EXPECT_THAT(triad.disturbance, HasSubstr("(axes y)"));
  EXPECT_THAT(triad.disturbance, HasSubstr("the worst at 12"));
  for (const AllanAxis& axis : triad.axes) {
    EXPECT_FALSE(axis.points.empty());
    EXPECT_FALSE(axis.white_density || axis.white_range_s || axis.instability || axis.random_walk ||
                 axis.quantisation);
  }
  // Nor doubts about them.
  EXPECT_THAT(triad.warnings, IsEmpty());
}

TEST(AnalyseAllan, TellsAUnitThatSwaysFromABiasThatWalks) {
  MemoryStream swaying = WhiteStream(20000, 17);
  for (std::size_t i = 0; i < swaying.x.size(); ++i) {
    swaying.x[i] += 30.0 * std::sin(0.002 * static_cast<double>(i));
  }
  const auto sway = Analyse(swaying);
  ASSERT_TRUE(sway);
  EXPECT_THAT(sway->triads[0].disturbance, HasSubstr("rises far above"));
  EXPECT_FALSE(sway->triads[0].axes[0].white_density);

  MemoryStream walking = WhiteStream(20000, 17);
  Random random(18);
  double bias = 0.0;
  for (double& reading : walking.x) reading = bias += random.Normal();
  const auto walk = Analyse(walking);
  ASSERT_TRUE(walk);
  EXPECT_TRUE(walk->at_rest()) << walk->triads[0].disturbance;
  EXPECT_TRUE(walk->triads[0].axes[0].random_walk);
  EXPECT_THAT(Warnings(walk), HasSubstr("rises far above"));
}

TEST(AnalyseAllan, WarnsOfTemperatureThatDrifts) {
  MemoryStream stream = WhiteStream(20000, 18);
  for (std::size_t i = 0; i < stream.x.size(); ++i) {
    stream.temperature_degc.push_back(25.0 + 0.0005 * static_cast<double>(i));
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result);
  EXPECT_THAT(Warnings(result), HasSubstr("temperature went from 25 to 35 degC"));
}

TEST(AnalyseAllan, WarnsOfADeadAClippedAndACoarseAxis) {
  MemoryStream stream = WhiteStream(20000, 19, 0.0);
  for (std::size_t i = 0; i < stream.x.size(); ++i) {
    stream.x[i] = 5.0;
    stream.y[i] = std::min(stream.y[i], 1.5);
    stream.z[i] = 10.0 * std::round(0.2 * stream.z[i]);
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(Warnings(result), HasSubstr("the x axis reads 5 counts throughout"));
  EXPECT_THAT(Warnings(result), HasSubstr("y axis: 1"));
  EXPECT_THAT(Warnings(result), HasSubstr("check for clipping"));
  EXPECT_THAT(Warnings(result), HasSubstr("below the resolution of 10 counts"));
  EXPECT_THAT(result->triads[0].axes[0].points, IsEmpty());
  EXPECT_FALSE(result->triads[0].axes[0].white_density);
}

TEST(AnalyseAllan, RefusesAStuckSensor) {
  MemoryStream stream(Triad::kAccelerometer);
  for (int i = 0; i < 1000; ++i) stream.Add(i * kSpacingNs, {1.0, 2.0, 3.0});
  const auto result = Analyse(stream);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(result.error().message, HasSubstr("stuck"));
}

TEST(AnalyseAllan, RefusesALogThatIsTooShort) {
  const auto result = Analyse(WhiteStream(99, 20));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kNotEnough);
  EXPECT_TRUE(Analyse(WhiteStream(100, 20)));
}

TEST(AnalyseAllan, RefusesReadingsWhoseSquaresOverflow) {
  MemoryStream stream = WhiteStream(1000, 21);
  stream.x[500] = 1e200;
  const auto result = Analyse(stream);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
}

TEST(AnalyseAllan, NeedsARateExactlyWhenThereIsNoTime) {
  const MemoryStream timed = WhiteStream(1000, 22);
  const auto both = Analyse(timed, {.rate_hz = 100.0, .white_range_s = {}});
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().kind(), ErrorKind::kUsage);

  MemoryStream rows = timed;
  rows.time_ns = rows.row;
  MemorySource without({rows});
  without.mutable_info().has_time = false;
  const auto missing = AnalyseAllan(without);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind(), ErrorKind::kUsage);
  EXPECT_THAT(missing.error().message, HasSubstr("--rate_hz"));

  MemorySource stated({rows});
  stated.mutable_info().has_time = false;
  const auto result = AnalyseAllan(stated, {.rate_hz = 50.0, .white_range_s = {}});
  ASSERT_TRUE(result);
  EXPECT_DOUBLE_EQ(result->triads[0].rate_hz, 50.0);
  EXPECT_DOUBLE_EQ(result->triads[0].duration_s, 20.0);
  EXPECT_DOUBLE_EQ(result->triads[0].axes[0].points[0].tau_s, 0.02);
}

TEST(AnalyseAllan, FitsWhiteNoiseOverTheRangeGiven) {
  MemoryStream stream = WhiteStream(100000, 23);
  // A filter takes noise from the shortest tau.
  for (std::size_t i = stream.x.size() - 1; i > 0; --i) {
    stream.x[i] = 0.5 * (stream.x[i] + stream.x[i - 1]);
  }
  const auto result = Analyse(stream, {.white_range_s = {{0.3, 3.0}}});
  ASSERT_TRUE(result) << result.error().message;
  const AllanAxis& x = result->triads[0].axes[0];
  EXPECT_EQ(x.white_range_s->front(), 0.3);
  EXPECT_LT(x.white_density->low, 0.1);
  EXPECT_GT(x.white_density->high, 0.1);
  // Found by itself, the range leaves the filtered points out as far as the fit tolerates them: by
  // 3 % of the deviation.
  const auto automatic = Analyse(stream);
  ASSERT_TRUE(automatic);
  const AllanAxis& found = automatic->triads[0].axes[0];
  EXPECT_GT(found.white_range_s->front(), 0.025);
  EXPECT_NEAR(found.white_density->value, 0.1, 0.005);

  const auto outside = Analyse(stream, {.white_range_s = {{1e6, 2e6}}});
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().kind(), ErrorKind::kUsage);
  const auto reversed = Analyse(stream, {.white_range_s = {{3.0, 0.3}}});
  ASSERT_FALSE(reversed);
  EXPECT_EQ(reversed.error().kind(), ErrorKind::kUsage);
}

/// How many of the three intervals of N hold `truth`.
int Holding(const AllanTriad& triad, double truth) {
  int holding = 0;
  for (const AllanAxis& axis : triad.axes) {
    const std::optional<Interval>& density = axis.white_density;
    holding += density && density->low <= truth && truth <= density->high ? 1 : 0;
  }
  return holding;
}

TEST(AnalyseAllan, NamesASteadyDriftWithItsSizeAndTakesNWithoutIt) {
  for (const double drift : {0.1, 0.02}) {  // Sigmas a second.
    MemoryStream stream = WhiteStream(20000, 24);
    for (std::size_t i = 0; i < stream.x.size(); ++i) {
      stream.x[i] += drift * 0.01 * static_cast<double>(i);
    }
    const auto result = Analyse(stream);
    ASSERT_TRUE(result) << result.error().message;
    const AllanTriad& triad = result->triads[0];
    EXPECT_TRUE(triad.at_rest()) << triad.disturbance;
    EXPECT_THAT(Warnings(result), HasSubstr("x axis: drifts steadily by about 0."));
    EXPECT_FALSE(triad.axes[0].random_walk);
    const Interval& density = *triad.axes[0].white_density;
    EXPECT_NEAR(density.value, 0.1, 0.1 * 0.03);
    // As narrow as 20 000 samples of white noise can make it, and no narrower: 1.96 / sqrt(2 n) is
    // 1 %.
    EXPECT_GT(density.high / density.low, 1.018);
    EXPECT_LT(density.high / density.low, 1.04);
    EXPECT_EQ(Warnings(result).find("y axis: drifts"), std::string::npos);

    const auto over_range = Analyse(stream, {.white_range_s = {{0.01, 0.1}}});
    ASSERT_TRUE(over_range);
    const Interval& in_range = *over_range->triads[0].axes[0].white_density;
    EXPECT_GT(in_range.high / in_range.low, 1.018);
    EXPECT_LT(in_range.high / in_range.low, 1.06);
  }
}

TEST(AnalyseAllan, TakesNBelowTheCornerOfAFilter) {
  for (const double corner_hz : {10.0, 2.0}) {
    MemoryStream stream = WhiteStream(100000, 25, 0.0);
    const double gain = 1.0 - std::exp(-2.0 * std::numbers::pi * corner_hz / 100.0);
    for (std::vector<double>* const axis : {&stream.x, &stream.y, &stream.z}) {
      double state = 0.0;
      for (double& reading : *axis) reading = state += gain * (reading - state);
    }
    const auto result = Analyse(stream);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_GE(Holding(result->triads[0], 0.1), 2) << corner_hz;
    for (const AllanAxis& axis : result->triads[0].axes) {
      // Beyond five time constants of 1 / (2 pi corner), near enough.
      EXPECT_GT(axis.white_range_s->front(), 0.5 / corner_hz);
    }
  }
}

TEST(AnalyseAllan, TellsReadingsThatAreHeld) {
  MemoryStream stream = WhiteStream(40000, 26);
  for (std::vector<double>* const axis : {&stream.x, &stream.y, &stream.z}) {
    for (std::size_t i = 0; i < axis->size(); ++i) (*axis)[i] = (*axis)[i / 4 * 4];
  }
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(Warnings(result),
              HasSubstr("held for 4 samples on average: the sensor updates at 25 Hz"));
  // Sigma one at 25 Hz.
  EXPECT_GE(Holding(result->triads[0], 0.2), 2);
}

TEST(AnalyseAllan, TellsReadingsThatFroze) {
  MemoryStream stream = WhiteStream(20000, 27);
  for (std::size_t i = 8000; i < 14000; ++i) stream.y[i] = stream.y[7999];
  const auto result = Analyse(stream);
  ASSERT_TRUE(result) << result.error().message;
  // 6000 samples are 60 windows of a second.
  EXPECT_THAT(Warnings(result),
              HasSubstr("y axis: 60 of 200 windows are constant, the first at 81 s"));
  EXPECT_EQ(Warnings(result).find("x axis:"), std::string::npos);
  EXPECT_EQ(Warnings(result).find("held"), std::string::npos);
}

TEST(AnalyseAllan, DoesNotTakeTheFurthestOfFewReadingsForALimit) {
  EXPECT_THAT(Analyse(WhiteStream(150, 28))->triads[0].warnings, IsEmpty());
}

}  // namespace allan_test
}  // namespace truetriad
