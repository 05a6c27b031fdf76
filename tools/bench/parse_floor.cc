// SPDX-License-Identifier: Apache-2.0
// Does the least that any program must do to read a text recording, for comparison of times.
//
//   parse_floor touch FILE...    maps the files and adds up their bytes
//   parse_floor parse FILE...    maps the files and converts every number with std::from_chars
//
// Prints the sum, so that nothing can be optimised away. Does no checks, hash or statistics.
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

std::string_view Map(const char* path) {
  const int descriptor = open(path, O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor < 0 || fstat(descriptor, &status) != 0 || status.st_size == 0) return {};
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor, 0);
  close(descriptor);
  return bytes == MAP_FAILED ? std::string_view()
                             : std::string_view(static_cast<char*>(bytes), size);
}

double SumOfBytes(std::string_view text) {
  return static_cast<double>(
      std::accumulate(text.begin(), text.end(), std::uint64_t{0}, [](std::uint64_t sum, char byte) {
        return sum + static_cast<unsigned char>(byte);
      }));
}

double SumOfNumbers(std::string_view text) {
  const char* at = text.data();
  const char* const end = at + text.size();
  double sum = 0.0;
  while (at < end) {
    double number = 0.0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error == std::errc()) sum += number;
    at = next > at ? next : at + 1;
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view mode = argc >= 3 ? argv[1] : "";
  if (mode != "touch" && mode != "parse") {
    std::fprintf(stderr, "usage: parse_floor touch|parse FILE...\n");
    return 1;
  }
  double sum = 0.0;
  for (int i = 2; i < argc; ++i) {
    const std::string_view text = Map(argv[i]);
    if (text.empty()) {
      std::fprintf(stderr, "%s: cannot be read, or is empty\n", argv[i]);
      return 2;
    }
    sum += mode == "touch" ? SumOfBytes(text) : SumOfNumbers(text);
  }
  std::printf("%.17g\n", sum);
}
