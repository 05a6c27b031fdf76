// SPDX-License-Identifier: Apache-2.0
#include "data/held_samples.h"

#include <algorithm>

namespace truetriad {

SampleBlock PieceOf(const SampleBlock& block, std::size_t begin, std::size_t end) {
  const auto part = [&](const auto& span) {
    return span.empty() ? span : span.subspan(begin, end - begin);
  };
  return {block.triad,
          part(block.time_ns),
          part(block.x),
          part(block.y),
          part(block.z),
          part(block.temperature_degc),
          part(block.pose),
          part(block.row),
          part(block.ambient_degc)};
}

void HeldSamples::Append(const SampleBlock& block) {
  EachColumn([&block](auto* values, auto column) {
    values->insert(values->end(), (block.*column).begin(), (block.*column).end());
  });
}

void HeldSamples::Move(std::size_t from, std::size_t to) {
  if (from == to) return;
  EachColumn([=](auto* values, auto /*column*/) {
    if (!values->empty()) (*values)[to] = (*values)[from];
  });
}

void HeldSamples::Resize(std::size_t size) {
  EachColumn([=](auto* values, auto /*column*/) {
    if (values->size() > size) values->resize(size);
  });
}

void HeldSamples::EraseFront(std::size_t count) {
  if (count == 0) return;
  EachColumn([=](auto* values, auto /*column*/) {
    values->erase(values->begin(),
                  values->begin() + static_cast<std::ptrdiff_t>(std::min(count, values->size())));
  });
}

}  // namespace truetriad
