// SPDX-License-Identifier: Apache-2.0
#include "data/held_samples.h"

#include <algorithm>
#include <span>

namespace truetriad {
namespace {

template <typename T>
void AppendTo(std::vector<T>* values, std::span<const T> more) {
  values->insert(values->end(), more.begin(), more.end());
}

template <typename T>
std::span<const T> Part(const std::vector<T>& values, std::size_t begin, std::size_t end) {
  if (values.empty()) return {};
  return std::span(values).subspan(begin, end - begin);
}

}  // namespace

void HeldSamples::Append(const SampleBlock& block) {
  AppendTo(&time_ns, block.time_ns);
  AppendTo(&row, block.row);
  AppendTo(&x, block.x);
  AppendTo(&y, block.y);
  AppendTo(&z, block.z);
  AppendTo(&temperature_degc, block.temperature_degc);
  AppendTo(&ambient_degc, block.ambient_degc);
  AppendTo(&pose, block.pose);
}

void HeldSamples::Move(std::size_t from, std::size_t to) {
  if (from == to) return;
  EachColumn([=](auto* values) {
    if (!values->empty()) (*values)[to] = (*values)[from];
  });
}

void HeldSamples::Resize(std::size_t size) {
  EachColumn([=](auto* values) {
    if (values->size() > size) values->resize(size);
  });
}

void HeldSamples::EraseFront(std::size_t count) {
  if (count == 0) return;
  EachColumn([=](auto* values) {
    values->erase(values->begin(),
                  values->begin() + static_cast<std::ptrdiff_t>(std::min(count, values->size())));
  });
}

SampleBlock HeldSamples::View(Triad triad, std::size_t begin, std::size_t end) const {
  return {triad,
          Part(time_ns, begin, end),
          Part(x, begin, end),
          Part(y, begin, end),
          Part(z, begin, end),
          Part(temperature_degc, begin, end),
          Part(pose, begin, end),
          Part(row, begin, end),
          Part(ambient_degc, begin, end)};
}

}  // namespace truetriad
