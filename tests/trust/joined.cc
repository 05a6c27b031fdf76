// SPDX-License-Identifier: Apache-2.0
#include "trust/joined.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace truetriad::trust {
namespace {

struct Span {
  double from_s = 0.0, to_s = 0.0;
};

// The recording as `count` pieces, cut at random.
std::vector<Span> PiecesOf(const Recording& recording, int count, Random* random) {
  std::vector<double> cuts = {0.0, recording.duration_s + 1.0};
  for (int i = 1; i < count; ++i) cuts.push_back(random->Uniform(0.0, recording.duration_s));
  std::sort(cuts.begin(), cuts.end());
  std::vector<Span> pieces;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) pieces.push_back({cuts[i], cuts[i + 1]});
  return pieces;
}

// Only these stretches, one after the other as if they were one recording.
void Join(const std::vector<Span>& pieces, Recording* recording) {
  for (const Triad triad : kTriads) {
    const std::vector<Sample> all = std::exchange(recording->samples[triad], {});
    double begin_s = 0.0;
    for (const Span& piece : pieces) {
      for (Sample sample : all) {
        if (sample.time_s() < piece.from_s || sample.time_s() >= piece.to_s) continue;
        sample.time_ns += std::llround(1e9 * (begin_s - piece.from_s));
        recording->samples[triad].push_back(sample);
      }
      begin_s += piece.to_s - piece.from_s;
    }
  }
}

int CountOf(const Strike& strike) { return static_cast<int>(std::lround(strike.severity)); }

}  // namespace

void PiecesExchanged(const Strike& strike, Recording* recording) {
  std::vector<Span> pieces = PiecesOf(*recording, CountOf(strike), strike.random);
  for (std::size_t i = pieces.size(); i > 1; --i) {
    std::swap(pieces[i - 1],
              pieces[static_cast<std::size_t>(strike.random->Below(static_cast<int>(i)))]);
  }
  Join(pieces, recording);
}

void PiecesCutOut(const Strike& strike, Recording* recording) {
  std::vector<Span> pieces = PiecesOf(*recording, CountOf(strike), strike.random);
  for (Span& piece : pieces) {
    piece.from_s = std::min(piece.from_s + strike.random->Uniform(0.3, 8.0), piece.to_s);
  }
  Join(pieces, recording);
}

void ClockSetBack(const Strike& strike, Recording* recording) {
  for (const Span& piece : PiecesOf(*recording, CountOf(strike), strike.random)) {
    if (piece.from_s > 0.0) recording->clock_restarts_s.push_back(piece.from_s);
  }
}

void RepeatedElsewhere(const Strike& strike, Recording* recording) {
  const double end_s = recording->duration_s;
  const double from_s = strike.random->Uniform(0.0, 0.4) * end_s;
  const double again_s = strike.random->Uniform(0.6, 1.0) * end_s;
  Join({{0.0, again_s}, {from_s, from_s + strike.severity}, {again_s, end_s + 1.0}}, recording);
}

void MovesCutOut(const Strike& strike, Recording* recording) {
  std::vector<Span> pieces = {{0.0, 0.0}};
  for (const TrueRest& rest : recording->rests) {
    if (strike.random->Uniform() < strike.severity) {
      pieces.push_back({rest.start_s, rest.end_s});
    } else {
      pieces.back().to_s = std::max(pieces.back().to_s, rest.start_s);
      pieces.push_back({pieces.back().to_s, rest.end_s});
    }
  }
  Join(pieces, recording);
}

}  // namespace truetriad::trust
