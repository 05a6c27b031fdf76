// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <optional>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Each value type has one list of its fields. All file formats of the type follow from the list:
//
//   template <class V>
//   void Fields(V& visit, Like<Coverage> auto& coverage) {
//     visit("sensor", coverage.triad);
//     visit("eigenvalues", coverage.eigenvalues);
//   }
//
// A visitor offers
//
//   visit(key, field, style)
//     states a field; a std::optional that is unset is left out.
//   visit.If(stated, key, field, style)
//     states a field only if `stated`; a reader accepts that it is missing.
//   visit.OrNull(key, optional, style)
//     states the optional, or null if it is unset.
//   visit.Group(key, style, fields)
//     puts some of the fields into a map of their own: it calls fields(visit).
//   visit.Named(stated, key, list)
//     states a list as a map whose keys are the `name` of each item.
//   visit.Comment(text)
//     writes a comment for the reader of the file.
//   visit.Check(key, wrong)
//     calls wrong(), which returns what is wrong with the value read, or an empty text.
//
//   visit.Skip(key)
//     exists in readers only: it accepts a key whose value follows from other fields.
//
// visit, If and OrNull return whether the field was present. V::kReads: whether fields are read.

/// Whether Thing is Of or const Of, so that one list of fields serves readers and writers.
template <typename Thing, typename Of>
concept Like = std::same_as<std::remove_const_t<Thing>, Of>;

/// How a file shows a field. Scalars, vectors, matrices and lists of these are always in one line.
enum class Style {
  kUsual,   ///< A map with a line per field; a list of maps with a line per map.
  kFlow,    ///< A map in one line.
  kBlocks,  ///< A list with a line per item; a map in it has a line per field.
};

/// Whether each T in a list is written as a row: its fields without names, its vectors flattened.
template <typename T>
inline constexpr bool kIsRow = false;

/// The condition of a field that is always written, but that older files lack: visit.If(kNewer, …).
inline constexpr bool kNewer = true;

/// A text that is one word and needs no quotes.
template <typename T>
struct Word {
  T& text;
};

/// An axis index 0, 1, 2, written as x, y, z.
template <typename T>
struct AxisLetterOf {
  T& axis;
};

template <typename T>
Word(T&) -> Word<T>;
template <typename T>
AxisLetterOf(T&) -> AxisLetterOf<T>;

/// Some fields as a map of their own, for use with visit.If; list(visit) states these fields.
template <typename List>
struct Part {
  List list;
};
template <typename List>
Part(List) -> Part<List>;
template <class V, typename List>
void Fields(V& visit, const Part<List>& part) {
  part.list(visit);
}

template <typename T>
inline constexpr bool kIsList = false;
template <typename T>
inline constexpr bool kIsList<std::vector<T>> = true;
template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <typename T>
inline constexpr bool kIsVector = false;
template <int kSize>
inline constexpr bool kIsVector<Eigen::Matrix<double, kSize, 1>> = true;
template <typename T>
inline constexpr bool kIsPerTriad = false;
template <typename T>
inline constexpr bool kIsPerTriad<PerTriad<T>> = true;

/// One entry per sensor; its key is the sensor's name.
template <class V, typename Values>
requires kIsPerTriad<std::remove_const_t<Values>>
void Fields(V& visit, Values& values) {
  for (const Triad triad : kTriads) visit(TriadName(triad), values[triad]);
}

template <class V>
void Fields(V& visit, Like<InputFile> auto& input) {
  visit("file", input.file);
  visit("sha256", input.sha256);
  visit("samples", input.samples);
}

/// Whether T has a list of fields.
class AnyVisitor;
template <typename T>
concept HasFields = requires(AnyVisitor& visit, T& thing) {
  Fields(visit, thing);
};

}  // namespace truetriad
